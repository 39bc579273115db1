# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Iterations, length, share of the neighbours and edge term of diffusion, one after the other."""
ITERATIONS = (0, 1, 2, 4, 8, 12)
LENGTHS = (1.5, 2.0, 2.5, 3.0)  # voxels
ALPHAS = (0.5, 0.8, 0.9, 0.95, 0.98, 0.99)
EDGES = ("none", "label", "similarity", "confidence")
PAPER_ITERATIONS = (1, 2, 3)


def losses(found, none):
    """With what is asked of diffusion: its gain and the class that loses most, in points, against the plain sum."""
    if found is None:
        return None
    by_class = {label: 100.0 * (found["iou"][label] - none["iou"][label]) for label in found["iou"]}
    return {"by_diffusion": 100.0 * (found["mean_iou"] - none["mean_iou"]),
            "gain": 100.0 * (found["mean_iou"] - found["input_mean_iou"]),
            "worst_loss": min(by_class.items(), key=lambda item: item[1]), "calibration_error": found["calibration_error"],
            "residual": found["fuse"]["residual"], "milliseconds": found["fuse"]["milliseconds"],
            "mean_variance": found["fuse"]["mean_variance"]}


def measure(pair, resolution_m, quick=False):
    none = pair.judge_global("right_none", diffusion="none")

    def run(name, **options):
        return losses(pair.judge_global(name, **options), none)

    iterations, lengths = (ITERATIONS[1:5:3], LENGTHS[1:2]) if quick else (ITERATIONS, LENGTHS)
    alphas, edges, paper = (ALPHAS[:1], EDGES[:1], PAPER_ITERATIONS[:1]) if quick else (ALPHAS, EDGES, PAPER_ITERATIONS)
    return {"none": losses(none, none),
            "grid": [{"iterations": n, "length": d,
                      "found": run(f"n{n}_d{d:g}", iterations=n, diffusion_length=f"{d * resolution_m:g}")}
                     for d in lengths for n in iterations],
            "alpha": [{"alpha": a, "found": run(f"alpha{a:g}", alpha=a)} for a in alphas],
            "edge": [{"edge": edge, "found": run(f"edge_{edge}", edge=edge)} for edge in edges],
            "paper": [{"iterations": n, "found": run(f"paper_{n}", diffusion="paper", iterations=n)} for n in paper],
            "whole_map": run("whole_map", whole_map=True)}
