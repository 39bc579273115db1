#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""proxies.py --tessera PROGRAM --out OUT [--dataset semantickitti_08] [--standing scanner_standing] [--scenes NAME ...]: what the
diffusion costs a class, on many pairs of maps.

Each pair is fused with and without diffusion and judged on its overlap. A row for each pair: mean IoU without, the gain, the
gain over the labels that the maps were made from, the calibration error, and each class that lost over 0.3 points with its points of truth.
The seed is printed."""
import argparse
import itertools
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import datasets  # noqa: E402  these need the path above
import street  # noqa: E402
from run_experiments import FULL  # noqa: E402
from workshop import Workshop  # noqa: E402

SEED = 23
LOSS = 0.3
# Classes with few points in semantickitti_08, by the ids that they are learned from.
SMALL = {"bicycle": {11}, "person": {30, 254}, "building": {50}, "fence": {51}, "pole": {80}, "traffic-sign": {81}}
REAL = {"resolution": 0.1, "max_range": 40}


def scan_pairs():
    yield from (((a,), (b,)) for a, b in itertools.combinations(range(6), 2))
    yield (0, 1), (4, 5)
    yield (0, 2, 4), (1, 3, 5)


class Proxies:
    def __init__(self, workshop):
        self.workshop = workshop
        self.lost = 0

    def judge(self, name, maps, dataset):
        found = [self.workshop.fuse_and_judge(f"{name}_{mode}", maps, dataset, {"diffusion": mode}, {"overlap_of": maps})["eval"]
                 for mode in ("none", "contractive")]
        before, after = found
        loss = {label: 100 * (before["iou"][label] - after["iou"][label]) for label in before["iou"]}
        truth = {label: counts["true_positives"] + counts["false_negatives"] for label, counts in before["counts"].items()}
        losing = sorted((label for label in loss if loss[label] > LOSS), key=loss.get, reverse=True)
        self.lost += len(losing)
        print(f"{name}: none {100 * before['mean_iou']:.2f}, {100 * (after['mean_iou'] - before['mean_iou']):+.2f}, over the input "
              f"{100 * (after['mean_iou'] - before['input_mean_iou']):+.2f}, calibration error {after['calibration_error']:.3f}"
              + "".join(f"; {label} -{loss[label]:.2f} ({truth[label]} points)" for label in losing), flush=True)

    def halves(self, name, dataset, halves, **options):
        """Two robots that have some scans of a dataset each."""
        maps = []
        for robot, scans in enumerate(halves):
            part = datasets.subset(self.workshop.out / f"{name}_{robot}", dataset, scans)
            maps.append(self.workshop.map(f"{name}_{robot}", part, robot=robot, **options)[0])
        both = datasets.subset(self.workshop.out / f"{name}_both", dataset, sorted(itertools.chain(*halves)))
        self.judge(name, maps, both)

    def real(self, dataset):
        self.halves("real_012_345", dataset, ((0, 1, 2), (3, 4, 5)), **REAL)

    def pairs(self, dataset):
        for one, other in scan_pairs():
            name = "real_" + "_".join("".join(map(str, scans)) for scans in (one, other))
            self.halves(name, dataset, (one, other), **REAL)

    def thinned(self, dataset):
        for label, ids in SMALL.items():
            for share in (0.25, 0.1):
                name = f"real_{label}_{share:g}_seed_{SEED}"
                few = datasets.thin(self.workshop.out / name, dataset, ids, share, SEED)
                self.halves(name, few, ((0, 1, 2), (3, 4, 5)), **REAL)

    def standing(self, dataset, real):
        confused = datasets.confuse(self.workshop.out / f"standing_seed_{SEED}", dataset, datasets.confusion(real), SEED)
        self.halves(f"standing_seed_{SEED}_0_11_12_22", confused, (range(12), range(12, 23)), resolution=0.1)

    def streets(self):
        for seed, scans in FULL["pairs"]:
            pair = street.Pair(self.workshop, seed, scans)
            self.judge(pair.name, pair.maps, pair.all_scans)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tessera", required=True, type=pathlib.Path, help="the command")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--dataset", type=pathlib.Path, help="folder of semantickitti_08")
    parser.add_argument("--standing", type=pathlib.Path, help="folder of scanner_standing; its labels are drawn from the confusion of --dataset")
    parser.add_argument("--scenes", nargs="+", choices=("real", "pairs", "thinned", "standing", "streets"),
                        default=["real", "pairs", "thinned", "standing", "streets"])
    options = parser.parse_args()
    proxies = Proxies(Workshop(options.tessera.resolve(), options.out.resolve()))
    print(f"seed {SEED}")
    for scene in options.scenes:
        needs = {"streets": (), "standing": (options.standing, options.dataset)}.get(scene, (options.dataset,))
        if any(folder is None for folder in needs):
            print(f"{scene}: left out, a folder is not given")
            continue
        getattr(proxies, scene)(*(folder.resolve() for folder in needs))
    print(f"{proxies.lost} classes lost over {LOSS} points")


if __name__ == "__main__":
    main()
