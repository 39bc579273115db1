# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What is left of attacks on fleets of nodes: nothing, by what docs/design/threat-model.md says of each degree of trust. As test_attacks.py, with
the program that runs on a robot."""
import pathlib
import sys
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "processes"))
import network_space

network_space.enter()
from attack_case import AttackCase, changed, refused
from node_fleet import NodeScenario, node_effects

class AttacksOnNodes(AttackCase, unittest.TestCase):
    scenario = NodeScenario
    settle_s = 20  # Most agree within four; a busy machine takes longer.

    def refusals(self, scenario):
        return [refused(report, "exchange", "link") for report in scenario.reports[:-1]]


class EffectsOnNodesAreSeen(unittest.TestCase):
    def test_each_kind_of_effect(self):
        held = [{"robot": robot, "epoch": 1, "submap": 0, "complete": True, "digest": digest, "parts": 5, "latest_version": 9}
                for robot, digest in ((0, "a"), (1, "b"))]
        good = [{"robot": robot, "epoch": 1, "contributions": held, "security": {"exclude_differs": []},
                 "peers": [{"robot": 1 - robot, "left": False, "mismatch": ""}]} for robot in (0, 1)]
        self.assertEqual([], node_effects(good))

        of_nobody = held[0] | {"robot": 77, "complete": False}
        changes = {
            "another content of robot 0": lambda r: r["contributions"][0].update(digest="c"),
            "holds nothing of robot 0": lambda r: r["contributions"].pop(0),
            "lacks something of robot 0": lambda r: r["contributions"][0].update(complete=False),
            "epoch 3 of robot 0": lambda r: r["contributions"].append(of_nobody | {"robot": 0, "epoch": 3}),
            "robot 77, which nobody is": lambda r: r["contributions"].append(of_nobody),
            "has not heard robot 0": lambda r: r["peers"].clear(),
            "takes robot 0 for gone": lambda r: r["peers"][0].update(left=True),
            "for one of another configuration": lambda r: r["peers"][0].update(mismatch="resolution_m"),
            "robot 0 excludes others": lambda r: r["security"]["exclude_differs"].append(0)}
        for what, change in changes.items():
            with self.subTest(what):
                found = node_effects(changed(good, change))
                self.assertEqual(1, len(found))
                self.assertIn(what, found[0])
        of_member = changed(good, lambda r: r["contributions"].extend([of_nobody] * 4))
        self.assertEqual([], node_effects(of_member, quota_of=77))


if __name__ == "__main__":
    unittest.main()
