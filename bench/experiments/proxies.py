#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""proxies.py --tessera PROGRAM --out OUT [--dataset semantickitti_08] [--standing scanner_standing] [--scenes NAME ...]: what the
diffusion costs a class, on many pairs of maps.

Each pair is fused with and without diffusion and judged on its overlap. A row for each pair: mean IoU without, the gain, the
gain over the labels that the maps were made from, the calibration error, and each class that lost over 0.3 points with its points of truth.
The seed is printed."""
import itertools
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import datasets  # noqa: E402  these need the path above
import halves  # noqa: E402
import street  # noqa: E402
from run_experiments import FULL  # noqa: E402
from workshop import Workshop  # noqa: E402

LOSS = 0.3
# Classes with few points in semantickitti_08, by the ids that they are learned from.
SMALL = {"bicycle": {11}, "person": {30, 254}, "building": {50}, "fence": {51}, "pole": {80}, "traffic-sign": {81}}


def scan_pairs():
    yield from (((a,), (b,)) for a, b in itertools.combinations(range(6), 2))
    yield (0, 1), (4, 5)
    yield (0, 2, 4), (1, 3, 5)


class Proxies:
    def __init__(self, workshop):
        self.workshop = workshop
        self.lost = 0

    def judge(self, pair):
        """pair: a Halves or a street's Pair."""
        name = pair.name
        found = [self.workshop.fuse_and_judge(f"{name}_{mode}", pair.maps, pair.all_scans, {"diffusion": mode}, pair.asked)["eval"]
                 for mode in ("none", "contractive")]
        before, after = found
        loss = {label: 100 * (before["iou"][label] - after["iou"][label]) for label in before["iou"]}
        truth = {label: counts["true_positives"] + counts["false_negatives"] for label, counts in before["counts"].items()}
        losing = sorted((label for label in loss if loss[label] > LOSS), key=loss.get, reverse=True)
        self.lost += len(losing)
        print(f"{name}: none {100 * before['mean_iou']:.2f}, {100 * (after['mean_iou'] - before['mean_iou']):+.2f}, over the input "
              f"{100 * (after['mean_iou'] - before['input_mean_iou']):+.2f}, calibration error {after['calibration_error']:.3f}"
              + "".join(f"; {label} -{loss[label]:.2f} ({truth[label]} points)" for label in losing), flush=True)

    def real(self, dataset):
        self.judge(halves.of_real(self.workshop, dataset, halves.SCANS_012_345))

    def pairs(self, dataset):
        for scans in scan_pairs():
            self.judge(halves.of_real(self.workshop, dataset, scans))

    def thinned(self, dataset):
        for label, ids in SMALL.items():
            for share in (0.25, 0.1):
                name = f"real_{label}_{share:g}_seed_{halves.SEED}"
                few = datasets.thin(self.workshop.out / name, dataset, ids, share, halves.SEED)
                self.judge(halves.Halves(self.workshop, name, few, halves.SCANS_012_345, **halves.REAL))

    def standing(self, dataset, real):
        self.judge(halves.of_standing(self.workshop, dataset, real))

    def streets(self):
        for seed, scans in FULL["pairs"]:
            self.judge(street.Pair(self.workshop, seed, scans))


def main():
    parser = halves.parser_of(__doc__)
    parser.add_argument("--scenes", nargs="+", choices=("real", "pairs", "thinned", "standing", "streets"),
                        default=["real", "pairs", "thinned", "standing", "streets"])
    options = parser.parse_args()
    proxies = Proxies(Workshop(options.tessera.resolve(), options.out.resolve()))
    print(f"seed {halves.SEED}")
    for scene in options.scenes:
        needs = {"streets": (), "standing": (options.standing, options.dataset)}.get(scene, (options.dataset,))
        if any(folder is None for folder in needs):
            print(f"{scene}: left out, a folder is not given")
            continue
        getattr(proxies, scene)(*(folder.resolve() for folder in needs))
    print(f"{proxies.lost} classes lost over {LOSS} points")


if __name__ == "__main__":
    main()
