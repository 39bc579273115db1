# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The exchange between processes over real multicast, each on a host of its own behind a bridge; loss and partitions by
nft. With TESSERA_LONG_NETWORK=1 with more losses and a partition of 30 s, which takes some minutes."""
import os
import time
import unittest

import network_space
from team import TeamCase, held

network_space.enter("nft")
IS_LONG = os.environ.get("TESSERA_LONG_NETWORK", "") not in ("", "0")
LOSSES_PERCENT = (1, 10, 30, 70) if IS_LONG else (30,)
PARTITION_S = 30 if IS_LONG else 5


class Namespaces(TeamCase):
    def test_without_loss(self):
        network = self.network(3)
        reports = self.settled(self.members(network), contributions=3)
        self.assert_each_counts_once(reports)
        for report in reports:
            self.assertEqual(200, report["published"])
            self.assertEqual(0, report["link"]["failed"])

    def test_loss_on_every_link(self):
        for loss_percent in LOSSES_PERCENT:
            with self.subTest(loss_percent=loss_percent):
                network = network_space.Network(3)
                try:
                    network.shape_all(loss_percent=loss_percent)
                    members = self.members(network)
                    reports = self.settled(members, limit_s=240, contributions=3)
                    self.assert_each_counts_once(reports)
                    # Of some hundred datagrams 1 % may be none.
                    for host in range(3 if loss_percent >= 10 else 0):
                        self.assertGreater(network.dropped(host), 0)
                    for member in members:
                        member.close()
                finally:
                    network.close()

    def test_a_partition_and_rejoining(self):
        network = self.network(4)
        blocks = 100 * (PARTITION_S + 2)
        members = self.members(network, blocks=blocks, blocks_per_s=100)
        time.sleep(1)
        network.partition([0, 0, 1, 1])
        time.sleep(PARTITION_S)
        reports = [member.report() for member in members]
        self.assertNotEqual(reports[0]["content"], reports[2]["content"])
        for host in range(4):
            self.assertGreater(network.dropped(host), 0)
        network.shape_all()
        self.assert_each_counts_once(self.settled(members, contributions=4))

    def test_who_joins_after_the_origin_is_gone(self):
        network = self.network(3)
        network.shape_all(loss_percent=5)
        members = self.members(network, hosts=(0, 1))
        before = self.settled(members, contributions=2)
        members[0].kill()
        late = self.member(network, 2)
        reports = self.settled([members[1], late], contributions=3)
        for robot in (0, 1):
            self.assertEqual(held(before[robot], robot, 1), held(reports[1], robot, 1))

    def test_killed_while_it_publishes_and_started_again(self):
        network = self.network(3)
        network.shape_all(loss_percent=10)
        members = self.members(network, blocks=600, blocks_per_s=200)
        self.report_where(members[0], lambda report: (held(report, 1, 1) or {"blocks": 0})["blocks"] >= 20)
        members[1].kill()
        delivered = [held(member.report(), 1, 1) for member in (members[0], members[2])]
        members[1] = self.member(network, 1, session=2, blocks=100)
        # What nobody has any more of the first epoch stays lacking.
        reports = self.settled(members, contributions=4, lacking=True)
        for contribution in filter(None, delivered):
            self.assertGreaterEqual(held(reports[0], 1, 1)["blocks"], contribution["blocks"])
        for report in reports:
            self.assertEqual([(0, 1), (1, 1), (1, 2), (2, 1)],
                             [(c["robot"], c["epoch"]) for c in report["contributions"]])
            own = held(report, report["robot"], report["session"])
            self.assertEqual(own, held(reports[0], report["robot"], report["session"]))

    def test_eight_robots(self):
        network = self.network(8)
        network.shape_all(loss_percent=2)
        reports = self.settled(self.members(network, blocks=100, blocks_per_s=50), contributions=8)
        self.assert_each_counts_once(reports)

    def test_one_that_leaves(self):
        network = self.network(2)
        members = self.members(network)
        before = self.settled(members, contributions=2)
        last = members[0].leave()
        self.assertEqual(0, members[0].process.returncode)
        self.assertEqual(before[0]["digest"], last["digest"])
        after = self.report_where(members[1], lambda report: report["left"] == [0])
        self.assertEqual(before[1]["content"], after["content"])

    def test_another_key_and_another_resolution_are_refused_and_counted(self):
        network = self.network(4)
        key = self.fleet_key("fleet.key")
        other_key = self.key_of_same_mission("other.key", key)
        team = self.members(network, hosts=(0, 1), key=key)
        stranger = self.member(network, 2, key=other_key)
        coarse = self.member(network, 3, key=key, resolution=0.2)
        self.assert_each_counts_once(self.settled(team, contributions=2))
        for member in team:
            report = self.counting(member, "refused_tag", "refused_configuration")
            self.assertEqual([{"robot": 3, "resolution_m": 0.2}], report["mismatches"])
        self.assertEqual(1, len(self.counting(stranger, "refused_tag")["contributions"]))
        report = self.report_where(coarse, lambda report: len(report["mismatches"]) == 2)
        self.assertEqual([0.1, 0.1], [mismatch["resolution_m"] for mismatch in report["mismatches"]])
        self.assertEqual(1, len(report["contributions"]))

    def counting(self, member, *counters):
        return self.report_where(member, lambda report: all(report["exchange"][counter] > 0 for counter in counters))

    def report_where(self, member, holds, limit_s=30):
        """The first report for which something holds."""
        end = time.monotonic() + limit_s
        while True:
            report = member.report()
            if holds(report):
                return report
            self.assertLess(time.monotonic(), end, f"it never came to that: {report}")
            time.sleep(0.1)


if __name__ == "__main__":
    unittest.main()
