# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments still run, on a few scans, keep what they made, and fill the page."""
import array
import math
import os
import pathlib
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

import datasets  # noqa: E402  these need the path above
import diffusion  # noqa: E402
import robustness  # noqa: E402
import run_experiments  # noqa: E402
import street  # noqa: E402
import teams  # noqa: E402
import write_page  # noqa: E402
from workshop import Workshop  # noqa: E402
from write_docs import PART, fill  # noqa: E402

TESSERA = pathlib.Path(os.environ["TESSERA_BUILD"]) / "tessera"


class Frames(unittest.TestCase):
    def test_a_wrong_place_is_as_wrong_as_it_says(self):
        right = datasets.wrong_place(datasets.IDENTITY, 3.0, 40.0, 7)
        wrong = datasets.wrong_place(right, 0.3, 5.0, 1)
        moved = [wrong[i][3] - right[i][3] for i in range(3)]
        self.assertAlmostEqual(0.3, math.hypot(*moved))
        turn = datasets.product(datasets.inverse(right), wrong)
        self.assertAlmostEqual(5.0, math.degrees(math.acos((turn[0][0] + turn[1][1] + turn[2][2] - 1.0) / 2.0)))
        there_and_back = datasets.product(wrong, datasets.inverse(wrong))
        for i in range(4):
            for j in range(4):
                self.assertAlmostEqual(datasets.IDENTITY[i][j], there_and_back[i][j])

    def test_labels_that_are_wrong(self):
        change = datasets.noise(0.25, 1)
        same = sum(change(252) == 252 for _ in range(4000))
        self.assertTrue(2900 < same < 3100, same)  # 252 is none of the classes drawn
        self.assertEqual([70, 10, 48, 40, 50], [datasets.swap(raw) for raw in (252, 70, 40, 48, 50)])


class Parts(unittest.TestCase):
    """Datasets made of a small one: two points of a pole and two of a road in each of three scans."""
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = pathlib.Path(folder.name)
        self.whole = self.out / "whole"
        for name in datasets.FOLDERS:
            (self.whole / name).mkdir(parents=True)
        for scan in range(3):
            x = [0.1, 0.2, 5.0, 9.0]
            points = array.array("f", (value for i in range(4) for value in (x[i], 0.0, scan, 1.0)))
            (self.whole / "velodyne" / f"{scan:06d}.bin").write_bytes(points.tobytes())
            for name, ids in (("labels", [80, 80, 40, 40]), ("predictions", [80, 71, 40, 48])):
                (self.whole / name / f"{scan:06d}.label").write_bytes(array.array("I", ids).tobytes())
        (self.whole / "poses.txt").write_text("".join(f"1 0 0 {scan} 0 1 0 0 0 0 1 0\n" for scan in range(3)))
        (self.whole / "calib.txt").write_text("Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")

    def ids(self, folder, name):
        return [list(datasets.read_ids(path)) for path in sorted((folder / name).glob("*.label"))]

    def test_some_scans_keep_their_poses(self):
        part = datasets.subset(self.out / "part", self.whole, (2, 0))
        self.assertEqual([2.0, 0.0], [pose[0][3] for pose in datasets.read_poses(part)])
        self.assertEqual((self.whole / "velodyne/000002.bin").read_bytes(), (part / "velodyne/000000.bin").read_bytes())
        self.assertTrue((part / "calib.txt").exists())

    def test_labels_drawn_from_a_confusion_are_the_same_within_a_cell_and_a_run(self):
        taken = datasets.confusion(self.whole)
        self.assertEqual({80: [80, 71] * 3, 40: [40, 48] * 3}, taken)
        drawn = [self.ids(datasets.confuse(self.out / f"drawn_{seed}", self.whole, taken, seed, cell_m=10.0, single=0.0), "predictions")
                 for seed in range(20)]
        for scans in drawn:
            for scan in scans:
                self.assertEqual((scan[0], scan[2]), (scan[1], scan[3]))
        self.assertEqual({(a, b) for a in (80, 71) for b in (40, 48)}, {(scan[0], scan[2]) for scans in drawn for scan in scans})
        again = self.ids(datasets.confuse(self.out / "again", self.whole, taken, 3, cell_m=10.0, single=0.0), "predictions")
        self.assertEqual(drawn[3], again)
        self.assertEqual([[80, 71, 40, 48]] * 3, self.ids(self.whole, "predictions"))

    def test_thinning_takes_points_of_these_ids_alone(self):
        kept = [self.ids(datasets.thin(self.out / f"few_{seed}", self.whole, {80}, 0.25, seed), "labels") for seed in range(20)]
        self.assertTrue(all(scan.count(40) == 2 for scans in kept for scan in scans))
        poles = sum(scan.count(80) for scans in kept for scan in scans)
        self.assertTrue(15 < poles < 45, poles)  # of 120
        scan = self.out / "few_0"
        self.assertEqual(16 * len(kept[0][0]), len((scan / "velodyne/000000.bin").read_bytes()))
        self.assertEqual([len(scan) for scan in kept[0]], [len(scan) for scan in self.ids(scan, "predictions")])


class Teams(unittest.TestCase):
    def test_neighbours_from_one_end_of_the_street_to_the_other(self):
        self.assertEqual([(1, 0)], teams.neighbours(2))
        self.assertEqual([(1, 3), (3, 2), (2, 0)], teams.neighbours(4))


class Smoke(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.workshop = Workshop(TESSERA, cls.folder.name)
        cls.pair = street.Pair(cls.workshop, 1, 2)
        found = {"right": robustness.undisturbed(cls.pair), "noise": [],
                 "places": robustness.wrong_places(cls.pair, (0.5,), (), (1,)),
                 "swapped": robustness.relabelled(cls.pair, "swapped", [datasets.swap, datasets.swap])}
        cls.found = {"pairs": [run_experiments.pair_rows(cls.pair)], "robustness": {"street": found},
                     "diffusion": {"street": diffusion.measure(cls.pair, street.RESOLUTION_M, quick=True)}}

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_wrong_labels_make_the_map_worse(self):
        found = self.found["robustness"]["street"]
        self.assertGreater(found["right"]["none"]["mean_iou"], 0.1)
        self.assertLess(found["swapped"]["none"]["mean_iou"], found["right"]["none"]["mean_iou"])

    def test_what_was_made_is_kept(self):
        self.workshop.call = self.fail
        try:
            self.assertEqual(self.found["pairs"][0], run_experiments.pair_rows(self.pair))
        finally:
            del self.workshop.call

    def test_tables(self):
        for table in (write_page.pairs, write_page.places, write_page.labels, write_page.grid, write_page.settings):
            self.assertGreater(table(self.found).count("\n"), 2)

    def test_the_page_has_a_place_for_every_table(self):
        page = (HERE.parent.parent / "docs/measured/experiments.md").read_text()
        _, used = fill(page, {}, {name: lambda found: None for name in write_page.TABLES})
        self.assertEqual(sorted(write_page.TABLES), sorted(used))
        for part in PART.finditer(page):
            self.assertGreater(len(part[0].splitlines()), 5)


if __name__ == "__main__":
    unittest.main()
