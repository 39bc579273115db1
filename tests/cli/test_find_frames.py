# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that nobody told where they are: they find each other's frames from what both have seen."""
import math
import pathlib
import subprocess
import unittest

import own_network
from command_case import TIME_LIMIT_S
from node_case import NodeCase

SCANS = 10
# A node must not end while the other one still searches, on a busy machine too: nothing is heard of it meanwhile.
QUIET_S = 8

own_network.enter_or_skip()


def matrix(numbers):
    return [list(numbers[4 * row:4 * row + 4]) for row in range(3)]


def product(a, b):
    return [[sum(a[row][k] * b[k][column] for k in range(3)) + (a[row][3] if column == 3 else 0.0) for column in range(4)] for row in range(3)]


def inverse(T):
    R = [[T[column][row] for column in range(3)] for row in range(3)]
    return [[*R[row], -sum(R[row][k] * T[k][3] for k in range(3))] for row in range(3)]


def error(found, right):
    """Metres, and degrees."""
    off = product(inverse(right), found)
    cosine = (off[0][0] + off[1][1] + off[2][2] - 1.0) / 2.0
    return math.hypot(off[0][3], off[1][3], off[2][3]), math.degrees(math.acos(min(1.0, max(-1.0, cosine))))


class FindFrames(NodeCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.street = f"{cls.street}_near"
        cls.simulate(cls.street, "--scans", SCANS, "--seed", 3, "--apart", 20, "--pose-error", 1, "--rotation-error", 3)
        # liblcm asks the routes where to send.
        subprocess.run(["ip", "route", "replace", "224.0.0.0/4", "dev", "lo"], check=True, timeout=TIME_LIMIT_S)

    def frame(self, number, name="T_global_map"):
        return matrix([float(word) for word in pathlib.Path(f"{self.street}/robot_{number}/{name}.txt").read_text().split()])

    def settings(self, number, robot, fusion):
        return self.config(number, robot={"id": number, "state": "state", **robot}, map={"resolution_m": 0.2, "max_range_m": 40.0, "memory": "120M"},
                           network={"bytes_per_s": 20000000}, fusion={"memory": "128M", **fusion}, run={"wait_for_peers": 1, "quiet_s": QUIET_S, "linger_s": 100})

    def run_both(self, robots, fusion):
        configs = [self.settings(number, robots[number], fusion[number]) for number in (0, 1)]
        nodes = [(config, self.begin_node(config)) for config in configs]
        return zip(*(self.end_of_node(*node) for node in nodes), strict=True)

    def placed(self, report, number):
        return next(robot for robot in report["frames"]["robots"] if robot["robot"] == number)

    def test_frames_are_found(self):
        reports, said = self.run_both([{}, {}], [{"frames": "found"}] * 2)
        right = product(inverse(self.frame(0)), self.frame(1))
        for number, report in enumerate(reports):
            frames = report["frames"]
            self.assertEqual("found", frames["mode"])
            self.assertEqual(["linked", "linked"], [robot["state"] for robot in frames["robots"]], frames)
            for robot in frames["robots"]:
                self.assertEqual((True, True, 0), (robot["in_use"], robot["arrived"], robot["anchor"]))
            metres, degrees = error(matrix(self.placed(report, 1)["T_team_map"]), right)
            self.assertLess(metres, 0.15)
            self.assertLess(degrees, 0.3)
            self.assertEqual(["used", "used"], [link["verdict"] for link in frames["links"]])
            self.assertEqual("found", frames["pairs"][0]["result"])
            self.assertIn(report["heap_allocations_after_start"], (0, None))
            self.assertIn("its frame is found", said[number])
        self.assertEqual(self.placed(reports[0], 1), self.placed(reports[1], 1))
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])

    def test_a_survey_holds_and_what_is_roughly_known_is_corrected(self):
        survey = {"frames": "refined", "frame_sigma_m": 0, "frame_sigma_deg": 0}
        rough = {"T_global_map": f"{self.street}/robot_1/T_global_map_perturbed.txt"}
        reports, _ = self.run_both([{}, rough], [survey, {"frames": "refined"}])
        given = self.frame(1, "T_global_map_perturbed")
        self.assertGreater(error(given, self.frame(1))[1], 1.0)
        for report in reports:
            self.assertEqual([1.0, 0.0, 0.0, 0.0], self.placed(report, 0)["T_team_map"][:4])
            self.assertEqual("given", self.placed(report, 0)["state"])
            T_team_world = matrix(self.placed(report, 1)["T_team_map"])
            metres, degrees = error(product(T_team_world, given), self.frame(1))
            self.assertLess(metres, 0.15)
            self.assertLess(degrees, 0.3)
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])

    def test_settings_that_do_not_go_together_are_refused(self):
        for robot, fusion, words in (({"T_global_map": f"{self.street}/robot_0/T_global_map.txt"}, {"frames": "found"}, "leave it out, or have it refined"),
                                     ({}, {"frames": "refined", "frame_sigma_m": 0}, "are both 0, for an exact frame, or both above it"),
                                     ({}, {"frames": "lost"}, "frames")):
            self.refused("node", "--config", self.settings(0, robot, fusion), saying=(words,))


if __name__ == "__main__":
    unittest.main()
