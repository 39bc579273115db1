# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Two nodes that drive towards each other: each says where it is, and leaves the other one out of its map."""
import subprocess
import unittest

import own_network
from command_case import TIME_LIMIT_S
from node_case import NodeCase

SCANS = 16
# Around the street's vehicles from where their sensor is, which is in none of the boxes.
BODY = [-2.8, -1.1, -2.0, 2.8, 1.1, -0.1, -2.8, -1.1, -0.1, -0.2, 1.1, 0.5, 0.2, -1.1, -0.1, 2.8, 1.1, 0.5]

own_network.enter_or_skip()


class Teammates(NodeCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.street = f"{cls.street}_{SCANS}"
        cls.simulate(cls.street, "--scans", SCANS, "--seed", 5)
        # liblcm asks the routes where to send.
        subprocess.run(["ip", "route", "replace", "224.0.0.0/4", "dev", "lo"], check=True, timeout=TIME_LIMIT_S)

    def drive(self, **robot):
        """Reports of both nodes, and what they said."""
        nodes = []
        for number in (0, 1):
            config = self.config(number, robot={"id": number, "state": "state", **robot},
                                 replay={"rate_hz": 4, "start_delay_s": 1}, run={"wait_for_peers": 1, "quiet_s": 1, "linger_s": 20})
            nodes.append((config, self.begin_node(config)))
        return zip(*(self.end_of_node(*node) for node in nodes), strict=True)

    def test_each_leaves_the_other_out(self):
        reports, said = self.drive(body=BODY)
        for report, error in zip(reports, said):
            self.assertNotIn("too large", error)
            exchange = report["exchange"]
            self.assertGreaterEqual(exchange["presences"], 5)
            self.assertGreaterEqual(exchange["presences_taken"], 3)
            self.assertEqual((0, 0), (exchange["refused_presences"], exchange["refused_body"]))
            self.assertEqual(1, report["scans"]["teammates"])
        # They come within 45 m of each other.
        self.assertGreater(sum(report["scans"]["on_teammate"] for report in reports), 0)
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])

    def test_a_body_that_is_too_large_is_said_to_be(self):
        reports, said = self.drive(body=[-9.0, -1.1, -2.0, 9.0, 1.1, -0.1])
        for report, error in zip(reports, said):
            self.assertIn("[robot] body is too large to be sent", error)
            self.assertEqual((0, 0), (report["exchange"]["presences"], report["scans"]["on_teammate"]))


if __name__ == "__main__":
    unittest.main()
