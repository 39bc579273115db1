# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The team clears together: two nodes, of which one has a car in its map that is gone when the other one comes by."""
import math
import subprocess
import unittest

import own_network
from command_case import TIME_LIMIT_S
from kitti_folder import BUILDING, CAR, Scan, write_dataset
from node_case import NodeCase

CAR_AT, WALL_AT = (8.1, 0.1, 0.1), (12.1, 0.1, 0.1)
SCANS = 50

own_network.enter_or_skip()


def look(has_car):
    """A wall 12 m ahead, and before it, 8 m ahead, a car or none."""
    points, ids = [], []
    for elevation in range(-25, 26, 2):
        for azimuth in range(-54, 55):
            y, z = math.tan(math.radians(0.15 * azimuth)), math.tan(math.radians(0.2 * elevation))
            is_car = has_car and abs(8 * y) < 0.5 and abs(8 * z) < 0.5
            x = 8.05 if is_car else 12.05
            points.append((x, x * y, x * z))
            ids.append(CAR if is_car else BUILDING)
    return Scan(points, ids)


class Objections(NodeCase):
    street = None  # It needs none.

    @classmethod
    def setUpClass(cls):
        super(NodeCase, cls).setUpClass()

    def setUp(self):
        super().setUp()
        # liblcm asks the routes where to send.
        subprocess.run(["ip", "route", "replace", "224.0.0.0/4", "dev", "lo"], check=True, timeout=TIME_LIMIT_S)
        write_dataset(self.folder / "before", [look(True) for _ in range(6)])
        write_dataset(self.folder / "after", [look(False) for _ in range(SCANS)])

    def node(self, number, dataset, **changes):
        config = self.config(number, replay={"dataset": str(self.folder / dataset), **changes.pop("replay")}, map={"resolution_m": 0.2, "inference": "counting", "downsample_m": "off"},
                             fusion={"diffusion": "none"}, run={"wait_for_peers": 1, "quiet_s": 8, "linger_s": 60}, **changes)
        return config, self.begin_node(config)

    def run_both(self, **changes):
        """One maps the car at once; the other one comes three seconds later. Their reports."""
        nodes = [self.node(0, "before", replay={"rate_hz": 10}), self.node(1, "after", replay={"rate_hz": 8, "start_delay_s": 3}, **changes)]
        return [self.end_of_node(*node)[0] for node in nodes]

    def states(self, number):
        """Of the car's place and the wall's, in a robot's global map."""
        text = "x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in (CAR_AT, WALL_AT))
        return [row["state"] for row in self.query_rows(f"robot_{number}.global.tsm", text)[1]]

    def test_what_the_second_robot_looks_through_is_gone_for_both(self):
        reports = self.run_both()
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])
        for number, report in enumerate(reports):
            self.assertEqual(["free", "occupied"], self.states(number))
            self.assertGreater(report["global_map"]["objected_voxels"], 0)
            self.assertEqual([1], [c["robot"] for c in report["contributions"] if c.get("objections")])
        self.assertEqual(0, reports[0]["objections"]["objections"])
        self.assertGreater(reports[1]["objections"]["objected_voxels"], 0)

    def test_a_robot_that_is_not_to_object_does_not(self):
        reports = self.run_both(network={"objections": 0})
        self.assertEqual(["occupied", "occupied"], self.states(1))
        for report in reports:
            self.assertEqual(0, report["global_map"]["objected_voxels"])
            self.assertEqual([], [c for c in report["contributions"] if c.get("objections")])


if __name__ == "__main__":
    unittest.main()
