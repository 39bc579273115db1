#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""reliability.py --tessera PROGRAM --out OUT [--dataset semantickitti_08] [--streets SEED ...] [--honest FIRST LAST]: whom to believe.

Three robots, of which one is wrong: classes swapped, all classes permuted, half of the labels permuted or drawn evenly. Each of the three in turn.
A row: mean IoU of the two others alone, what all three have over that, weighed and not, and who is named. Scenes: two real scans
for each robot, and streets. Then robots that are honest, each with a fifth of its labels drawn evenly: who is named all the same, on streets of
many seeds (--honest), and what that costs."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import datasets  # noqa: E402  these need the path above
import halves  # noqa: E402
import markdown  # noqa: E402
import street  # noqa: E402
from workshop import Workshop  # noqa: E402

SCANS, NOISE = 20, 0.2
REAL_PARTS = ((0, 1), (2, 3), (4, 5))
LIES = {"swapped": lambda seed: datasets.swap, "permuted": lambda seed: datasets.permute, "half permuted": datasets.half_permuted,
        "half even": lambda seed: datasets.noise(0.5, seed)}


class Three:
    """Three robots, whose maps are made with right labels or changed ones."""
    def __init__(self, workshop, name, robots, judged, **options):
        self.workshop, self.name, self.robots, self.judged, self.options = workshop, name, robots, judged, options

    def map(self, robot, change=None, kind="as_they_are"):
        dataset = self.robots[robot]
        if change is not None:
            scans = range(len((dataset / "poses.txt").read_text().splitlines()))
            dataset = datasets.relabel(self.workshop.out / f"{self.name}_{robot}_{kind}", dataset, scans, change)
        return self.workshop.map(f"{self.name}_{robot}_{kind}", dataset, robot=robot, **self.options)[0]

    def fuse(self, name, maps, **options):
        """Mean IoU in percent, and the names of classes by the robots that are named."""
        found = self.workshop.fuse_and_judge(f"{self.name}_{name}", maps, self.judged, options)
        named = {one["robot"]: one["named"] for one in found["fuse"]["reliability"] if one["named"]}
        return 100 * found["eval"]["mean_iou"], named

    def honest(self):
        return [self.map(robot) for robot in range(3)]


def of_real(workshop, dataset):
    parts = [datasets.subset(workshop.out / f"three_{robot}", dataset, scans) for robot, scans in enumerate(REAL_PARTS)]
    return Three(workshop, "three_real", parts, dataset, **halves.REAL)


def of_street(workshop, seed):
    robots = workshop.simulate(seed, 3, SCANS)
    judged = datasets.join(workshop.out / f"three_{seed}_judged", [(robot, range(0, SCANS, street.JUDGED_EVERY)) for robot in robots])
    return Three(workshop, f"three_street_{seed}", robots, judged, resolution=street.RESOLUTION_M)


def text_of(named):
    return ", ".join(f"{robot}: {'all' if len(classes) > 8 else ' '.join(classes)}" for robot, classes in named.items()) or "-"


def judge_lies(scene, three):
    honest, rows = three.honest(), []
    for liar in range(3):
        others = three.fuse(f"without_{liar}", [one for robot, one in enumerate(honest) if robot != liar])[0]
        for lie, change in LIES.items():
            maps = list(honest)
            maps[liar] = three.map(liar, change(liar + 1), lie.replace(" ", "_"))
            weighed, named = three.fuse("weighed", maps)
            as_it_is, _ = three.fuse("as_it_is", maps, reliability="off")
            rows.append((scene, liar, lie, f"{others:.2f}", f"{weighed - others:+.2f}", f"{as_it_is - others:+.2f}", text_of(named)))
            print(" | ".join(map(str, rows[-1])), flush=True)
    return rows


def judge_noise(scene, three):
    """Points that weighing costs honest robots, and who is named."""
    maps = [three.map(robot, datasets.noise(NOISE, robot + 1), "noise") for robot in range(3)]
    weighed, named = three.fuse("noise", maps)
    as_it_is, _ = three.fuse("noise_as_it_is", maps, reliability="off")
    print(f"{scene}, all with noise: weighing gives {weighed - as_it_is:+.3f} points; named {text_of(named)}", flush=True)
    return weighed - as_it_is, named


def main():
    parser = halves.parser_of(__doc__)
    parser.add_argument("--streets", nargs="*", type=int, default=[1, 2, 3], help="seeds of streets with a liar; 1 2 3 unless given")
    parser.add_argument("--honest", nargs=2, type=int, metavar=("FIRST", "LAST"), help="seeds of streets where all are honest")
    options = parser.parse_args()
    workshop = Workshop(options.tessera.resolve(), options.out.resolve())
    rows, noise = [], []
    if options.dataset is not None:
        three = of_real(workshop, options.dataset.resolve())
        rows += judge_lies("real scans", three)
        noise.append(judge_noise("real scans", three))
    for seed in options.streets:
        rows += judge_lies(f"street {seed}", of_street(workshop, seed))
    if options.honest is not None:
        for seed in range(options.honest[0], options.honest[1] + 1):
            noise.append(judge_noise(f"street {seed}", of_street(workshop, seed)))
    print(markdown.table(("scene", "liar", "what is wrong", "others alone, %", "weighed", "as they are", "named"), rows))
    if noise:
        print(f"honest: {sum(bool(named) for _, named in noise)} of {len(noise)} scenes with somebody named; "
              f"the least gain {min(gain for gain, _ in noise):+.3f} points")


if __name__ == "__main__":
    main()
