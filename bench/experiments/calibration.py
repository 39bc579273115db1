#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""calibration.py --tessera PROGRAM --out OUT [--dataset semantickitti_08] [--standing scanner_standing] [--seeds N ...]: how far
probabilities can be relied on, of two local maps and the global one, on their overlap.

Scenes are halves of the real scans, the standing scanner with labels drawn from their confusion, and streets of 20 and 40 scans. A row for each map:
calibration error, Brier score, area under the risk-coverage curve, and what exceeds a bound. What was learned on is marked with *; four of the first scene's six scans were, too."""
import argparse
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import datasets  # noqa: E402  these need the path above
import markdown  # noqa: E402
import street  # noqa: E402
from workshop import Workshop  # noqa: E402

SEED = 23  # of the labels that are drawn
MOST, MOST_OVER_LOCALS = 0.05, 0.005
LEARNED_SEEDS = (1, 2, 3, 4)
REAL = {"(0, 1, 2 and 3, 4, 5)": ((0, 1, 2), (3, 4, 5)), "(0 and 1) *": ((0,), (1,)), "(4 and 5) *": ((4,), (5,)),
        "(2 and 3)": ((2,), (3,)), "(0, 1 and 4, 5) *": ((0, 1), (4, 5))}
MAPS = ("A", "B", "global")


class Calibration:
    def __init__(self, workshop):
        self.workshop, self.rows, self.over = workshop, [], 0

    def add(self, scene, judged):
        """judged: what eval reports of two local maps and of the global one."""
        errors = [of["calibration_error"] for of in judged]
        for name, of, error in zip(MAPS, judged, errors):
            excess = [f"{error - MOST:.3f} over {MOST}"] if error > MOST else []
            if name == "global" and error > max(errors[:2]) + MOST_OVER_LOCALS:
                excess.append(f"{error - max(errors[:2]):.3f} over the larger local")
            self.over += bool(excess)
            self.rows.append((scene, name, f"{100 * of['mean_iou']:.2f}", f"{error:.3f}", f"{of['brier_score']:.3f}",
                              f"{of['risk_coverage_area']:.4f}", ", ".join(excess) or "-"))
        print(f"{scene}: " + ", ".join(f"{error:.3f}" for error in errors), flush=True)

    def halves(self, scene, name, dataset, halves, **options):
        maps = []
        for robot, scans in enumerate(halves):
            part = datasets.subset(self.workshop.out / f"{name}_{robot}", dataset, scans)
            maps.append(self.workshop.map(f"{name}_{robot}", part, robot=robot, **options)[0])
        both = datasets.subset(self.workshop.out / f"{name}_both", dataset, sorted([*halves[0], *halves[1]]))
        asked = {"overlap_of": maps}
        judged = [self.workshop.judge(f"{name}_{robot}", path, both, **asked) for robot, path in enumerate(maps)]
        self.add(scene, [*judged, self.workshop.fuse_and_judge(f"{name}_global", maps, both, judge=asked)["eval"]])

    def real(self, dataset):
        for scans, halves in REAL.items():
            name = "real_" + "_".join("".join(map(str, half)) for half in halves)
            self.halves(f"real scans {scans}", name, dataset, halves, resolution=0.1, max_range=40)

    def standing(self, dataset, real):
        confused = datasets.confuse(self.workshop.out / f"standing_seed_{SEED}", dataset, datasets.confusion(real), SEED)
        self.halves("standing scanner", f"standing_seed_{SEED}_0_11_12_22", confused, (range(12), range(12, 23)), resolution=0.1)

    def streets(self, seeds):
        for seed in seeds:
            for scans in (20, 40):
                pair = street.Pair(self.workshop, seed, scans)
                judged = []
                for robot, path in enumerate(pair.maps):
                    T = datasets.write_transform(self.workshop.out / f"{pair.name}_T_map_global_{robot}.txt",
                                                 datasets.inverse(pair.places[robot]))
                    judged.append(self.workshop.judge(f"{pair.name}_{robot}", path, pair.all_scans, transform=T, **pair.asked))
                fused = self.workshop.fuse_and_judge(f"{pair.name}_global", pair.maps, pair.all_scans, judge=pair.asked)
                self.add(f"street {seed}, {scans} scans" + (" *" if seed in LEARNED_SEEDS else ""), [*judged, fused["eval"]])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tessera", required=True, type=pathlib.Path, help="the command")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--dataset", type=pathlib.Path, help="folder of semantickitti_08")
    parser.add_argument("--standing", type=pathlib.Path, help="folder of scanner_standing; its labels are drawn from the confusion of --dataset")
    parser.add_argument("--seeds", nargs="*", type=int, default=list(range(1, 9)), help="streets; 1 to 8 unless given")
    options = parser.parse_args()
    found = Calibration(Workshop(options.tessera.resolve(), options.out.resolve()))
    print(f"seed of drawn labels {SEED}")
    if options.dataset is not None:
        found.real(options.dataset.resolve())
        if options.standing is not None:
            found.standing(options.standing.resolve(), options.dataset.resolve())
    found.streets(options.seeds)
    print(markdown.table(("scene", "map", "mean IoU, %", "calibration error", "Brier score", "risk-coverage area", "exceeds"), found.rows))
    print(f"{found.over} of {len(found.rows)} maps exceed a bound")


if __name__ == "__main__":
    main()
