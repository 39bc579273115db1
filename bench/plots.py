#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""plots.py BENCH_JSON OUT: draws what the benchmarks found as bench_*.png."""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of what draws

COLOURS = {"kernel": "#b8452c", "multi_entropy": "#1f6f8b", "multi_entropy_free_space": "#5a9e4b", "counting": "#8a6fb0"}
GREY = "#777777"
REQUIRED = {"dashes": (4, 3), "color": "#444444", "linewidth": 1.0}
plt.rcParams.update({"figure.dpi": 110, "font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
                     "axes.titlesize": 10, "axes.titleweight": "bold", "legend.frameon": False})


def subtitle(found):
    at = found["circumstances"]
    scene = found["scene"]
    return f"{scene['name']}, {scene['scans']} scans, {found['integrate']['resolution_m']:g} m, full range, one thread; {at['cpu']}, {at['commit']}"


def save(figure, found, title, path):
    figure.suptitle(title, fontsize=12, fontweight="bold", x=0.01, ha="left")
    figure.text(0.01, 0.01, subtitle(found), fontsize=7, color=GREY)
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.savefig(path)
    plt.close(figure)


def name_bars(axes, bars, values, form):
    for bar, value in zip(bars, values):
        axes.annotate(format(value, form), (bar.get_width(), bar.get_y() + bar.get_height() / 2), xytext=(4, 0),
                      textcoords="offset points", va="center", fontsize=8)


def latency(found, path):
    figure, (cdf, bars) = plt.subplots(1, 2, figsize=(9.5, 4.4), gridspec_kw={"width_ratios": [3, 2]})
    rows = [(mode["title"], COLOURS[name], mode["ms"]["values"]) for name, mode in found["integrate"]["modes"].items()]
    rows.append(("plain loop, kernel", GREY, found["integrate"]["naive"]["ms"]["values"]))
    for title, colour, values in rows:
        ordered = sorted(values)
        share = [100.0 * (i + 1) / len(ordered) for i in range(len(ordered))]
        cdf.step([ordered[0], *ordered], [0, *share], where="post", color=colour, label=title, linewidth=1.6)
    cdf.set_xscale("log")
    cdf.xaxis.set_minor_locator(matplotlib.ticker.LogLocator(subs=(2, 5)))
    cdf.set(xlabel="time of a scan [ms]", ylabel="scans that take no longer [%]", title="Distribution", ylim=(0, 101))
    cdf.xaxis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    cdf.xaxis.set_minor_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    cdf.grid(alpha=0.25, which="both")
    cdf.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncol=3, fontsize=7)
    modes = found["integrate"]["modes"]
    ratios = [mode["naive_over_this"] for mode in modes.values()]
    drawn = bars.barh([mode["title"] for mode in modes.values()], ratios, color=[COLOURS[name] for name in modes], height=0.6)
    bars.invert_yaxis()
    name_bars(bars, drawn, ratios, ".1f")
    for limit, word in ((6, "required"), (12, "aim")):
        bars.axvline(limit, **REQUIRED)
        bars.annotate(word, (limit, 1.0), xycoords=("data", "axes fraction"), fontsize=7, ha="center", va="bottom")
    bars.set_xlim(0, 1.18 * max(12, *ratios))
    bars.set_xlabel("plain loop's median / median")
    bars.set_title("Times faster than the plain loop", pad=16)
    save(figure, found, "Integrating a scan", path)


def queries(found, path):
    required = {"scan_order": 40, "scan_order_batch": 40, "random_observed": 150, "random_observed_batch": 150, "random_anywhere": 150, "along_rays": 8}
    rows = [(q["title"], q["ns_per_voxel"]["median"], required.get(name), "#1f6f8b") for name, q in found["query"]["questions"].items()]
    if "octomap" in found:
        rows.append(("OctoMap: points of a scan", found["octomap"]["search_ns_per_voxel"]["median"], None, GREY))
    figure, axes = plt.subplots(figsize=(7.5, 3.0))
    values = [value for _, value, _, _ in rows]
    drawn = axes.barh([row[0] for row in rows], values, color=[row[3] for row in rows], height=0.6)
    axes.invert_yaxis()
    name_bars(axes, drawn, values, ".1f")
    for bar, (_, _, limit, _) in zip(drawn, rows):
        if limit:
            axes.plot([limit, limit], [bar.get_y() - 0.1, bar.get_y() + bar.get_height() + 0.1], **REQUIRED)
    axes.plot([], [], **REQUIRED, label="required")
    axes.legend(loc="lower right")
    axes.set_xlim(0, 1.15 * max(values))
    axes.set_xlabel("time of a voxel [ns], median")
    save(figure, found, "Asking the map", path)


def largest(budgets):
    return max((run for run in budgets.values()), key=lambda run: run["budget_bytes"])


def smallest_that_fits(budgets):
    fitting = [run for run in budgets.values() if run["refused"] == 0]
    return min(fitting, key=lambda run: run["budget_bytes"]) if fitting else None


def memory(found, path):
    figure, (voxel, budget) = plt.subplots(1, 2, figsize=(9.5, 3.4))
    settings = found["memory"]["settings"]
    rows = []
    for name in ("multi_entropy", "multi_entropy_dense", "kernel"):
        run = smallest_that_fits(settings[name]["budgets"])
        if run:
            rows.append((f"{settings[name]['title']}\nin {run['budget_bytes'] >> 20} MiB", run["bytes_per_label_voxel"],
                         COLOURS.get(name, "#7fb2c4")))
    free = list(found["memory"]["bytes_per_free_voxel"].values())
    if free:
        rows.append(("free space only", free[0], COLOURS["multi_entropy_free_space"]))
    values = [row[1] for row in rows]
    drawn = voxel.barh([row[0] for row in rows], values, color=[row[2] for row in rows], height=0.6)
    voxel.invert_yaxis()
    name_bars(voxel, drawn, values, ".1f")
    voxel.set_xlim(0, 1.15 * max(values))
    voxel.set_xlabel("bytes a voxel, everything included")
    voxel.set_title("A voxel")
    for name in ("multi_entropy", "multi_entropy_free_space"):
        runs = sorted(settings[name]["budgets"].values(), key=lambda run: run["budget_bytes"])
        sizes = [run["budget_bytes"] / 2**20 for run in runs]
        budget.plot(sizes, [run["used_bytes"] / 2**20 for run in runs], "o-", color=COLOURS[name], label=settings[name]["title"])
        for size, run in zip(sizes, runs):
            if run["refused"]:
                budget.plot(size, run["used_bytes"] / 2**20, "x", color="black", markersize=10)
    budget.plot([], [], "x", color="black", markersize=8, linestyle="none", label="something refused")
    budget.margins(x=0.12)
    budget.set_xscale("log", base=2)
    budget.set_xticks(sizes, [f"{size:g}" for size in sizes])
    budget.set(xlabel="--memory [MiB]", ylabel="map in use [MiB]", title="The map in a budget", ylim=(0, None))
    budget.grid(alpha=0.25)
    budget.legend(fontsize=7)
    save(figure, found, "Memory", path)


def main():
    found = json.loads(pathlib.Path(sys.argv[1]).read_text())
    out = pathlib.Path(sys.argv[2])
    latency(found, out / "bench_latency.png")
    queries(found, out / "bench_queries.png")
    memory(found, out / "bench_memory.png")
    print(f"pictures: {out}/bench_*.png")


if __name__ == "__main__":
    main()
