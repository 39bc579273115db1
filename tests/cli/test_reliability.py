# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""fuse: one of three robots whose classes are wrong is named, and counts less; of two nobody is."""
import json
import unittest

import kitti_folder as kitti
from command_case import CommandCase
from counting import COUNTING

WRONG = {kitti.ROAD: kitti.BUILDING, kitti.BUILDING: kitti.ROAD}


class Reliability(CommandCase):
    def setUp(self):
        super().setUp()
        # A floor of 4 by 4 m, half of it road; and beside it what robot 1 alone sees.
        self.floor = [(2.05 + 0.1 * x, 0.05 + 0.1 * y, 0.05) for x in range(40) for y in range(40)]
        self.alone = (20.05, 0.05, 0.05)
        self.maps = [self.make_map(0), self.make_map(1, WRONG), self.make_map(2)]
        self.out = self.folder / "global.tsm"

    def make_map(self, robot, change=None):
        ids = [kitti.ROAD if x < 4.0 else kitti.BUILDING for x, _, _ in self.floor] + [kitti.ROAD]
        ids = [(change or {}).get(one, one) for one in ids]
        alone = (self.alone[0], 10.0 * robot + 0.05, 0.05)
        # Robot 1 has more points than the others together.
        scans = [kitti.Scan([*self.floor, alone], ids)] * (5 if change else 1)
        folder = kitti.write_dataset(self.folder / f"data_{robot}", scans)
        path = self.folder / f"{robot}.tsm"
        self.map_dataset(folder, path, *COUNTING, "--robot", str(robot))
        return path

    def fuse(self, *words):
        report = self.folder / "fuse.json"
        result = self.done("fuse", *words, "--out", self.out, "--report", report)
        return result, json.loads(report.read_text())

    def label(self, p):
        row = self.query_rows(self.out, "x,y,z\n%g,%g,%g\n" % p)[1][0]
        return row["state"], int(row["label"])

    def test_one_of_three_is_named_and_counts_nothing(self):
        result, report = self.fuse(*self.maps)
        first, liar, last = report["reliability"]
        self.assertEqual([0, 1, 2], [one["robot"] for one in report["reliability"]])
        self.assertEqual({"road", "building"}, set(liar["named"]))
        self.assertEqual((1600, 0.0), (liar["judged"], liar["agreement"]))
        self.assertEqual(0.0, liar["classes"]["road"]["reliability"])
        for honest in (first, last):
            self.assertEqual(([], 1.0, 1.0), (honest["named"], honest["reliability"], honest["agreement"]))
        self.assertIn("most other robots contradict robot 1", result.stderr)
        self.assertIn("road", result.stderr)
        self.assertEqual(("occupied", kitti.ROAD_LABEL), self.label((3.05, 1.05, 0.05)))
        self.assertEqual(("occupied", kitti.BUILDING_LABEL), self.label((5.05, 1.05, 0.05)))
        self.assertEqual(("occupied", 0), self.label((20.05, 10.05, 0.05)))
        self.assertEqual(("occupied", kitti.ROAD_LABEL), self.label((20.05, 20.05, 0.05)))

    def test_without_reliability_it_outvotes_the_others(self):
        result, report = self.fuse(*self.maps, "--reliability", "off")
        self.assertEqual(("occupied", kitti.BUILDING_LABEL), self.label((3.05, 1.05, 0.05)))
        self.assertEqual({"road", "building"}, set(report["reliability"][1]["named"]))
        self.assertEqual(False, report["config"]["reliability"])

    def test_an_alarm_of_nothing_names_nobody(self):
        result, report = self.fuse(*self.maps, "--reliability-alarm", "0")
        self.assertEqual([[], [], []], [one["named"] for one in report["reliability"]])
        self.assertNotIn("contradict", result.stderr)
        self.refused("fuse", *self.maps, "--out", self.out, "--reliability-alarm", "1.5", saying=["--reliability-alarm"])

    def test_of_two_nobody_knows(self):
        _, report = self.fuse(*self.maps[:2])
        for one in report["reliability"]:
            self.assertEqual((0, 1600, 1600, []), (one["judged"], one["shared"], one["differing"], one["named"]))

    def test_the_order_of_the_maps_is_no_matter(self):
        self.assertEqual(self.fuse(*self.maps)[1]["digest"], self.fuse(*reversed(self.maps))[1]["digest"])


if __name__ == "__main__":
    unittest.main()
