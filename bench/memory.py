# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What a map takes, from the command's own reports: bytes a voxel, and what is used and refused in different budgets."""
import json
import subprocess

# Name, options, and the budgets that make sense for it (None: those asked for).
SETTINGS = (
    ("multi_entropy", "multi-entropy", ["--free-space", "off", "--inference", "multi-entropy"], None),
    ("multi_entropy_free_space", "multi-entropy, free space", ["--free-space", "on", "--inference", "multi-entropy"], None),
    ("multi_entropy_dense", "multi-entropy, dense counts", ["--free-space", "off", "--inference", "multi-entropy", "--counts", "dense"], ["512M"]),
    ("lattice", "lattice", ["--free-space", "off", "--inference", "lattice"], ["512M"]),
    ("kernel", "kernel, D = 3 voxels, dense counts", ["--free-space", "off", "--inference", "kernel", "--kernel-length", "0.3"], ["3G"]),
)
KEYS = ("budget_bytes", "scratch_bytes", "used_bytes", "peak_bytes", "label_voxels", "free_voxels", "bytes_per_label_voxel", "refused")


def map_once(tessera, dataset, last, budget, options, out):
    report = out / "map.json"
    subprocess.run([str(tessera), "map", "--dataset", str(dataset), "--first", "0", "--last", str(last), "--max-range", "0",
                    "--memory", budget, *options, "--out", str(out / "map.tsm"), "--report", str(report)],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    json_report = json.loads(report.read_text())
    return {**{key: json_report["memory"][key] for key in KEYS}, "heap_allocations": json_report["heap_allocations_after_init"]}


def measure(tessera, dataset, last, budgets, out):
    found = {"settings": {}}
    for name, title, options, own_budgets in SETTINGS:
        runs = {budget: map_once(tessera, dataset, last, budget, options, out) for budget in own_budgets or budgets}
        found["settings"][name] = {"title": title, "options": " ".join(options), "budgets": runs}
    # What free space costs, over the same scans in the same budget.
    with_free = found["settings"]["multi_entropy_free_space"]["budgets"]
    without = found["settings"]["multi_entropy"]["budgets"]
    found["bytes_per_free_voxel"] = {
        budget: (run["used_bytes"] - without[budget]["used_bytes"]) / run["free_voxels"]
        for budget, run in with_free.items() if run["refused"] == 0 and without[budget]["refused"] == 0 and run["free_voxels"]}
    return found
