# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Table II: a sequence cut in two, each half a robot; IoU by class on the points that both robots have labels for."""
import voxels

RESOLUTION_M, MAX_RANGE_M = 0.1, 40
HALVES = ((0, 2), (3, 5))
# The paper's Table II, average IoU in percent: input, OctoMap local, earlier fusion (Yue et al.), local, global.
PAPER = {"04": (56.24, 58.77, 60.23, 60.49, 62.58), "05": (72.07, 73.88, 74.74, 76.37, 77.03)}
METHODS = {"none": {"diffusion": "none"}, "paper": {"diffusion": "paper"}, "contractive": {}}


def local_maps(workshop, dataset, prefix, halves=HALVES, resolution_m=RESOLUTION_M, **options):
    """The maps of both halves. The dataset may be another for each half."""
    datasets = dataset if isinstance(dataset, (list, tuple)) else [dataset, dataset]
    made = [workshop.map(f"{prefix}_{letter}", folder, first=first, last=last, resolution=resolution_m, max_range=MAX_RANGE_M,
                         robot=robot, **options)
            for robot, (letter, folder, (first, last)) in enumerate(zip("ab", datasets, halves))]
    return [path for path, _ in made], [report for _, report in made]


def kept(judged):
    """What the tables need of a report of eval."""
    keys = ("mean_iou", "iou", "input_mean_iou", "input_iou", "accuracy", "coverage", "calibration_error", "brier_score",
            "risk_coverage_area", "points")
    return {key: judged[key] for key in keys}


def kept_fuse(fused):
    keys = ("voxels", "overlap_voxels", "iterations", "residual", "milliseconds", "mean_variance", "mean_variance_undiffused",
            "alignment", "digest", "warnings")
    return {key: fused[key] for key in keys} | {"warned": any("check their transforms" in line for line in fused["warnings"])}


def measure(workshop, dataset, halves=HALVES):
    maps, reports = local_maps(workshop, dataset, "real", halves)
    counted, _ = local_maps(workshop, dataset, "real_counting", halves, inference="counting")
    asked = {"overlap_of": maps, "first": halves[0][0], "last": halves[1][1]}
    rows = {}
    for letter, path in zip("ab", counted):
        rows[f"counting_{letter}"] = kept(workshop.judge(f"real_counting_{letter}", path, dataset, **asked))
    both = workshop.fuse_and_judge("real_counting_none", counted, dataset, {"diffusion": "none"}, asked)
    rows["counting_none"] = kept(both["eval"])
    for letter, path in zip("ab", maps):
        rows[f"local_{letter}"] = kept(workshop.judge(f"real_{letter}", path, dataset, **asked))
    fused = {}
    for name, options in METHODS.items():
        path, report = workshop.fuse(f"real_{name}", maps, **options)
        fused[name] = kept_fuse(report)
        rows[name] = kept(workshop.judge(f"real_{name}", path, dataset, **asked))
    return {"rows": rows, "fused": fused, "resolution_m": RESOLUTION_M, "max_range_m": MAX_RANGE_M, "halves": halves,
            "local_voxels": [report["memory"]["label_voxels"] for report in reports], "unobserved": unobserved(workshop)}


def unobserved(workshop):
    """Voxels with a label that the plain sum shows none for, by what it says of them."""
    def make():
        none = workshop.out / "real_none.tsm"
        observed = voxels.labelled(workshop, "none", none)
        found = {}
        for name in ("paper", "contractive"):
            new = [place for place in voxels.labelled(workshop, name, workshop.out / f"real_{name}.tsm") if place not in observed]
            found[name] = voxels.states(workshop, none, new)
        return found
    return workshop.kept("unobserved", ["states in none of labelled voxels", *METHODS], make)


def differences(rows, name, against):
    """By class, in points of IoU."""
    return {label: 100.0 * (rows[name]["iou"][label] - rows[against]["iou"][label]) for label in rows[name]["iou"]}


def verdict(rows, methods=METHODS):
    """What is asked of fusion, in points of IoU, for each method that diffuses."""
    inputs, none = rows["none"]["input_mean_iou"], rows["none"]["mean_iou"]
    locals_ = (rows["local_a"], rows["local_b"])
    found = {}
    for name in methods:
        loss = differences(rows, name, "none")
        worse_local = {label: 100.0 * (iou - min(part["iou"].get(label, 0.0) for part in locals_))
                       for label, iou in rows[name]["iou"].items()}
        found[name] = {"gain": 100.0 * (rows[name]["mean_iou"] - inputs), "by_diffusion": 100.0 * (rows[name]["mean_iou"] - none),
                       "over_best_local": 100.0 * (rows[name]["mean_iou"] - max(part["mean_iou"] for part in locals_)),
                       "worst_loss": min(loss.items(), key=lambda item: item[1]),
                       "least_over_worse_local": min(worse_local.items(), key=lambda item: item[1])}
    return found
