#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""scan_instructions.py --build FOLDER --dataset FOLDER [--drive FOLDER] [--last N] [--into BENCH_JSON]: instructions of
every scan on its own, as the command maps it under callgrind: those of its step of the window, and of its integration.

The scans 0 .. N of --dataset at full range in three modes, two of them with free space too; all of --drive with a window. --into puts what is found into a
bench.json that is there already. A run of its own takes about six minutes."""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import sources

# The core's calls: one by the name that callgrind gives it, as it wants it whole, the other by its beginning.
INTEGRATE = "tessera::Integrator::integrate(tessera::LocalMap&, tessera::ScanView const&)"
STEP = "tessera::MovingWindow::step("
FULL_RANGE = ["--max-range", "0", "--free-space"]
# Name, title, options, and what the slowest scan may take of the median: required, aim.
RUNS = (
    ("kernel", "kernel, D = 3 voxels", [*FULL_RANGE, "off", "--inference", "kernel", "--kernel-length", "0.3", "--memory", "3G"], (1.3, 1.15)),
    ("multi_entropy", "multi-entropy", [*FULL_RANGE, "off", "--inference", "multi-entropy"], (1.3, 1.15)),
    ("multi_entropy_free_space", "multi-entropy, free space", [*FULL_RANGE, "on", "--inference", "multi-entropy"], (1.3, 1.15)),
    ("lattice", "lattice", [*FULL_RANGE, "off", "--inference", "lattice"], (1.15, None)),
    ("lattice_free_space", "lattice, free space", [*FULL_RANGE, "on", "--inference", "lattice"], (1.15, None)),
)
DRIVE = ("drive", "drive with a window", ["--labels", "none", "--resolution", "0.2", "--memory", "64M", "--window", "45"], (1.5, None))


def calls_in(text):
    """[(function called, instructions in it and in all that it calls)] of a callgrind profile."""
    names, called, found, is_cost = {}, "", [], False
    for line in text.splitlines():
        named = re.match(r"(c?)fn=\((\d+)\)(?: (.+))?$", line)
        if named:
            name = names.setdefault(named[2], named[3])
            called = name if named[1] else called
        elif is_cost:
            found.append((called, int(line.split()[-1])))
        is_cost = line.startswith("calls=")
    return found


def count(tessera, dataset, options, folder):
    """[(the window's, the integration's instructions)] of each scan, and the command's report."""
    report = folder / "map.json"
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder / 'counts'}", "--dump-line=no", f"--dump-after={INTEGRATE}",
         str(tessera), "map", "--dataset", str(dataset), *options, "--out", str(folder / "map.tsm"), "--report", str(report)],
        capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"scan_instructions.py: {done.stderr.strip()}")
    found = json.loads(report.read_text())
    scans = []
    for i in range(len(found["scans"])):  # a profile each
        calls = calls_in((folder / f"counts.{i + 1}").read_text())
        scans.append(tuple(sum(cost for name, cost in calls if name.startswith(wanted)) for wanted in (STEP, INTEGRATE)))
    if min(integration for _, integration in scans) == 0 or (folder / f"counts.{len(scans) + 1}").exists():
        sys.exit("scan_instructions.py: callgrind did not see every scan; were the calls renamed, or inlined?")
    return scans, found


def median(values):
    return sorted(values)[(len(values) - 1) // 2]


def measure_run(tessera, dataset, run, more=()):
    """A run's figures; a scan's instructions are those of its window's step and of its integration."""
    name, title, options, (required, aim) = run
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        if name == DRIVE[0]:
            more = [*more, "--archive", str(folder / "archive")]
        scans, report = count(tessera, dataset, [*options, *more], folder)
    totals = [sum(scan) for scan in scans]
    found = {"title": title, "options": " ".join(options), "instructions": totals, "of_these_window": [step for step, _ in scans],
             "first": totals[0], "median": median(totals), "worst": max(totals), "worst_over_median": max(totals) / median(totals),
             "required": required, "aim": aim, "refused": report["memory"]["refused"]}
    if "window" in report:
        found["window"] = report["window"]
    return found


def measure(build, dataset, last, drive):
    """{commit, runs: {run: figures}}; None where there is no valgrind."""
    if not shutil.which("valgrind"):
        return None
    tessera = build / "tessera"
    found = {run[0]: measure_run(tessera, dataset, run, ["--first", "0", "--last", str(last)]) for run in RUNS}
    if drive:
        found[DRIVE[0]] = {**measure_run(tessera, drive, DRIVE), "dataset": drive.resolve().name}
    return {"commit": sources.commit(), "runs": found}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=pathlib.Path, help="folder that CMake built in")
    parser.add_argument("--dataset", required=True, type=pathlib.Path, help="folder of a sequence")
    parser.add_argument("--drive", type=pathlib.Path, help="folder of a long sequence without labels")
    parser.add_argument("--last", type=int, default=5, help="last scan of --dataset")
    parser.add_argument("--into", type=pathlib.Path, help="bench.json to put the figures into")
    options = parser.parse_args()
    found = measure(options.build, options.dataset, options.last, options.drive)
    if found is None:
        sys.exit("scan_instructions.py: there is no valgrind; install it")
    if options.into:
        whole = json.loads(options.into.read_text())
        whole["scan_instructions"] = found
        options.into.write_text(json.dumps(whole, indent=1) + "\n")
    for run in found["runs"].values():
        print(f"{run['title']}: {run['worst_over_median']:.3f} of a median of {run['median']:,}; each: "
              + ", ".join(f"{count:,}" for count in run["instructions"]))


if __name__ == "__main__":
    main()
