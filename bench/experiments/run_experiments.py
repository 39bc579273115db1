#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""run_experiments.py: the paper's studies with the command, into OUT/experiments.json. run-experiments.sh calls it once
everything is installed and built."""
import argparse
import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import diffusion  # noqa: E402  these need the path above
import robustness  # noqa: E402
import street  # noqa: E402
import table_two  # noqa: E402
import teams  # noqa: E402
import weighted_labels  # noqa: E402
from run import circumstances  # noqa: E402
from workshop import Workshop  # noqa: E402

# (seed, robots, scans) of the large scenes; (seed, scans) of pairs that pass each other, the first also for the sweeps.
FULL = {"scenes": ((1, 8, 300), (2, 4, 300)), "pairs": ((1, 40), (2, 40), (1, 20), (2, 20)), "halves": ((0, 2), (3, 5))}
QUICK = {"scenes": ((1, 4, 80),), "pairs": ((1, 20),), "halves": ((0, 0), (3, 3))}


def compiler_of(program):
    """What the program itself says about it, such as "GCC: (Debian 12.2.0-14) 12.2.0"."""
    try:
        done = subprocess.run(["readelf", "-p", ".comment", str(program)], capture_output=True, text=True)
    except OSError:
        return "unknown"
    found = [line.partition("]")[2].strip() for line in done.stdout.splitlines() if "]" in line]
    return ", ".join(found) or "unknown"


def pair_rows(pair):
    """A simulated pair as Table II has the real one."""
    rows = {f"local_{letter}": pair.judge_local(robot) for robot, letter in enumerate("ab")}
    rows["resampled"] = pair.judge_resampled()
    rows["together"] = pair.judge_together()
    for name, options in table_two.METHODS.items():
        rows[name] = pair.judge_global(f"right_{name}", **options)
    return {"seed": pair.seed, "scans": pair.scans, "rows": rows}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tessera", required=True, type=pathlib.Path, help="the command")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--dataset", type=pathlib.Path, help="folder of semantickitti_08; without it simulated scenes alone")
    parser.add_argument("--quick", action="store_true", help="less of everything: does it still work?")
    options = parser.parse_args()
    plan = QUICK if options.quick else FULL
    # Names of maps say what was made of which scans only within a plan.
    workshop = Workshop(options.tessera.resolve(), options.out.resolve() / ("made_quick" if options.quick else "made"))
    version = subprocess.run([options.tessera, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    found = {"circumstances": circumstances(), "compiler": compiler_of(options.tessera), "version": version,
             "plan": "quick" if options.quick else "full"}
    print("two robots that pass each other ...", flush=True)
    pairs = [street.Pair(workshop, seed, scans) for seed, scans in plan["pairs"]]
    found["pairs"] = [pair_rows(pair) for pair in pairs]
    studied = {"street": (pairs[0], street.RESOLUTION_M)}
    if options.dataset:
        print("Table II, real scans ...", flush=True)
        dataset = options.dataset.resolve()
        found["table_two"] = table_two.measure(workshop, dataset, plan["halves"])
        studied["real"] = (robustness.RealPair(workshop, dataset, plan["halves"]), table_two.RESOLUTION_M)
    for name, (pair, resolution_m) in studied.items():
        print(f"settings of diffusion, {name} ...", flush=True)
        found.setdefault("diffusion", {})[name] = diffusion.measure(pair, resolution_m, options.quick)
        print(f"robustness, {name} ...", flush=True)
        found.setdefault("robustness", {})[name] = robustness.measure(pair, options.quick)
    print("labels with weights ...", flush=True)
    found["weighted_labels"] = weighted_labels.measure(workshop, plan["pairs"])
    print("Table III, teams in a long street ...", flush=True)
    found["teams"] = teams.measure(workshop, plan["scenes"])
    (options.out / "experiments.json").write_text(json.dumps(found, indent=1) + "\n")
    print(f"figures: {options.out / 'experiments.json'}")


if __name__ == "__main__":
    main()
