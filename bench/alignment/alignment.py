#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""alignment.py --tessera PROGRAM --data FOLDER --out OUT: how well tessera align finds the transform between two maps of one place, and
whether it accepts one between maps of different places.

Prints tables and leaves alignment.json in OUT. Alignments are kept in OUT: a run that was stopped goes on where it was. Trial k of a recorded
scene has the transform that seed k draws; a street is that of simulate --seed. Rows that are not named keep what OUT/alignment.json has of
them. With --write-docs fills docs/measured/alignment.md. All of it takes two hours and a half on one core, most of it to simulate streets."""
import argparse
import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path += [str(HERE.parent), str(HERE.parent / "experiments")]

import fused  # noqa: E402  these need the paths above
import judging  # noqa: E402
import negatives  # noqa: E402
import others  # noqa: E402
import scenes  # noqa: E402
import tables  # noqa: E402
from datasets import inverse  # noqa: E402
from run import circumstances  # noqa: E402
from transforms import draw, error, rows_of  # noqa: E402

ROWS = (*scenes.RECORDED, *scenes.STREETS, "negatives", "fused", "others")
LABELLED = "semantickitti_08"
STREET_BOUNDS = (0.1, 0.2)


def raw_icp(workshop, scene, python):
    """T_a_b of the halves as they are by their points; None where python has no scipy."""
    if subprocess.run([python, "-c", "import numpy, scipy"], capture_output=True).returncode != 0:
        print(f"  {python} has no numpy and scipy: no column for ICP")
        return None
    words = [str(HERE / "raw_icp.py"), *map(str, scene.icp_words())]

    def make():
        done = subprocess.run([python, "-B", *words], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"alignment.py: {done.stderr.strip()}")
        return [float(word) for word in done.stdout.split()]
    found = workshop.kept(f"{scene.name}.icp", words[1:], make, program="raw_icp.py")
    return rows_of(found)


def overlap(workshop, scene):
    """The smaller share of occupied voxels with a partner at the exact transform."""
    maps, T_a_b = (scene.map(0), scene.map(1)), scene.exact()

    def make():
        return min(judging.shared(workshop, *maps, inverse(T_a_b)), judging.shared(workshop, *reversed(maps), T_a_b))
    return workshop.kept(f"{scene.name}.overlap", ["overlap", *maps], make)


def report_trial(seed, trial):
    what = "found" if trial["accepted"] else f"refused, {trial['reason']}"
    wrong = " FALSE" if trial["false"] else ""
    print(f"  {seed}: {what}; {trial['m']:.3f} m, {trial['deg']:.2f} degrees, support {trial['support']:.0f}{wrong}", flush=True)


def recorded(workshop, scene, seeds, python):
    icp = raw_icp(workshop, scene, python)
    row = {"title": scene.title, "truth": "poses", "bounds": scene.bounds, "overlap": [overlap(workshop, scene)], "trials": []}
    for seed in seeds:
        report = workshop.align(f"{scene.name}_{seed}", scene.map(0), scene.moved_path(seed), lambda: scene.map_moved(seed))
        trial = judging.judged(report, inverse(draw(seed)), icp)
        report_trial(seed, trial)
        row["trials"].append({"seed": seed, **trial})
        if icp is not None and trial["accepted"]:
            row["poses_against_icp"] = error(icp, scene.exact(), report["covariance_about"])
    return row


def streets(workshop, apart_m, seeds):
    row = {"title": scenes.title_of_streets(apart_m), "truth": "exact", "bounds": STREET_BOUNDS, "overlap": [], "trials": []}
    for seed in seeds:
        scene = scenes.Street(workshop, seed, apart_m)
        trial = judging.judged(workshop.align(scene.name, scene.map(0), scene.map(1)), scene.exact())
        row["overlap"].append(overlap(workshop, scene))
        report_trial(seed, trial)
        row["trials"].append({"seed": seed, **trial})
    return row


def parsed():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tessera", required=True, type=pathlib.Path, help="the command")
    parser.add_argument("--data", required=True, type=pathlib.Path, help="folder of recorded scans; scenes that it does not have are left out")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=list(ROWS), metavar="NAME", help=", ".join(ROWS) + "; all unless given")
    parser.add_argument("--resolution", type=float, default=0.2, help="of all maps, m; 0.2 unless given; another one needs another OUT")
    parser.add_argument("--trials", type=int, default=200, help="of each recorded scene, by seeds 1 to N; 200 unless given")
    parser.add_argument("--streets", type=int, default=100, help="how many; 100 unless given")
    parser.add_argument("--first-street", type=int, default=1, help="the seed of the first one; 1 unless given")
    parser.add_argument("--fused", type=int, default=10, help="trials of the fused map, by seeds 1 to N; 10 unless given")
    parser.add_argument("--others", type=int, default=10, help="trials of each scene that PCL's methods do, too; 10 unless given")
    parser.add_argument("--pairs", type=int, default=1000, help="of different places, at most; 1000 unless given")
    parser.add_argument("--python", default="/usr/bin/python3", help="one that has numpy and scipy, for ICP; the system's unless given")
    parser.add_argument("--write-docs", action="store_true")
    return parser.parse_args()


def main():
    options = parsed()
    workshop = judging.Aligner(options.tessera.resolve(), options.out.resolve(), options.resolution)
    path = workshop.out / "alignment.json"
    found = json.loads(path.read_text()) if path.exists() else {"rows": {}}
    found["circumstances"] = circumstances()
    found["version"] = subprocess.run([options.tessera, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    there, street_seeds = scenes.data_of(options.data), range(options.first_street, options.first_street + options.streets)
    for name in options.rows:
        if name in scenes.RECORDED and name not in there:
            print(f"{name}: not in {options.data}")
            continue
        print(f"{name} ...", flush=True)
        if name in scenes.STREETS:
            found["rows"][name] = streets(workshop, scenes.STREETS[name], street_seeds)
        elif name == "fused":
            if LABELLED in there:
                found[name] = fused.measure(workshop, scenes.Recorded(workshop, options.data.resolve(), LABELLED), range(1, options.fused + 1))
        elif name == "others":
            drives = [scenes.Recorded(workshop, options.data.resolve(), scene) for scene in there if scene in scenes.RECORDED]
            towns = [scenes.Street(workshop, seed) for seed in street_seeds[:max(2, options.others)]]
            if (measured := others.measure(workshop, drives, towns, options.python, options.others, STREET_BOUNDS)) is not None:
                found[name] = measured
        elif name == "negatives":
            found[name] = negatives.measure(workshop, [scenes.Street(workshop, seed) for seed in street_seeds],
                                            [scenes.Recorded(workshop, options.data.resolve(), scene) for scene in there], options.pairs)
        else:
            scene = scenes.Recorded(workshop, options.data.resolve(), name)
            found["rows"][name] = recorded(workshop, scene, range(1, options.trials + 1), options.python)
        path.write_text(json.dumps(found, indent=1) + "\n")
    for name, written in tables.TABLES.items():
        text = written(found)
        print(f"\n{name}\n{text}" if text else f"\n{name}: not measured")
    print(f"\nfigures: {path}")
    if options.write_docs:
        tables.write(found, HERE.parents[1] / "docs" / "measured" / "alignment.md")


if __name__ == "__main__":
    main()
