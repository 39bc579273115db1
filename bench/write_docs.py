#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""write_docs.py BENCH_JSON DOCS: puts the figures into DOCS/benchmarks.md and DOCS/timing.md.

A page keeps its text; what stands between <!-- measured: NAME --> and <!-- end measured --> is replaced by the table of
that name, or stays where this run did not measure it."""
import json
import pathlib
import re
import sys

import fusion_tables
import timing_tables
from markdown import number, paragraph, table

PART = re.compile(r"(<!-- measured: ([a-z_]+) -->\n).*?(<!-- end measured -->)", re.S)
PAGES = ("benchmarks.md", "timing.md")
REQUIRED_MS = {"kernel": (25, 12), "multi_entropy": (25, 10), "multi_entropy_free_space": (80, 40)}
REQUIRED_NS = {"scan_order": 40, "scan_order_batch": 40, "random_observed": 150, "random_observed_batch": 150, "random_anywhere": 150, "along_rays": 8}


def circumstances(found):
    at, scene, build = found["circumstances"], found["scene"], found["integrate"]["build"]
    clock = {"wall": found["integrate"]["clock_ghz"], "cpu": found["integrate"]["cpu_clock_ghz"]}
    at_once = found["integrate"]["cpu_additions_per_ns"]
    loads = found["query"]["cpu_load_latency_ns"]
    rows = [("machine", f"{at['cpu']}, {at['cores']} cores, {at['memory_gb']} GB, "
                        + ", ".join(f"{name} {size}" for name, size in at["caches"].items())),
            ("system", at["system"]),
            ("compiler, flags", f"{build['compiler']}, `{build['flags'].strip()}`"),
            ("commit, date", f"{at['commit']}, {at['date']}"),
            ("scans", f"{scene['name']}, the first {scene['scans']}, {found['integrate']['resolution_m']:g} m, full range, "
                      f"thinned at the resolution; {found['integrate']['repetitions']} repetitions, each in an empty map"),
            ("load of the machine", f"{at['load_before']:.1f} before, {at['load_after']:.1f} after, of which about 1 is the benchmark"),
            ("clock", f"{clock['cpu']['median']:.2f} GHz on a core, at best {clock['cpu']['max']:.2f}; by the clock on the wall "
                      f"{clock['wall']['median']:.2f} (dependent additions, one a cycle)"),
            ("additions at once, on a core", f"{at_once['median']:.1f} a ns, at best {at_once['max']:.1f} (four chains)"),
            ("latency of a load, on a core", f"{loads['memory']['median']:.0f} ns, at best {loads['memory']['min']:.0f}, at random in 256 MiB; "
                                             f"{loads['l2']['median']:.1f} ns, at best {loads['l2']['min']:.1f}, in 256 KiB"),
            ("memory bandwidth", f"{found['integrate']['memory_bytes_per_s']['median'] / 1e9:.1f} GB/s (triad, one thread)")]
    return table(("", "measured on"), rows)


def spread(values, digits=3):
    return [number(values[key], digits) for key in ("min", "median", "p99", "p999", "max")]


def integrate(found):
    part = found["integrate"]
    rows = []
    for name, mode in part["modes"].items():
        required = REQUIRED_MS.get(name)
        rows.append((mode["title"], *spread(mode["ms"]), number(mode["cpu_ms"]["median"]), f"{mode['naive_over_this']:.1f}",
                     f"{required[0]} / {required[1]}" if required else "-"))
    rows.append(("plain loop, kernel", *spread(part["naive"]["ms"]), number(part["naive"]["cpu_ms"]["median"]), "1", "-"))
    if "octomap" in found:
        rows.append(("OctoMap, occupancy with free space", *spread(found["octomap"]["insert_ms"]), "-",
                     f"{part['naive']['ms']['median'] / found['octomap']['insert_ms']['median']:.3f}", "-"))
    return table(("ms a scan", "min", "median", "p99", "p99.9", "max", "median on a core", "plain loop / this", "required / aim"), rows)


def updates(found):
    part = found["integrate"]
    rows = []
    for mode in part["modes"].values():
        count = sum(scan["voxel_updates"] for scan in mode["scans"]) / len(mode["scans"])
        rows.append((mode["title"], number(count), number(mode["ns_per_voxel_update"]),
                     f"{mode['worst_scan_over_median_cpu_ms']:.2f}", f"{mode['worst_scan_over_median_work']:.3f}"))
    naive = part["naive"]
    rows.append(("plain loop, kernel", number(naive["updates"] / part["scans"]),
                 number(1e6 * naive["cpu_ms"]["median"] * part["scans"] / naive["updates"]), "-", "-"))
    return table(("", "voxel updates a scan", "ns an update", "worst scan / median, time on a core", "the same, work counts"), rows)


def limit(found):
    kernel = found["integrate"]["modes"]["kernel"]
    least = kernel["limit"]
    return (f"A scan in the kernel mode moves {least['median_bytes'] / 1e6:.1f} MB at the least, which the memory does in "
            f"{least['median_ms_at_bandwidth']:.1f} ms; the scan takes {kernel['ms']['median'] / least['median_ms_at_bandwidth']:.1f} times as long.")


def queries(found):
    load_ns = found["query"]["cpu_load_latency_ns"]["memory"]["median"]
    rows = [(q["title"], f"{q['voxels']:,}", *spread(q["ns_per_voxel"]), number(q["cpu_ns_per_voxel"]),
             f"{q['cpu_ns_per_voxel'] / load_ns:.2f}", REQUIRED_NS.get(name, "-"))
            for name, q in found["query"]["questions"].items()]
    if "octomap" in found:
        rows.append(("OctoMap: points of a scan", "-", *spread(found["octomap"]["search_ns_per_voxel"]), "-", "-", "-"))
    return table(("ns a voxel", "voxels", "min", "median", "p99", "p99.9", "max", "median on a core", "loads of memory latency",
                  "required"), rows)


def scan_instructions(found):
    """None where they were not counted: they hold for a commit, on any machine."""
    part = found.get("scan_instructions")
    if part is None:
        return None
    rows = []
    for run in part["runs"].values():
        each = [f"{count / 1e6:.1f}" for count in run["instructions"]]
        rows.append((run["title"], ", ".join(each) if len(each) <= 10 else f"{len(each)} scans, the first {each[0]}",
                     f"{run['median'] / 1e6:.1f}", f"{run['worst'] / 1e6:.1f}", f"{run['worst_over_median']:.3f}",
                     f"{run['required']} / {run['aim'] or '-'}"))
    said = [f"Counted at {part['commit']}."]
    if "drive" in part["runs"]:
        drive = part["runs"]["drive"]
        window = drive["window"]
        said.append(f"The drive: {drive['dataset']}, `{drive['options']} --archive DIR`; a step of the window takes at most "
                    f"{max(drive['of_these_window']) / 1e6:.1f} of these millions. It handed out {window['evicted']:,} blocks, at most "
                    f"{window['most_evicted']:,} a step, at most {window['most_backlog']:,} waited; {window['lost_blocks']} were lost, "
                    f"{drive['refused']} points refused.")
    return table(("millions of instructions", "each scan", "median", "worst", "worst / median", "required / aim"), rows) + "\n\n" + paragraph(" ".join(said))


def memory(found):
    rows = []
    for name, setting in found["memory"]["settings"].items():
        for budget, run in setting["budgets"].items():
            free = found["memory"]["bytes_per_free_voxel"].get(budget) if name == "multi_entropy_free_space" else None
            rows.append((setting["title"], budget, f"{run['scratch_bytes'] / 1e6:.1f}", f"{run['used_bytes'] / 1e6:.1f}",
                         f"{run['label_voxels']:,}", f"{run['free_voxels']:,}",
                         "-" if name == "multi_entropy_free_space" else f"{run['bytes_per_label_voxel']:.1f}",
                         f"{free:.2f}" if free else "-", f"{run['refused']:,}"))
    return table(("", "`--memory`", "scratch, MB", "map, MB", "label voxels", "free voxels", "bytes a label voxel",
                  "bytes a free voxel", "refused"), rows)


def agreement(found):
    rows = [(mode["title"], f"{mode['labelled']:,}", f"{100 * mode['same_label']:.4f} %", f"{100 * mode['same_state']:.4f} %",
             f"{100 * mode['evidence_in_rest']:.3f} %") for mode in found["agreement"]["modes"].values()]
    return table(("compact against dense", "labelled voxels", "same label", "same state", "evidence in the rest"), rows)


def map_file(found):
    rows = []
    for mode in found["map_file"]["modes"].values():
        def rate(key):
            ms = mode[key]["median"]
            return f"{number(ms)} ms, {mode['bytes'] / 1e3 / ms:.0f} MB/s"
        rows.append((mode["title"], f"{mode['voxels']:,}", f"{mode['bytes'] / 1e6:.1f} MB", rate("save_ms"), rate("load_ms"),
                     f"{number(mode['digest_ms']['median'])} ms, {1e6 * mode['digest_ms']['median'] / mode['voxels']:.0f} ns a voxel"))
    return table(("map of", "voxels", "file", "save", "load", "digest"), rows)


TABLES = {f.__name__: f for f in (circumstances, integrate, updates, scan_instructions, limit, queries, memory, agreement, map_file,
                                  fusion_tables.fusion, timing_tables.costs, timing_tables.example, timing_tables.worst_cases)}


def fill(text, found, tables=TABLES):
    used = []

    def replace(match):
        if match[2] not in tables:  # Another program's.
            return match[0]
        used.append(match[2])
        written = tables[match[2]](found)
        return match[0] if written is None else f"{match[1]}\n{written}\n\n{match[3]}"
    return PART.sub(replace, text), used


def main():
    found = json.loads(pathlib.Path(sys.argv[1]).read_text())
    missing = set(TABLES)
    for name in PAGES:
        page = pathlib.Path(sys.argv[2]) / name
        text, used = fill(page.read_text(), found)
        page.write_text(text)
        missing -= set(used)
    if missing:
        sys.exit(f"write_docs.py: no page has a place for {', '.join(sorted(missing))}")


if __name__ == "__main__":
    main()
