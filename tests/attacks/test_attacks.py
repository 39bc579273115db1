# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What is left of attacks on fleets of processes: nothing, by what docs/design/threat-model.md says of each degree of trust. Here all attacks come
at once and soon end; bench/attack_table.py runs each alone, and waits for 30 s."""
import pathlib
import sys
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "processes"))
import network_space

network_space.enter()
from attack_case import AttackCase, changed, refused
from effects import effects
from scenario import FLEET_KEY, KEY_ALONE, Scenario

class Attacks(AttackCase, unittest.TestCase):
    scenario = Scenario
    settle_s = 30  # Most are settled in two, without signatures in fifteen; a busy machine takes longer.

    def refusals(self, scenario):
        return [refused(member.report(), "exchange") for member in scenario.members[:-1]]

    def test_a_fleet_with_a_key_alone_and_its_key(self):
        """What was forged over is published again, unasked."""
        self.attack(KEY_ALONE, FLEET_KEY)


class EffectsAreSeen(unittest.TestCase):
    def test_each_kind_of_effect(self):
        contribution = {"robot": 0, "epoch": 1, "blocks": 5, "label_evidence": 1.0, "passes": 2, "digest": "a", "frame_revision": 1,
                        "a_point": [1, 2, 3]}
        other = contribution | {"robot": 1, "digest": "b"}
        names = [{"robot": robot, "epoch": 1, "records": 5, "complete": True} for robot in (0, 1)]
        good = [{"robot": robot, "epoch": 1, "contributions": [contribution, other], "names": names, "left": [], "parts": 10}
                for robot in (0, 1)]
        published = {0: contribution, 1: other}
        self.assertEqual([], effects(good, published))

        of_nobody = {"robot": 77, "epoch": 1, "records": 0, "complete": False}
        changes = {
            "another content of robot 0": lambda r: r["contributions"][0].update(digest="c"),
            "another frame of robot 0": lambda r: r["contributions"][0].update(frame_revision=2),
            "holds nothing of robot 0": lambda r: r["contributions"].pop(0),
            "lacks something of robot 0": lambda r: r["names"][0].update(complete=False),
            "epoch 3 of robot 0": lambda r: r["names"].append(of_nobody | {"robot": 0, "epoch": 3}),
            "robot 77, which nobody is": lambda r: r["names"].append(of_nobody),
            "takes robot 0 for gone": lambda r: r["left"].append(0),
            "keeps 11 parts": lambda r: r.update(parts=11)}
        for what, change in changes.items():
            with self.subTest(what):
                found = effects(changed(good, change), published)
                self.assertEqual(1, len(found))
                self.assertIn(what, found[0])
        # What all hold alike and nobody published.
        def other_evidence(report):
            report["contributions"][0].update(label_evidence=2.0)

        alike = changed(good, other_evidence)
        other_evidence(alike[0])
        self.assertEqual(2, len(effects(alike, published)))
        of_member = changed(good, lambda r: r["names"].extend([of_nobody] * 4))
        self.assertEqual([], effects(of_member, published, quota_of=77))
        self.assertEqual([], effects(of_member, published, nobody_may_stay=True))
        self.assertEqual(1, len(effects(changed(good, lambda r: r["names"].extend([of_nobody] * 5)), published, quota_of=77)))


if __name__ == "__main__":
    unittest.main()
