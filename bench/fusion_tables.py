# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/measured/benchmarks.md about the global map."""
from markdown import number, paragraph, table


def row(name, times, required="-"):
    return (name, *(number(times[key]) for key in ("min", "median", "p99", "max")), required)


def fusion(found):
    part = found.get("fusion")
    if part is None:
        return None
    changed, moved = part["changed"], part["moved"]
    rows = [row("from nothing, all handed over", part["from_nothing"]["publish"]["cpu_ms"]),
            row("from nothing, fused", part["from_nothing"]["fuse"]["cpu_ms"]),
            row("from nothing, both", part["from_nothing"]["cpu_ms"], "150 / 60 (300,000 voxels each)"),
            row("the same, one robot turned", part["from_nothing_turned"]["cpu_ms"]),
            row("plain fusion", part["plain"]["cpu_ms"]),
            row(f"{changed['voxels']:,} voxels changed, in {changed['blocks']:.0f} blocks", changed["cpu_ms"], "5 / 2"),
            row("a robot moves: one slice", moved["slices"]["cpu_ms"], "5"),
            row("a robot moves: all slices", moved["cpu_ms"])]
    a, b = part["label_voxels"]
    said = (f"Maps of {a:,} and {b:,} label voxels, {part['nodes']:,} nodes; replicas take {part['replica_bytes_per_label_voxel']:.1f} bytes "
            f"a label voxel (required: 12). The plain fusion takes {part['plain_over_this']:.1f} times as long. A slice is "
            f"`step({moved['slice_work']:,})`; the largest did {moved['most_work_of_a_slice']:,.0f}.")
    return table(("ms on a core", "min", "median", "p99", "max", "required / aim"), rows) + "\n\n" + paragraph(said)
