#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""draw.py ONBOARD_JSON PNG: draws how long a node's work took, from a sensor to the map and from the network to all of it."""
import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from plots import GREY, plt  # noqa: E402  needs the path above

COLOURS = ("#1f6f8b", "#b8452c")


def counted(axes, title, series):
    """series: by name, pairs of the most milliseconds of a bucket and how many fell into it."""
    for (name, buckets), colour in zip(series.items(), COLOURS):
        edges = [0.0] + [most for most, _ in buckets]
        axes.stairs([count for _, count in buckets], edges, color=colour, label=name)
    axes.set(title=title, xlabel="ms", yscale="log")
    axes.grid(alpha=0.25)


def reactions(axes, found):
    for (name, times_ms), colour in zip(found.items(), COLOURS):
        axes.hist(times_ms, bins=[20 * i for i in range(31)], histtype="step", color=colour, label=name)
    axes.set(title="bus: frame to heartbeat", xlabel="ms")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=7)


def staleness(report):
    eighth_ms = 1e3 * report["config"]["publish"]["staleness_s"] / 8
    return [((i + 1) * eighth_ms, count) for i, count in enumerate(report["publisher"]["by_staleness"])]


def main():
    found = json.loads(pathlib.Path(sys.argv[1]).read_text())
    runs = {f"deadline {name}": report for name, report in found["runs"].items()}
    figure, axes = plt.subplots(1, 5, figsize=(14, 3.4))
    counted(axes[0], "mapping cycle", {name: r["mapping"]["cycle_times"]["buckets"] for name, r in runs.items()})
    counted(axes[1], "sensor to map", {name: r["mapping"]["latencies"]["buckets"] for name, r in runs.items()})
    counted(axes[2], "map to wire", {name: staleness(r) for name, r in runs.items()})
    counted(axes[3], "wire to global map", {name: r["receive_times"]["buckets"] for name, r in runs.items()})
    if "reactions_ms" in found:
        reactions(axes[4], found["reactions_ms"])
    axes[0].set_ylabel("how often")
    axes[0].set_ylim(top=8 * axes[0].get_ylim()[1])
    axes[0].legend(fontsize=7, loc="upper left")
    at = found["circumstances"]
    figure.text(0.01, 0.01, f"{found['seconds']} s each, {at['cpu']}, {at['commit']}; a shared virtual machine", fontsize=7, color=GREY)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    figure.savefig(sys.argv[2])


if __name__ == "__main__":
    main()
