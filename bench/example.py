# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The robot of the worked example in docs/measured/timing.md: a scanner of 16 beams in the simulated street, mapped by the command."""
import json
import subprocess

RESOLUTION_M, MAX_RANGE_M, BUDGET, SCANS = 0.2, 40, "32M", 20
MODES = ("--inference", "multi-entropy", "--carving", "rays")  # Those whose bound the example works out.


def measure(tessera, out, scans=SCANS):
    def run(*words):
        subprocess.run([str(tessera), *(str(word) for word in words)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    street, report = out / "example", out / "example.json"
    run("simulate", "--scene", "street", "--robots", 2, "--scans", scans, "--seed", 1, "--out", street)
    run("map", "--dataset", street / "robot_1", "--resolution", RESOLUTION_M, "--max-range", MAX_RANGE_M, "--memory", BUDGET, *MODES,
        "--out", out / "example.tsm", "--report", report)
    found = json.loads(report.read_text())
    totals = found["totals"]
    counted = {key: sum(scan[key] for scan in found["scans"]) / scans for key in ("points", "thinned", "rays", "kernel_evaluations", "ray_steps")}
    return {**counted, "resolution_m": RESOLUTION_M, "max_range_m": MAX_RANGE_M, "budget": BUDGET, "scans": scans,
            "median_ms": totals["median_ms"], "max_ms": totals["max_ms"],
            "left_out": found["memory"]["refused"],
            **{key: found["memory"][key] for key in ("budget_bytes", "scratch_bytes", "used_bytes")}}
