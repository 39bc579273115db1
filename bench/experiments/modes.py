#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""modes.py --tessera PROGRAM --out OUT [--dataset semantickitti_08] [--standing scanner_standing] [--seeds N ...] [--modes NAME ...] [--resolutions M ...]:
what the modes of inference gain over the labels that they were given; "one kernel" is lattice with the same kernel for all classes.

Scenes are the real scans, in their order and the other way round, the standing scanner with labels drawn from their confusion, and streets of 20 scans of the
robot with 64 beams, these at 0.1 and 0.2 m; with --resolutions all at those. A row for each scene and mode: gain of the mean IoU in points, without free space and with it, the latter also without the
points that were seen to move; calibration error, Brier score; bytes a label voxel without free space; median time of a scan's integration without it."""
import pathlib
import statistics
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import datasets  # noqa: E402  these need the path above
import halves  # noqa: E402
import markdown  # noqa: E402
from workshop import Workshop  # noqa: E402

MODES = {"counting": {"inference": "counting"},
         "multi-entropy": {"inference": "multi-entropy"},
         "one kernel": {"inference": "lattice", "kernel_length": 0.8},
         "lattice": {"inference": "lattice"}}
MOVING = range(252, 260)
SCANS = 20


def gain_of(judged):
    return f"{100 * (judged['mean_iou'] - judged['input_mean_iou']):+.2f}"


def row_of(workshop, scene, dataset, mode, **options):
    name = f"{scene} {mode}".replace(" ", "_").replace(",", "")
    labels, made = workshop.map(f"{name}_labels", dataset, free_space="off", **MODES[mode], **options)
    free, _ = workshop.map(name, dataset, **MODES[mode], **options)
    alone = workshop.judge(f"{name}_labels", labels, dataset)
    judged = workshop.judge(name, free, dataset)
    without = workshop.judge(f"{name}_without", free, dataset, without=list(MOVING))
    return (scene, mode, gain_of(alone), gain_of(judged), gain_of(without), f"{judged['calibration_error']:.3f}", f"{judged['brier_score']:.3f}",
            f"{made['memory']['bytes_per_label_voxel']:.1f}", f"{statistics.median(scan['milliseconds'] for scan in made['scans']):.0f}")


def scenes(workshop, options):
    """(name, data set, options of map)"""
    def at(scene, dataset, usual, **asked):
        for resolution in options.resolutions or usual:
            yield f"{scene}, {resolution} m", dataset, {**asked, "resolution": resolution}

    usual = [halves.REAL["resolution"]]
    if options.dataset is not None:
        real = options.dataset.resolve()
        yield from at("real scans", real, usual, **halves.REAL)
        count = len((real / "poses.txt").read_text().splitlines())
        backwards = datasets.subset(workshop.out / "reversed", real, range(count - 1, -1, -1))
        yield from at("real scans, reversed", backwards, usual, **halves.REAL)
        if options.standing is not None:
            confused = datasets.confuse(workshop.out / f"standing_seed_{halves.SEED}", options.standing.resolve(), datasets.confusion(real), halves.SEED)
            yield from at("standing scanner", confused, usual)
    for seed in options.seeds:
        yield from at(f"street {seed}", workshop.simulate(seed, 2, SCANS)[0], [0.1, 0.2], max_range=40)


def main():
    parser = halves.parser_of(__doc__)
    parser.add_argument("--seeds", nargs="*", type=int, default=[5, 6, 7, 8], help="streets; 5 to 8 unless given")
    parser.add_argument("--modes", nargs="+", choices=MODES, default=list(MODES), help=", ".join(MODES) + " unless given")
    parser.add_argument("--resolutions", nargs="+", type=float, default=[], help="edges of voxels in metres, of all scenes")
    options = parser.parse_args()
    workshop = Workshop(options.tessera.resolve(), options.out.resolve())
    print(f"seed of drawn labels {halves.SEED}")
    rows = []
    for scene, dataset, asked in scenes(workshop, options):
        for mode in options.modes:
            rows.append(row_of(workshop, scene, dataset, mode, **asked))
            print(" | ".join(rows[-1]), flush=True)
    print(markdown.table(("scene", "mode", "gain, no free space", "gain", "gain without what moves", "calibration error", "Brier score", "bytes a label voxel",
                          "ms, labels alone"), rows))


if __name__ == "__main__":
    main()
