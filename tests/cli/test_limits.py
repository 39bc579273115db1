# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Limits of work and time: what they leave out is told, and with enough of both nothing is different."""
import unittest

import kitti_folder as kitti
from command_case import CommandCase


class Limits(CommandCase):
    def setUp(self):
        super().setUp()
        self.scans = [kitti.corner_scan(i, pose=kitti.moved(0.3 * i)) for i in range(3)]
        self.data = kitti.write_dataset(self.folder / "data", self.scans)
        self.out = self.folder / "map.tsm"

    def test_a_work_budget_that_is_spent_is_no_lack_of_memory(self):
        result, report = self.map_dataset(self.data, self.out, "--work-budget", "2000")
        self.assert_warned(result, "--work-budget")
        self.assertNotIn("--memory", result.stderr)
        self.assertEqual(0, report["memory"]["refused"])
        self.assertGreater(report["totals"]["left_out"], 0)
        self.assertEqual(report["totals"]["left_out"],
                         sum(scan["refused_work"] + scan["rays_refused_work"] for scan in report["scans"]))

    def test_a_deadline_that_leaves_time_for_nothing_is_told(self):
        result, report = self.map_dataset(self.data, self.out, "--deadline", "0.001")
        self.assert_warned(result, "--deadline")
        self.assertNotIn("--work-budget", result.stderr)
        self.assertEqual(0, report["memory"]["refused"])
        totals = report["totals"]
        self.assertEqual(totals["left_out"], totals["left_out_deadline"])
        # How late a scan ends, and whether within the clock's tick, is the machine's.
        late = [scan["overshoot_ms"] for scan in report["scans"]]
        self.assertEqual(sum(ms > 0 for ms in late), totals["deadline_overruns"])
        self.assertEqual(max(late), totals["worst_overshoot_ms"])
        _, whole = self.map_dataset(self.data, self.folder / "whole.tsm")
        self.assertLess(report["memory"]["label_voxels"], 0.1 * whole["memory"]["label_voxels"])
        for scan in report["scans"]:
            self.assertGreater(scan["left_out"], 0)
            self.assertEqual(scan["left_out"], scan["refused_deadline"] + scan["rays_refused_deadline"] +
                             scan["returns_cut"] + scan["rays_cut"] + scan["points_cut"])

    def test_a_deadline_that_leaves_time_for_all_changes_nothing(self):
        _, plain = self.map_dataset(self.data, self.out)
        result, report = self.map_dataset(self.data, self.folder / "timed.tsm", "--deadline", "1e8")
        self.assert_not_warned(result)
        self.assertEqual(plain["digest"], report["digest"])
        totals = report["totals"]
        self.assertEqual((0, 0, 0, 0), (totals["left_out"], totals["left_out_deadline"], totals["deadline_overruns"],
                                        totals["worst_overshoot_ms"]))
        for scan in report["scans"]:
            self.assertLessEqual(scan["work_spent"], scan["work_predicted"])
            self.assertLessEqual(scan["work_predicted"], scan["work_limit"])

    def test_the_tighter_of_budget_and_deadline_holds(self):
        result, report = self.map_dataset(self.data, self.out, "--deadline", "1e8", "--work-budget", "2000")
        self.assert_warned(result, "--work-budget")
        self.assertEqual(0, report["totals"]["left_out_deadline"])
        self.assertEqual({2000}, {scan["work_limit"] for scan in report["scans"]})


if __name__ == "__main__":
    unittest.main()
