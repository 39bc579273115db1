# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's own body: what is in its boxes is not mapped, and boxes that are none are refused."""
import json
import unittest

import kitti_folder as kitti
import own_network
from command_case import CommandCase
from node_case import NodeCase

IN_OWN_NETWORK = own_network.enter()

BOX = (-3.0, -1.0, -2.0, -1.0, 1.0, -0.5)
ON_BODY = [(-2.0, 0.1 * y, -1.0) for y in range(-9, 10)]


def text_of(numbers):
    return "--body=" + ",".join(map(str, numbers))


class Body(CommandCase):
    def setUp(self):
        super().setUp()
        self.out = self.folder / "map.tsm"
        self.bare = [kitti.corner_scan(i, pose=kitti.moved(0.3 * i)) for i in range(3)]
        self.seen = [kitti.Scan(scan.points + ON_BODY, scan.predicted + [kitti.CAR] * len(ON_BODY), pose=scan.pose)
                     for scan in self.bare]
        self.data = kitti.write_dataset(self.folder / "data", self.seen)

    def test_the_map_is_that_of_scans_without_it(self):
        _, expected = self.map_dataset(kitti.write_dataset(self.folder / "bare", self.bare), self.out)
        _, plain = self.map_dataset(self.data, self.out)
        for carving in ("rays", "image"):
            _, report = self.map_dataset(self.data, self.out, text_of(BOX), "--carving", carving)
            _, others = self.map_dataset(self.folder / "bare", self.out, "--carving", carving)
            self.assertEqual(others["digest"], report["digest"])
            self.assertEqual([len(ON_BODY)] * 3, [scan["on_body"] for scan in report["scans"]])
            self.assertEqual(list(BOX), report["config"]["body"])
        self.assertNotEqual(expected["digest"], plain["digest"])
        self.assertEqual([0] * 3, [scan["on_body"] for scan in plain["scans"]])

    def test_all_on_it_is_said(self):
        result, _ = self.map_dataset(self.data, self.out, text_of((0.9, -50, -50, 50, 50, 50, -50, -50, -50, -0.9, 50, 50)))
        self.assert_warned(result, "on the robot's own body; check --body")

    def test_boxes_that_are_none_are_refused(self):
        for numbers, saying in (((1, 1, 1, 2, 2), "has 5 numbers"), (BOX * 9, "has 54 numbers"),
                                ((1, 1, 1, 0, 0, 0), "box 1 that is empty"), ((0, 0, 0, 1, 1, "nan"), "box 1 that"),
                                (BOX + (0, 0, 0, 1, 1, 101), "box 2 that is empty or too large"),
                                ((1, 1, 1, 2, 2, "x"), "numbers with commas"),
                                ((-1, -1, -1, 1, 1, 1), "a box around the sensor"), ((0, 0, 0, 1, 1, 1), "a box around")):
            with self.subTest(numbers):
                self.map_refused(self.data, text_of(numbers), saying=("--body", saying))

    def test_the_range_of_what_did_not_come_back(self):
        for value in ("-1", "nan", "0.4", "2e6"):
            with self.subTest(value):
                self.map_refused(self.data, f"--no-return-range={value}", saying=("--no-return-range",))
        _, report = self.map_dataset(self.data, self.out, "--no-return-range", "30")
        self.assertEqual(30, report["config"]["no_return_range"])
        self.assertEqual([0] * 3, [scan["no_return"] for scan in report["scans"]])

    def test_clouds_say_what_did_not_come_back(self):
        """A wall to the front, and nothing to the back: the latter is free up to the range, for map and no other command."""
        rows = [(5, 0.05 * y, 0.05 * z, 0) for y in range(-40, 41) for z in range(-10, 11)]
        away = [(-1, 0.01 * y, 0.01 * z, 1) for y in range(-20, 21) for z in range(-5, 6)]
        header = ("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
                  "property uchar no_return\nend_header\n")
        for name, points in (("all", rows + away), ("hits", rows)):
            (self.folder / name).mkdir()
            lines = "".join(" ".join(map(str, p)) + "\n" for p in points)
            (self.folder / name / "0.ply").write_text(header.format(len(points)) + lines)
        (self.folder / "poses.txt").write_text("1 0 0 0.05 0 1 0 0.05 0 0 1 0.05\n")

        def mapped(name, *options):
            out = self.folder / f"{name}.tsm"
            self.done("map", "--ply", name, "--poses", "poses.txt", "--out", out, "--report", "map.json", *options)
            report = json.loads((self.folder / "map.json").read_text())
            _, found = self.query_rows(out, "x,y,z\n-3.95,0.05,0.05\n-7.95,0.05,0.05\n-0.95,0.05,0.05\n5.05,0.05,0.05\n")
            return report["scans"][0], report["digest"], [row["state"] for row in found]

        scan, off, states = mapped("all")
        self.assertEqual((len(rows), len(away)), (scan["in_range"], scan["no_return"]))
        self.assertEqual(["unknown"] * 3 + ["occupied"], states)
        self.assertEqual(off, mapped("hits")[1])
        for carving in ("rays", "image"):
            scan, _, states = mapped("all", "--no-return-range", "6", "--carving", carving)
            self.assertEqual((len(rows), len(away)), (scan["in_range"], scan["no_return"]))
            self.assertEqual(["free", "unknown", "free", "occupied"], states)


@unittest.skipUnless(IN_OWN_NETWORK, "no network namespaces")
class OfNode(NodeCase):
    AHEAD = (2.0, -4.0, -3.0, 8.0, 4.0, 1.0)

    def test_a_node_maps_as_the_command_does(self):
        config = self.config(0, robot={"body": self.AHEAD}, map={"memory": "256M"}, output={"local_map": "local.tsm"},
                             run={"wait_for_peers": 0, "quiet_s": 0.5})
        self.done("node", "--config", config)
        report = self.folder / "map.json"
        self.done("map", "--dataset", f"{self.street}/robot_0", "--out", "map.tsm", "--report", report, "--memory", "256M", "--resolution", 0.4,
                  "--max-range", 60, text_of(self.AHEAD))
        made = json.loads(report.read_text())
        self.assertGreater(sum(scan["on_body"] for scan in made["scans"]), 100)
        self.assertIn(made["digest"], self.done("info", "local.tsm").stdout)

    def test_a_sensor_in_a_box_is_refused_before_the_start(self):
        sensors = {"T_body_lidar": "lidar.txt", "interface": "lo"}
        for z, is_refused in ((1.5, False), (0.5, True), (1.0, True)):
            (self.folder / "lidar.txt").write_text(f"1 0 0 0\n0 1 0 0\n0 0 1 {z}\n0 0 0 1\n")
            config = self.config(0, robot={"body": [-1, -1, -1, 1, 1, 1]}, replay={"dataset": None, "rate_hz": None}, sensors=sensors)
            if is_refused:
                self.refused("node", "--check", "--config", config, saying=("[robot] body", "around the lidar of [sensors]"))
            else:
                self.done("node", "--check", "--config", config)
        # What is replayed has its sensor where the body is.
        self.refused("node", "--check", "--config", self.config(0, robot={"body": [-1, -1, -1, 1, 1, 1]}), saying=("[robot] body", "the sensor"))
