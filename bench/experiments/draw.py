#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""draw.py EXPERIMENTS_JSON OUT: draws what the experiments found as experiments_*.png."""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of what draws

COLOURS = {"input": "#777777", "local_a": "#c9a227", "local_b": "#b8452c", "none": "#7fb2c4", "paper": "#8a6fb0",
           "contractive": "#1f6f8b"}
TITLES = {"input": "input", "local_a": "local A", "local_b": "local B", "none": "global, none", "paper": "global, paper",
          "contractive": "global, contractive"}
SCENES = {"real": "real scans, 0.1 m", "street": "simulated street, 0.2 m"}
REQUIRED = {"dashes": (4, 3), "color": "#444444", "linewidth": 1.0}
plt.rcParams.update({"figure.dpi": 100, "font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
                     "axes.titlesize": 10, "axes.titleweight": "bold", "legend.frameon": False})


def save(figure, title, path):
    figure.suptitle(title, fontsize=12, fontweight="bold", x=0.01, ha="left")
    figure.tight_layout(rect=(0, 0, 1, 0.98))
    figure.savefig(path)
    plt.close(figure)


def bars_by_class(axes, rows, names, values, groups):
    width = 0.8 / len(names)
    for i, name in enumerate(names):
        places = [x + (i - 0.5 * (len(names) - 1)) * width for x in range(len(groups))]
        axes.bar(places, [values(rows, name, group) for group in groups], width=width, color=COLOURS[name], label=TITLES[name])
    axes.set_xticks(range(len(groups)), groups, rotation=35, ha="right")
    axes.grid(axis="y", alpha=0.25)


def real(found, path):
    rows = found["table_two"]["rows"]
    figure, (all_classes, change) = plt.subplots(2, 1, figsize=(9.5, 6.2), gridspec_kw={"height_ratios": [3, 2]})
    labels = sorted((label for label in rows["none"]["iou"] if max(row["iou"].get(label, 0) for row in rows.values()) > 0.01),
                    key=lambda label: -rows["none"]["input_iou"][label])

    def iou(rows, name, group):
        if group == "mean":
            return 100 * (rows["none"]["input_mean_iou"] if name == "input" else rows[name]["mean_iou"])
        return 100 * (rows["none"]["input_iou"][group] if name == "input" else rows[name]["iou"].get(group, 0.0))
    bars_by_class(all_classes, rows, ("input", "local_a", "local_b", "none", "contractive"), iou, [*labels, "mean"])
    all_classes.set_ylabel("IoU [%]")
    all_classes.legend(ncol=5, fontsize=7, loc="upper right", bbox_to_anchor=(1.0, 1.12))
    bars_by_class(change, rows, ("paper", "contractive"),
                  lambda rows, name, group: iou(rows, name, group) - iou(rows, "none", group), [*labels, "mean"])
    change.set_ylabel("less that of none [points]")
    change.axhline(0, color="#444444", linewidth=0.8)
    change.legend(fontsize=7)
    save(figure, "Two halves of a real sequence as two robots", path)


def teams(found, path):
    figure, (times, gains, errors) = plt.subplots(1, 3, figsize=(9.5, 3.4))
    most = 2
    for scene, style in zip(found["teams"], ("o-", "s--")):
        sizes = [team["robots"] for team in scene["teams"]]
        most = max(most, *sizes)
        times.plot([1, *sizes], [1, *(team["efficiency"]["times_one_robot"] for team in scene["teams"])], style,
                   color=COLOURS["contractive"], label=f"street {scene['seed']}, its local maps")
        local = scene["teams"][0]["efficiency"]["local_m3_per_s"]
        alone = sum(local) / len(local)
        times.plot([1, *sizes], [1, *(team["efficiency"]["global_m3_per_s"] / alone for team in scene["teams"])], style,
                   color=COLOURS["none"], label=f"street {scene['seed']}, one alone")
        for team in scene["teams"]:
            for pair in team["pairs"]:
                best = max(pair["local_a"]["mean_iou"], pair["local_b"]["mean_iou"])
                for name, shift in (("none", -0.15), ("contractive", 0.15)):
                    gains.plot(team["robots"] + shift, 100 * (pair[name]["mean_iou"] - best), style[0],
                               color=COLOURS[name], markersize=4)
                local = min(pair[name]["calibration_error"] for name in ("local_a", "local_b"))
                errors.plot(local, pair["contractive"]["calibration_error"], style[0], color=COLOURS["contractive"], markersize=4)
    times.plot([1, most], [1, most], **REQUIRED, label="one for each robot")
    times.plot([4], [3.4], "_", color="black", markersize=16, label="required of 4")
    times.set(xlabel="robots", ylabel="times one robot", title="Mapping efficiency", xticks=[1, 2, 4, 8][:most.bit_length()])
    times.legend(fontsize=7)
    gains.axhline(5, **REQUIRED)
    gains.axhline(0, color="#444444", linewidth=0.8)
    for name in ("none", "contractive"):
        gains.plot([], [], "o", color=COLOURS[name], label=TITLES[name], markersize=4)
    gains.set(xlabel="robots in the team", ylabel="points over the better local map", title="mIoU at each border",
              xticks=[2, 4, 8][:most.bit_length() - 1])
    gains.legend(fontsize=7)
    top = 1.05 * max(errors.get_xlim()[1], errors.get_ylim()[1])
    errors.plot([0, top], [0, top], **REQUIRED)
    errors.set(xlabel="of the better local map", ylabel="of the global map", title="Calibration error",
               xlim=(0, top), ylim=(0, top))
    for axes in (times, gains, errors):
        axes.grid(alpha=0.25)
    save(figure, "Teams in a long street", path)


def means(rows, kind, name, value):
    amounts = sorted({row["amount"] for row in rows if row["kind"] == kind})
    return amounts, [sum(value(row[name]) for row in rows if (row["kind"], row["amount"]) == (kind, a)) /
                     sum(1 for row in rows if (row["kind"], row["amount"]) == (kind, a)) for a in amounts]


def places(found, path):
    studies = found["robustness"]
    figure, grid = plt.subplots(len(studies), 3, figsize=(9.5, 2.9 * len(studies)), squeeze=False)
    for line, (scene, study) in zip(grid, studies.items()):
        right = study["right"]
        for axes, kind, unit in zip(line, ("metres", "degrees"), ("m", "degrees")):
            for name in ("none", "contractive"):
                amounts, values = means(study["places"], kind, name, lambda row: 100 * row["mean_iou"])
                axes.plot([0, *amounts], [100 * right[name]["mean_iou"], *values], "o-", color=COLOURS[name],
                          label=TITLES[name], markersize=4)
            for name, part in zip(("local_a", "local_b"), right["locals"]):
                axes.axhline(100 * part["mean_iou"], color=COLOURS[name], linewidth=1, linestyle="--", label=TITLES[name])
            axes.set(xlabel=f"error of the second robot's frame [{unit}]", ylabel="mIoU [%]", title=SCENES[scene])
            axes.grid(alpha=0.25)
        for kind, most, style in (("metres", 0.5, "o-"), ("degrees", 5.0, "s--")):
            amounts, values = means(study["places"], kind, "none", lambda row: 100 * row["fuse"]["alignment"])
            line[2].plot([0, *(a / most for a in amounts)], [100 * right["none"]["fuse"]["alignment"], *values], style,
                         color="#5a9e4b", markersize=4, label=f"share of {most:g} " + ("m" if kind == "metres" else "degrees"))
        line[2].set(xlabel="share of the largest error", ylabel="same class in common voxels [%]",
                    title="Alignment that fuse reports")
        line[2].legend(fontsize=7)
        line[2].grid(alpha=0.25)
    grid[0][0].legend(fontsize=7)
    save(figure, "A wrong relative pose", path)


def labels(found, path):
    studies = found["robustness"]
    figure, grid = plt.subplots(len(studies), 3, figsize=(9.5, 2.9 * len(studies)), squeeze=False)
    for line, (scene, study) in zip(grid, studies.items()):
        for axes, who in zip(line, ("one", "both")):
            rows = [(0.0, study["right"]), *((row["share"], row) for row in study["noise"] if row["who"] == who)]
            shares = [100 * share for share, _ in rows]
            for name in ("none", "contractive"):
                axes.plot(shares, [100 * row[name]["mean_iou"] for _, row in rows], "o-", color=COLOURS[name],
                          label=TITLES[name], markersize=4)
            for i, name in enumerate(("local_a", "local_b")):
                axes.plot(shares, [100 * row["locals"][i]["mean_iou"] for _, row in rows], "s--", color=COLOURS[name],
                          label=TITLES[name], markersize=3)
            robots = "both robots" if who == "both" else "robot B"
            axes.set(xlabel=f"labels at random, {robots} [%]", ylabel="mIoU [%]", title=SCENES[scene], ylim=(0, None))
            axes.grid(alpha=0.25)
        wrong = study["swapped"]
        values = dict(zip(("local_a", "local_b"), wrong["locals"])) | {name: wrong[name] for name in ("none", "contractive")}
        line[2].bar(range(4), [100 * row["mean_iou"] for row in values.values()], width=0.6,
                    color=[COLOURS[name] for name in values])
        line[2].set_xticks(range(4), ["local A\n(right)", "local B\n(wrong)", "none", "contrac-\ntive"], fontsize=7)
        line[2].set(ylabel="mIoU [%]", title="B swaps classes")
    grid[0][0].legend(fontsize=7)
    save(figure, "Wrong labels", path)


def diffusion(found, path):
    studies = found["diffusion"]
    figure, grid = plt.subplots(len(studies), 3, figsize=(9.5, 2.9 * len(studies)), squeeze=False)
    for line, (scene, study) in zip(grid, studies.items()):
        lengths = sorted({row["length"] for row in study["grid"]})
        for length, colour in zip(lengths, ("#c9a227", "#1f6f8b", "#8a6fb0", "#b8452c")):
            rows = [row for row in study["grid"] if row["length"] == length and row["found"]]
            steps = [row["iterations"] for row in rows]
            found_rows = [row["found"] for row in rows]
            drawn = ([of["by_diffusion"] for of in found_rows], [of["worst_loss"][1] for of in found_rows],
                     [of["calibration_error"] for of in found_rows])
            for axes, values in zip(line, drawn):
                axes.plot(steps, values, "o-", color=colour, label=f"D = {length:g} voxels", markersize=4)
        line[1].axhline(-1, **REQUIRED)
        for axes, word in zip(line, ("mIoU over none [points]", "largest loss of a class [points]", "calibration error")):
            axes.set(xlabel="iterations", ylabel=word, title=SCENES[scene])
            axes.grid(alpha=0.25)
    grid[0][0].legend(fontsize=7)
    save(figure, "Iterations and length of diffusion", path)


def main():
    found = json.loads(pathlib.Path(sys.argv[1]).read_text())
    out = pathlib.Path(sys.argv[2])
    if "table_two" in found:
        real(found, out / "experiments_real.png")
    for draw in (teams, places, labels, diffusion):
        draw(found, out / f"experiments_{draw.__name__}.png")
    print(f"pictures: {out}/experiments_*.png")


if __name__ == "__main__":
    main()
