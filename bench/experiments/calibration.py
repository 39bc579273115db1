#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""calibration.py --tessera PROGRAM --out OUT [--dataset semantickitti_08] [--standing scanner_standing] [--seeds N ...]: how far
probabilities can be relied on, of two local maps and the global one, on their overlap.

Scenes are halves of the real scans, the standing scanner with labels drawn from their confusion, and streets of 20 and 40 scans. A row for each map:
calibration error, Brier score, area under the risk-coverage curve, and what exceeds a bound. What was learned on is marked with *;
four of the first scene's six scans were, too."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import halves  # noqa: E402  these need the path above
import markdown  # noqa: E402
import street  # noqa: E402
from workshop import Workshop  # noqa: E402

MOST, MOST_OVER_LOCALS = 0.05, 0.005
LEARNED_SEEDS = (1, 2, 3, 4)
REAL = {"(0, 1, 2 and 3, 4, 5)": halves.SCANS_012_345, "(0 and 1) *": ((0,), (1,)), "(4 and 5) *": ((4,), (5,)),
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

    def judge(self, scene, pair):
        """Of maps in the frame in which they are fused."""
        judged = [self.workshop.judge(f"{pair.name}_{robot}", path, pair.all_scans, **pair.asked) for robot, path in enumerate(pair.maps)]
        fused = self.workshop.fuse_and_judge(f"{pair.name}_global", pair.maps, pair.all_scans, judge=pair.asked)
        self.add(scene, [*judged, fused["eval"]])

    def real(self, dataset):
        for scans, parts in REAL.items():
            self.judge(f"real scans {scans}", halves.of_real(self.workshop, dataset, parts))

    def standing(self, dataset, real):
        self.judge("standing scanner", halves.of_standing(self.workshop, dataset, real))

    def streets(self, seeds):
        for seed in seeds:
            for scans in (20, 40):
                pair = street.Pair(self.workshop, seed, scans)
                judged = [pair.judge_local(0), pair.judge_local(1), pair.judge_global("global")]
                self.add(f"street {seed}, {scans} scans" + (" *" if seed in LEARNED_SEEDS else ""), judged)


def main():
    parser = halves.parser_of(__doc__)
    parser.add_argument("--seeds", nargs="*", type=int, default=list(range(1, 9)), help="streets; 1 to 8 unless given")
    options = parser.parse_args()
    found = Calibration(Workshop(options.tessera.resolve(), options.out.resolve()))
    print(f"seed of drawn labels {halves.SEED}")
    if options.dataset is not None:
        found.real(options.dataset.resolve())
        if options.standing is not None:
            found.standing(options.standing.resolve(), options.dataset.resolve())
    found.streets(options.seeds)
    print(markdown.table(("scene", "map", "mean IoU, %", "calibration error", "Brier score", "risk-coverage area", "exceeds"), found.rows))
    print(f"{found.over} of {len(found.rows)} maps exceed a bound")


if __name__ == "__main__":
    main()
