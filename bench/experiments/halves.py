# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Two robots that have some scans of a recorded dataset each, their maps, and all of these scans as one dataset to judge maps
with; and the options of what measures many such pairs."""
import argparse
import itertools
import pathlib

import datasets

SEED = 23  # of labels and points that are drawn
REAL = {"resolution": 0.1, "max_range": 40}
SCANS_012_345 = ((0, 1, 2), (3, 4, 5))


class Halves:
    def __init__(self, workshop, name, dataset, halves, **options):
        self.name, self.maps = name, []
        for robot, scans in enumerate(halves):
            part = datasets.subset(workshop.out / f"{name}_{robot}", dataset, scans)
            self.maps.append(workshop.map(f"{name}_{robot}", part, robot=robot, **options)[0])
        self.all_scans = datasets.subset(workshop.out / f"{name}_both", dataset, sorted(itertools.chain(*halves)))
        self.asked = {"overlap_of": self.maps}


def of_real(workshop, dataset, halves):
    name = "real_" + "_".join("".join(map(str, scans)) for scans in halves)
    return Halves(workshop, name, dataset, halves, **REAL)


def of_standing(workshop, dataset, real):
    """The standing scanner, with labels drawn from the confusion of the real scans."""
    confused = datasets.confuse(workshop.out / f"standing_seed_{SEED}", dataset, datasets.confusion(real), SEED)
    return Halves(workshop, f"standing_seed_{SEED}_0_11_12_22", confused, (range(12), range(12, 23)), resolution=REAL["resolution"])


def parser_of(doc):
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tessera", required=True, type=pathlib.Path, help="the command")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--dataset", type=pathlib.Path, help="folder of semantickitti_08")
    parser.add_argument("--standing", type=pathlib.Path, help="folder of scanner_standing; its labels are drawn from the confusion of --dataset")
    return parser
