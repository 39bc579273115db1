#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""kernels.py --tessera PROGRAM --out OUT --dataset semantickitti_08: the kernels by class that the library has by the names of classes, as fit-kernels finds them.

Fitted to the real scans, the same scans with labels drawn from their confusion, and the robots with 64 beams of three streets; without points that were seen to
move. The real scans alone are fitted too. What judges of it, bench/experiments/modes.py, uses other streets and another scanner."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import datasets  # noqa: E402  these need the path above
import halves  # noqa: E402
import markdown  # noqa: E402
from modes import MOVING, SCANS  # noqa: E402
from workshop import Workshop, words_of  # noqa: E402

STREETS = (1, 2, 3)
CONFUSED_SEED = 101


def fit(workshop, name, folders):
    words = ["fit-kernels", *words_of({"dataset": folders[0]})]
    for folder in folders[1:]:
        words += ["--dataset", folder]
    words += ["--without", ",".join(map(str, MOVING)), "--out", workshop.out / f"{name}.toml"]
    return workshop.kept(name, words, lambda: workshop.reported(*words))


def main():
    options = halves.parser_of(__doc__).parse_args()
    workshop = Workshop(options.tessera.resolve(), options.out.resolve())
    real = options.dataset.resolve()
    print(f"seed of drawn labels {CONFUSED_SEED}")
    confused = datasets.confuse(workshop.out / f"real_confused_{CONFUSED_SEED}", real, datasets.confusion(real), CONFUSED_SEED)
    streets = [workshop.simulate(seed, 2, SCANS)[0] for seed in STREETS]
    alone = fit(workshop, "real_alone", [real])
    found = fit(workshop, "kernels", [real, confused, *streets])
    percent = [[f"{100 * value:.2f}" for value in (one["mean_iou"]["input"], one["mean_iou"]["one_kernel"], one["mean_iou"]["by_names"], one["mean_iou"]["fitted"],
                                                   one["mean_iou_left_out"]["one_kernel"], one["mean_iou_left_out"]["fitted"])] for one in (alone, found)]
    print(markdown.table(("mIoU, %", "input", "one kernel", "by names", "fitted", "left out: one kernel", "left out: fitted"),
                         [("real scans alone", *percent[0]), ("all of them", *percent[1])]))
    print(markdown.table(("class", "reach, m", "height, m"), [(name, *kernel) for name, kernel in found["kernels"].items()]))


if __name__ == "__main__":
    main()
