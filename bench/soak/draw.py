#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""draw.py MINUTES_JSONL PNG: draws what a soak found after each virtual minute."""
import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from plots import GREY, plt  # noqa: E402  needs the path above

BLUE, RED, GREEN = "#1f6f8b", "#b8452c", "#5a9e4b"


def main():
    rows = [json.loads(line) for line in pathlib.Path(sys.argv[1]).read_text().splitlines()]
    minutes = [row["minute"] for row in rows]
    figure, axes = plt.subplots(2, 3, figsize=(12.5, 6.2), sharex=True)

    def draw(place, title, unit, *series):
        for name, colour, values in series:
            axes.flat[place].plot(minutes, values, color=colour, label=name, linewidth=1.2)
        axes.flat[place].set(title=title, ylabel=unit)
        axes.flat[place].set_ylim(bottom=0)
        axes.flat[place].grid(alpha=0.25)
        if len(series) > 1:
            axes.flat[place].legend(fontsize=7)

    draw(0, "Memory of all robots", "MiB", ("given", GREY, [row["given_mib"] for row in rows]),
         ("in use", BLUE, [row["used_mib"] for row in rows]), ("resident, the bench's own too", RED, [row["resident_mib"] for row in rows]))
    draw(1, "Digests: equal after", "s beyond the minute", ("all", BLUE, [row["settle_s"] for row in rows]))
    for row in rows:
        if row["partitioned"]:
            axes.flat[1].axvspan(row["minute"] - 0.5, row["minute"] + 0.5, color=GREY, alpha=0.2, linewidth=0)
        if not row["agrees"]:
            axes.flat[1].axvline(row["minute"], color=RED)
    of_occupied = [100.0 / max(1, row["occupied"]) for row in rows]
    draw(2, "Occupied voxels far from a true surface", "%",
         ("by drift that is not corrected yet", BLUE, [share * (row["far"] - row["false"]) for share, row in zip(of_occupied, rows)]),
         ("false", RED, [share * row["false"] for share, row in zip(of_occupied, rows)]))
    draw(3, "Contributions", "", ("held", BLUE, [row["contributions"] for row in rows]),
         ("misplaced", RED, [row["misplaced"] for row in rows]))
    draw(4, "Time a virtual minute", "s", ("processor", BLUE, [row["processor_s"] for row in rows]))
    draw(5, "Since the begin", "", ("kills", RED, [row["kills"] for row in rows]), ("maps begun empty", GREEN, [row["maps"] for row in rows]),
         ("corrections", BLUE, [row["corrections"] for row in rows]))
    for below in axes[1]:
        below.set(xlabel="virtual minutes")
    figure.text(0.01, 0.01, "grey in the second: a partition at the minute's end, robots that hear each other are compared", fontsize=7, color=GREY)
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.savefig(sys.argv[2])


if __name__ == "__main__":
    main()
