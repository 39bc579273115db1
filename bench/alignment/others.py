# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What PCL finds in the points that the maps were made from: point-to-plane ICP and GICP begun at the identity, and sample consensus on
fast point feature histograms (FPFH) with GICP after it. Debian's libpcl-dev is needed; without it this is left out."""
import pathlib
import subprocess
import sys

from datasets import IDENTITY, inverse
from judging import is_within
from negatives import pairs_of
from transforms import FALSE_DEG, FALSE_M, draw, error, rows_of

HERE = pathlib.Path(__file__).resolve().parent
PACKAGES = ("pcl_registration", "pcl_features", "pcl_filters")
METHODS = ("icp", "gicp", "fpfh")
LEAST_SHARE = 0.25  # Of B's points near one of A: PCL's own rule of when a consensus was found, asked of all three.


def program_of(out):
    """Compiled once; None where PCL is not installed."""
    asked = subprocess.run(["pkg-config", "--cflags", "--libs", *PACKAGES], capture_output=True, text=True)
    if asked.returncode != 0:
        return None
    source, program = HERE / "pcl_pair.cpp", out / "pcl_pair"
    if not program.exists() or program.stat().st_mtime < source.stat().st_mtime:
        print("  compiling pcl_pair", flush=True)
        subprocess.run(["c++", "-std=c++17", "-O2", "-w", source, "-o", program, *asked.stdout.split()], check=True)
    return program


class Others:
    def __init__(self, workshop, program, python):
        self.workshop, self.program, self.python = workshop, program, python

    def points(self, scene, half):
        def write(path, words):
            done = subprocess.run([self.python, "-B", HERE / "raw_icp.py", *map(str, words), path], capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(f"alignment.py: {done.stderr.strip()}")
        return scene.points(half, write)

    def ask(self, name, a, b, T_moved):
        """By method: seconds of CPU, whether it is accepted, T_a_b. B's points are moved by T_moved first."""
        words = [a, b, *(repr(number) for row in T_moved for number in row)]

        def make():
            done = subprocess.run([self.program, *map(str, words)], capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(f"alignment.py: pcl_pair: {done.stderr.strip()}")
            found = {}
            for line in done.stdout.splitlines():
                method, used_s, converged, share, *numbers = line.split()
                found[method] = {"cpu_s": float(used_s), "accepted": converged == "1" and float(share) >= LEAST_SHARE, "share": float(share),
                                 "transform": [float(number) for number in numbers]}
            return found
        return self.workshop.kept(f"{name}.pcl", words, make, program="pcl_pair")


def outcome(accepted, used_s, m, deg, bounds):
    right = accepted and m <= FALSE_M and deg <= FALSE_DEG
    return {"accepted": accepted, "cpu_s": used_s, "right": right, "false": accepted and not right,
            "within": is_within({"accepted": accepted, "m": m, "deg": deg}, bounds)}


def pair(others, scene, name, report, exact, T_moved, bounds):
    """tessera and the others on one pair; report: of tessera align."""
    about = report["covariance_about"]
    trial = {"tessera": outcome(report["accepted"], report["cpu_s"], *error(rows_of(report["transform"]), exact, about), bounds)}
    asked = others.ask(name, others.points(scene, 0), others.points(scene, 1), T_moved)
    for method in METHODS:
        trial[method] = outcome(asked[method]["accepted"], asked[method]["cpu_s"],
                                *error(rows_of(asked[method]["transform"]), exact, about), bounds)
    print(f"  {name}: " + ", ".join(f"{method} {'found' if of['within'] else 'FALSE' if of['false'] else 'near' if of['right'] else 'no'} "
                                    f"{of['cpu_s']:.1f} s" for method, of in trial.items()), flush=True)
    return trial


def measure(workshop, recorded, streets, python, trials, street_bounds):
    """The first trials of each scene and the first streets, and as many pairs of different places. None without PCL."""
    program = program_of(workshop.out)
    if program is None:
        print("  PCL is not installed (libpcl-dev): left out")
        return None
    others, rows = Others(workshop, program, python), []
    for scene in recorded:
        row = {"title": scene.title, "trials": []}
        for seed in range(1, trials + 1):
            report = workshop.align(f"{scene.name}_{seed}", scene.map(0), scene.moved_path(seed), lambda: scene.map_moved(seed))
            row["trials"].append(pair(others, scene, f"{scene.name}_{seed}", report, inverse(draw(seed)), draw(seed), scene.bounds))
        rows.append(row)
    row = {"title": streets[0].title, "trials": []}
    for scene in streets[:trials]:
        report = workshop.align(scene.name, scene.map(0), scene.map(1))
        row["trials"].append(pair(others, scene, scene.name, report, scene.exact(), IDENTITY, street_bounds))
    rows.append(row)
    row = {"title": "different places", "trials": []}
    for _, a, b in pairs_of(streets, recorded)[:trials]:
        name = f"negative_{a.name}_{b.name}"
        report = workshop.align(name, a.map(0), b.map(1))
        asked = others.ask(name, others.points(a, 0), others.points(b, 1), IDENTITY)
        every = {"tessera": report, **asked}
        row["trials"].append({method: {"accepted": of["accepted"], "false": of["accepted"], "within": False, "right": False, "cpu_s": of["cpu_s"]}
                              for method, of in every.items()})
    return [*rows, row]
