# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Labels with weights, as a network gives them, against the best one alone: two robots that pass each other in the simulated
street, whose predictions are the first of three labels each."""
import statistics

import street

LABELS = {"best": "predictions", "three": "topk"}
MAPS = ("local_a", "local_b", "contractive")


class WeightedPair(street.Pair):
    def __init__(self, workshop, seed, scans):
        super().__init__(workshop, seed, scans, topk=3)

    def study(self, labels):
        """The maps of one kind of labels. They are judged on the same points: where both maps of the best labels have some."""
        made = self.map_all(self.robots, f"{self.name}_{labels}", labels=LABELS[labels])
        rows = {"local_a": self.judge_local(0, made, f"{self.name}_{labels}"),
                "local_b": self.judge_local(1, made, f"{self.name}_{labels}"),
                "contractive": self.judge_global(labels, made)}
        return {"rows": {name: {key: row[key] for key in ("mean_iou", "calibration_error", "brier_score", "input_mean_iou")}
                         for name, row in rows.items()},
                "scan_ms": statistics.mean(report["totals"]["median_ms"] for report in self.reports),
                "used_bytes": sum(report["memory"]["used_bytes"] for report in self.reports)}


def measure(workshop, plan):
    found = []
    for seed, scans in plan:
        pair = WeightedPair(workshop, seed, scans)
        found.append({"seed": seed, "scans": scans, **{labels: pair.study(labels) for labels in LABELS}})
    return found


def gains(row):
    """Of each map: points of mIoU by three labels over one; calibration error and Brier score of one, and of three."""
    for name in MAPS:
        best, three = row["best"]["rows"][name], row["three"]["rows"][name]
        yield (name, 100.0 * (three["mean_iou"] - best["mean_iou"]), best["calibration_error"], three["calibration_error"],
               best["brier_score"], three["brier_score"])
