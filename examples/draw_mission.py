#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""draw_mission.py OUT PNG: draws the latencies of the mission's nodes, and the growth of their shared map."""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of what draws

COLOURS = ("#1f6f8b", "#b8452c", "#5b7f2b", "#7a4f9a")
plt.rcParams.update({"figure.dpi": 110, "font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
                     "axes.titlesize": 10, "axes.titleweight": "bold", "legend.frameon": False})


def latencies(axes, reports):
    rows = (("scan's arrival to map", lambda r: r["mapping"]["latencies"]), ("mapping cycle", lambda r: r["scans"]["times"]),
            ("sharing tick", lambda r: r["ticks"]))
    for place, (_, times) in enumerate(rows):
        for i, (report, colour) in enumerate(zip(reports, COLOURS)):
            found = times(report)
            y = place + 0.25 * (i - (len(reports) - 1) / 2)
            axes.plot([found["median_ms"], found["max_ms"]], [y, y], color=colour, linewidth=1.2)
            axes.plot(found["median_ms"], y, "o", color=colour, label=f"robot {report['robot']}" if place == 0 else None)
            axes.plot(found["p99_ms"], y, "|", color=colour, markersize=12, markeredgewidth=2)
            axes.plot(found["max_ms"], y, "x", color=colour, markersize=5)
    axes.axvline(reports[0]["mapping"]["period_ms"], color="#444444", linewidth=1.0, dashes=(4, 3))
    axes.annotate("period of scans", (reports[0]["mapping"]["period_ms"], 1.0), xycoords=("data", "axes fraction"), fontsize=7, ha="right", va="bottom")
    axes.set_yticks(range(len(rows)), [name for name, _ in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlim(left=0)
    axes.set(xlabel="ms: median (dot), 99 % (bar), worst (cross)", title="Latencies")
    axes.grid(alpha=0.25, axis="x")
    axes.legend(loc="center right")


def growth(axes, report):
    snapshots = report["snapshots"]
    axes.step([s["after_s"] for s in snapshots], [s["label_voxels"] / 1e6 for s in snapshots], where="post", color=COLOURS[0])
    axes.set(xlabel="seconds since the start of robot 0's node", ylabel="voxels with a label [million]", title="The shared map")
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.25)


def main():
    out, path = sys.argv[1:]
    reports = [json.loads((pathlib.Path(out) / f"robot_{robot}.json").read_text()) for robot in range(len(list(pathlib.Path(out).glob("robot_?.json"))))]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 3.6), gridspec_kw={"width_ratios": [3, 2]})
    latencies(left, reports)
    growth(right, reports[0])
    figure.tight_layout()
    figure.savefig(path)


if __name__ == "__main__":
    main()
