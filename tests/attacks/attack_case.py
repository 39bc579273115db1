# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""All attacks at once on a fleet, by each degree of trust that leaves nothing: a test of processes or of nodes names its scenario."""
import copy

from attacks import mixed
from scenario import FLEET_KEY, KEY_ALONE, MEMBER, NO_KEY, SIGNS

ATTACK_S = 4


class AttackCase:
    """scenario: makes one of a fleet and a degree of trust. settle_s: within which nothing is left."""
    scenario, settle_s = None, 0

    def refusals(self, scenario):
        """Of each robot that was attacked, how many datagrams it refused."""
        raise NotImplementedError

    def attack(self, fleet, trust):
        with self.scenario(fleet, trust) as scenario:
            sent = scenario.attack(mixed, ATTACK_S)
            self.assertGreater(sent, 200)
            scenario.join()
            left, _ = scenario.last_effects(self.settle_s)
            self.assertEqual([], left)
            # The attack was heard.
            self.assertGreater(min(self.refusals(scenario)), 100)

    def test_a_fleet_that_signs_and_no_key(self):
        self.attack(SIGNS, NO_KEY)

    def test_a_fleet_that_signs_and_its_key(self):
        self.attack(SIGNS, FLEET_KEY)

    def test_a_fleet_that_signs_and_a_member(self):
        self.attack(SIGNS, MEMBER)

    def test_a_fleet_with_a_key_alone_and_none(self):
        self.attack(KEY_ALONE, NO_KEY)


def refused(report, *parts):
    """All that a report counts as refused in some of its parts."""
    return sum(count for part in parts for name, count in report[part].items() if name.startswith("refused_"))


def changed(good, change):
    """Copies of two reports, the second one changed. One by one: the two are alike and nothing of one may be the other's."""
    reports = [copy.deepcopy(report) for report in good]
    change(reports[1])
    return reports
