#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""draw.py TEAM_JSON PICTURE: what a team costs by its size, and by what is lost."""
import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from plots import GREY, REQUIRED, plt  # noqa: E402  needs the path above

COLOURS = {"namespaces": "#b8452c", "simulated": "#1f6f8b", "once": "#8a6fb0", "drive": "#5a9e4b"}


def by_size(axes, found, what, scale, simulated):
    """simulated: the keys while publishing and at rest."""
    for state, key, style in (("publishing", simulated[0], "-"), ("at_rest", simulated[1], ":")):
        word = state.replace("_", " ")
        rows = found["namespaces"]
        axes.plot([row["robots"] for row in rows], [scale * row[state][what] for row in rows], style, marker="o",
                  color=COLOURS["namespaces"], label=f"processes, {word}")
        rows = found["simulated"]
        axes.plot([row["robots"] for row in rows], [scale * row[key] for row in rows], style, marker=".",
                  color=COLOURS["simulated"], label=f"simulated, {word}")
    sizes = sorted({row["robots"] for row in found["simulated"]})
    axes.set_xscale("log", base=2)
    axes.set_xticks(sizes, [str(size) for size in sizes])
    axes.set_yscale("log")
    axes.set_xlabel("robots")
    axes.grid(alpha=0.25)


def by_loss(axes, found):
    for i, (name, title) in enumerate((("once", "each block once"), ("drive", "as mapped"))):
        rows = found["by_loss"][name]
        places = [x + 0.4 * (i - 0.5) for x in range(len(rows))]
        ratios = [row["bytes"] / rows[0]["bytes"] for row in rows]
        axes.bar(places, ratios, color=COLOURS[name], width=0.38, label=title)
        for place, row, ratio in zip(places, rows, ratios):
            axes.annotate(f"{ratio:.2f}\n{row['settled_s']:.{int(row['settled_s'] < 10)}f} s", (place, ratio), xytext=(0, 3), textcoords="offset points",
                          ha="center", fontsize=6)
    axes.axhline(1.8, **REQUIRED)
    axes.annotate("at most, at 30 %", (-0.4, 1.8), xytext=(0, 3), textcoords="offset points", fontsize=7)
    axes.set_xticks(range(len(rows)), [f"{row['loss']:.0%}" for row in rows])
    axes.set_ylim(0, 1.15 * axes.get_ylim()[1])
    axes.set(xlabel="loss on every link", ylabel="bytes sent / bytes sent without loss",
             title="3 robots, until all are equal")
    axes.legend(loc="upper left", fontsize=7)


def main():
    found = json.loads(pathlib.Path(sys.argv[1]).read_text())
    figure, (size, cpu, loss) = plt.subplots(1, 3, figsize=(12, 4.2))
    by_size(size, found, "bytes", 1e-3, ("bytes_per_robot_s", "rest_bytes_per_robot_s"))
    size.set(ylabel="kB a second", title="Sent by a robot")
    by_size(cpu, found, "cpu", 1e3, ("cpu_per_robot_s", "rest_cpu_per_robot_s"))
    cpu.set(ylabel="ms a second", title="CPU time of a robot")
    handles, labels = size.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.04, 0.045), ncol=4, fontsize=7)
    by_loss(loss, found)
    figure.suptitle("What a team costs", fontsize=12, fontweight="bold", x=0.01, ha="left")
    at = found["circumstances"]
    figure.text(0.01, 0.01, f"left: {found['blocks_per_s']} blocks a second each, {found['loss']:.0%} loss; right: {found['scene']}; {at['cpu']}, {at['commit']}", fontsize=7, color=GREY)
    figure.tight_layout(rect=(0, 0.09, 1, 1))
    figure.savefig(sys.argv[2])


main()
