#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""write_tables.py TEAM_JSON DOCS: puts the figures into DOCS/teams.md, as bench/write_docs.py does."""
import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))

from markdown import number, table  # noqa: E402  these need the path above
from write_docs import fill  # noqa: E402


def team_size(found):
    processes = {row["robots"]: row for row in found["namespaces"]}
    rows = []
    for row in found["simulated"]:
        real = processes.get(row["robots"])

        def of(state, key, scale):
            return number(scale * real[state][key], 2) if real else "-"
        rows.append((row["robots"], of("publishing", "bytes", 1e-3), of("at_rest", "bytes", 1e-3), of("publishing", "cpu", 1e3),
                     of("at_rest", "cpu", 1e3), number(1e-3 * row["bytes_per_robot_s"], 2),
                     number(1e-3 * row["rest_bytes_per_robot_s"], 2), number(1e3 * row["cpu_per_robot_s"], 2),
                     number(1e3 * row["rest_cpu_per_robot_s"], 2)))
    return table(("robots", "processes: kB/s", "at rest", "CPU, ms/s", "at rest", "simulated: kB/s", "at rest", "CPU, ms/s", "at rest"), rows)


def team_loss(found):
    workloads = [found["by_loss"]["once"], found["by_loss"]["drive"]]
    rows = []
    for at_loss in zip(*workloads):
        row = [f"{at_loss[0]['loss']:.0%}"]
        for workload, here in zip(workloads, at_loss):
            row += [f"{here['bytes']:,}", f"{here['bytes'] / workload[0]['bytes']:.2f}", f"{here['settled_s']:.1f} s"]
        rows.append(row)
    return table(("loss", "each block once: bytes sent by all", "by those without loss", "until all are equal",
                  "as mapped: bytes sent by all", "by those without loss", "until all are equal"), rows)


def main():
    found = json.loads(pathlib.Path(sys.argv[1]).read_text())
    page = pathlib.Path(sys.argv[2]) / "teams.md"
    text, used = fill(page.read_text(), found, {"team_size": team_size, "team_loss": team_loss})
    if len(used) != 2:
        sys.exit(f"{page} has no place for team_size and team_loss")
    page.write_text(text)


main()
