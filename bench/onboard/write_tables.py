#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""write_tables.py ONBOARD_JSON [DOCS]: prints the figures as tables, and puts them into DOCS/timing.md."""
import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from markdown import number, table  # noqa: E402  these need the path above
from write_docs import fill  # noqa: E402


def spread(times):
    return ", ".join(f"{times[key]:.1f}" for key in ("median_ms", "p99_ms", "max_ms"))


def share(part, whole):
    return f"{100 * part / max(whole, 1):.0f} %"


def mib(size):
    return f"{size / 2**20:.0f}"


def freed(report):
    """Blocks for each scan."""
    return report["scans"]["free_blocks"] / max(report["mapping"]["cycles"], 1)


def onboard(found):
    # Without a deadline it is for comparison only.
    runs = {name: report for name, report in found["runs"].items() if name != "none"}
    rows = {name: [] for name in (
        "cycles, missed, lost", "mapping cycle, ms: median, p99, max", "sensor to map, ms: median, p99, max",
        "of the thinned points, in the map", "of the space that a scan frees without it, freed", "wire to global map, ms: median, p99, max", "sharing tick of 50 ms, ms: median, p99, max",
        "ticks a period late or more", "minor and major page faults of the mapping thread", "heap allocations after the start",
        "resident memory after 1 min, at the end, MiB", "start to the first scan in the map, ms", "processors busy", "MB/s heard, said", "contributions, whole")}
    for report in runs.values():
        mapping, scans, seconds = report["mapping"], report["scans"], report["seconds"]
        resident = report["resident_bytes_each_10_s"]
        cells = (f"{mapping['cycles']}, {mapping['missed']}, {mapping['lost']}", spread(mapping["cycle_times"]), spread(mapping["latencies"]),
                 share(scans["points_kept"], scans["thinned"]), share(freed(report), freed(found["runs"]["none"])), spread(report["receive_times"]),
                 spread(report["ticks"]), f"{report['ticks']['overruns']} of {report['ticks']['count']}",
                 f"{mapping['minor_page_faults']}, {mapping['major_page_faults']}", str(report["heap_allocations_after_start"]),
                 f"{mib(resident[min(5, len(resident) - 1)])}, {mib(resident[-1])}", f"{report['realtime']['first_scan_ms']:.0f}",
                 number(report["cpu_seconds"] / seconds, 2), f"{report['received_bytes'] / seconds / 1e6:.2f}, {report['sent_bytes'] / seconds / 1e6:.2f}",
                 f"{report['exchange']['contributions']}, {report['exchange']['complete']}")
        for row, cell in zip(rows.values(), cells):
            row.append(cell)
    return table(("", *(f"deadline of {name}" for name in runs)), [(name, *cells) for name, cells in rows.items()])


def reactions(found):
    rows = []
    for name, times_ms in found.get("reactions_ms", {}).items():
        ordered = sorted(times_ms)
        rows.append((name, len(ordered), number(ordered[len(ordered) // 2]), number(ordered[int(0.99 * (len(ordered) - 1))]), number(ordered[-1])))
    return table(("from the frame to the heartbeat, ms", "times", "median", "p99", "max"), rows)


def main():
    found = json.loads(pathlib.Path(sys.argv[1]).read_text())
    at = found["circumstances"]
    parts = {"onboard": f"{found['seconds']} s each at {at['commit']}, {at['date']}, {at['cores']} cores of {at['cpu']}.\n\n" + onboard(found)}
    if "reactions_ms" in found:
        parts["reactions"] = reactions(found)
    for part in parts.values():
        print(part + "\n")
    if len(sys.argv) > 2:
        page = pathlib.Path(sys.argv[2]) / "timing.md"
        page.write_text(fill(page.read_text(), found, {name: lambda _, part=part: part for name, part in parts.items()})[0])


if __name__ == "__main__":
    main()
