# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What is left of attacks on fleets of processes: nothing, by what docs/threat-model.md says of each degree of trust. Here all attacks come
at once and soon end; bench/attack_table.py runs each alone, and waits for 30 s."""
import copy
import pathlib
import sys
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "processes"))
import network_space

network_space.enter()
from attacks import mixed
from effects import effects
from scenario import FLEET_KEY, KEY_ALONE, MEMBER, NO_KEY, SIGNS, Scenario

ATTACK_S = 4
SETTLE_S = 20  # Most are settled in two; a busy machine takes longer.


class Attacks(unittest.TestCase):
    def attack(self, fleet, trust):
        with Scenario(fleet, trust) as scenario:
            sent = scenario.attack(mixed, ATTACK_S)
            self.assertGreater(sent, 200)
            scenario.join()
            left, _ = scenario.last_effects(SETTLE_S)
            self.assertEqual([], left)
            refused = [sum(count for name, count in member.report()["exchange"].items() if name.startswith("refused_"))
                       for member in scenario.members[:-1]]
            # The attack was heard.
            self.assertGreater(min(refused), 100)

    def test_a_fleet_that_signs_and_no_key(self):
        self.attack(SIGNS, NO_KEY)

    def test_a_fleet_that_signs_and_its_key(self):
        self.attack(SIGNS, FLEET_KEY)

    def test_a_fleet_that_signs_and_a_member(self):
        self.attack(SIGNS, MEMBER)

    def test_a_fleet_with_a_key_alone_and_none(self):
        self.attack(KEY_ALONE, NO_KEY)


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

        def changed(change):
            # One by one: the two are alike and nothing of one may be the other's.
            reports = [copy.deepcopy(report) for report in good]
            change(reports[1])
            return reports

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
                found = effects(changed(change), published)
                self.assertEqual(1, len(found))
                self.assertIn(what, found[0])
        # What all hold alike and nobody published.
        alike = changed(changes["another content of robot 0"])
        changes["another content of robot 0"](alike[0])
        self.assertEqual(2, len(effects(alike, published)))
        of_member = changed(lambda r: r["names"].extend([of_nobody] * 4))
        self.assertEqual([], effects(of_member, published, quota_of=77))
        self.assertEqual([], effects(of_member, published, nobody_may_stay=True))
        self.assertEqual(1, len(effects(changed(lambda r: r["names"].extend([of_nobody] * 5)), published, quota_of=77)))


if __name__ == "__main__":
    unittest.main()
