# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Calls of tessera align, what became of them against the exact transform, and sums of that."""
import json
import math
import resource
import statistics
import subprocess
import sys

from transforms import apply, error, is_false, offset, product, rows_of
from workshop import Workshop

FOUND, REFUSED = 0, 2
LEAST_PROBABLE = 0.05


def cpu_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Aligner(Workshop):
    """mapped: how all its maps are made."""

    def __init__(self, tessera, out, resolution_m):
        super().__init__(tessera, out)
        self.mapped = ["--resolution", resolution_m, "--memory", "600M"]

    def align(self, name, a, b, make_b=None):
        """The report, with cpu_s. It is kept: what is asked again, of this program, is not made again. A map that make_b makes is
        removed afterwards."""
        words = ["align", a, b]

        def make():
            report = self.out / "report.json"
            if make_b is not None:
                make_b()
            since = cpu_s()
            done = subprocess.run([str(self.tessera), *map(str, words), "--report", str(report)], capture_output=True, text=True)
            used_s = cpu_s() - since
            if done.returncode not in (FOUND, REFUSED):
                sys.exit(f"alignment.py: tessera align {a} {b}: {done.stderr.strip()}")
            found = json.loads(report.read_text())
            if found["accepted"] != (done.returncode == FOUND):
                sys.exit(f"alignment.py: tessera align {a} {b}: ended with {done.returncode}, accepted {found['accepted']}")
            if make_b is not None:
                b.unlink()
            return {**found, "cpu_s": used_s}
        return self.kept(f"{name}.align", words, make)


def outcome(report):
    """What is kept of any pair."""
    return {"accepted": report["accepted"], "reason": report["reason"], "support": report["support"],
            "support_second": report["support_second"], "share": report["agreement"]["share"], "cpu_s": report["cpu_s"]}


def judged(report, exact, icp=None):
    """Against the exact T_a_b, and against it as ICP of the points of both halves corrects it."""
    found, about = rows_of(report["transform"]), report["covariance_about"]
    trial = {**outcome(report), "sigma_m": report["sigma_m"], "sigma_deg": report["sigma_deg"]}
    trial["off_m"] = offset(found, exact, about)
    trial["m"], trial["deg"] = error(found, exact, about)
    trial["false"] = trial["accepted"] and is_false(trial["m"], trial["deg"])
    if icp is not None:
        trial["icp_off_m"] = offset(found, product(icp, exact), about)
        trial["icp_m"], trial["icp_deg"] = error(found, product(icp, exact), about)
    return trial


def is_within(trial, bounds, against=""):
    return trial["accepted"] and trial[against + "m"] <= bounds[0] and trial[against + "deg"] <= bounds[1]


def at_share(values, share):
    """The value that this share of all does not exceed."""
    ordered = sorted(values)
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


def spread(values):
    return [at_share(values, share) for share in (0.5, 0.95, 1.0)]


def along_axes(offsets):
    """Mean and standard deviation along x, y and z."""
    return [(statistics.fmean(axis), statistics.pstdev(axis)) for axis in zip(*offsets)]


def reasons(trials):
    """How many were refused for which reason, and the largest support among them, most frequent first."""
    found = {}
    for trial in trials:
        if not trial["accepted"]:
            count, most = found.get(trial["reason"], (0, -math.inf))
            found[trial["reason"]] = (count + 1, max(most, trial["support"]))
    return dict(sorted(found.items(), key=lambda item: (-item[1][0], item[0])))


def upper_limit(accepted, pairs):
    """Of the share of accepted pairs, 95 %: of none, 3 / pairs. The mean at which so few are LEAST_PROBABLE."""
    low, high = 0.0, 20.0 + 3.0 * accepted
    for _ in range(60):
        mean = (low + high) / 2.0
        probable = sum(math.exp(-mean) * mean**i / math.factorial(i) for i in range(accepted + 1))
        low, high = (mean, high) if probable > LEAST_PROBABLE else (low, mean)
    return min(1.0, high / pairs)


def shared(workshop, a, b, T_b_a, every=5):
    """The share of a's occupied voxels whose centre, of every fifth one, is in an occupied voxel of b."""
    voxels, points, states = (workshop.out / name for name in ("voxels.csv", "points.csv", "states.csv"))
    workshop.call("export", "--map", a, "--out", voxels)
    with voxels.open() as lines, points.open("w") as asked:
        asked.write("x,y,z\n")
        for number, line in enumerate(lines):
            if number % every == 1:
                x, y, z = apply(T_b_a, [float(word) for word in line.split(",", 3)[:3]])
                asked.write(f"{x:.4f},{y:.4f},{z:.4f}\n")
    workshop.call("query", "--map", b, "--points", points, "--out", states)
    with states.open() as lines:
        next(lines)
        found = [line.split(",", 4)[3] == "occupied" for line in lines]
    for path in (voxels, points, states):
        path.unlink()
    return sum(found) / len(found)
