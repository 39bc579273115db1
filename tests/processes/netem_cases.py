# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What test_netem.py runs in a kernel that has netem."""
import unittest

import network_space
from team import TeamCase

# A jitter as large as the delay: datagrams overtake each other by dozens.
LATE = ("delay", "40ms", "40ms")
OVERTAKING = ("delay", "20ms", "reorder", "30%", "50%")
TWICE = ("duplicate", "20%")
DAMAGED = ("corrupt", "10%")
# Good and bad times of some 12 and 4 datagrams; in bad ones nearly all is lost.
BURSTS = ("loss", "gemodel", "8%", "25%", "90%", "1%")


class Netem(TeamCase):
    def run_team(self, disciplines):
        """A team with one of the disciplines on what each sends; gives the network and the reports in the end."""
        network = self.network(3)
        for host, discipline in enumerate(disciplines):
            network.queue(host, "netem", *discipline)
        reports = self.settled(self.members(network, blocks=120, blocks_per_s=120), contributions=3)
        self.assert_each_counts_once(reports)
        return network, reports

    def test_each_robot_with_another_trouble(self):
        network, reports = self.run_team([(*LATE, *TWICE), BURSTS, DAMAGED])
        # What is heard twice, or after later ones, is refused as a replay or stale.
        for report in reports[1:]:
            counted = report["exchange"]
            self.assertGreater(counted["refused_replay"] + counted["records_stale"], 0)
        self.assertGreater(network.queue_statistics(1)["drops"], 0)
        # A damaged datagram does not get past the kernel's checksum.
        self.assertGreater(self.damaged(network, 0) + self.damaged(network, 1), 0)

    def test_all_of_it_on_every_link(self):
        network, _ = self.run_team(3 * [(*LATE, *TWICE, *DAMAGED, *BURSTS)])
        for host in range(3):
            self.assertGreater(network.queue_statistics(host)["drops"], 0)

    def test_overtaking(self):
        self.run_team(3 * [OVERTAKING])

    @staticmethod
    def damaged(network, host):
        """Datagrams that host's kernel dropped as damaged."""
        said = network_space.run(*network.inside(host), "cat", "/proc/net/snmp")
        names, values = [line.split() for line in said.splitlines() if line.startswith("Udp:")]
        return int(dict(zip(names, values))["InCsumErrors"])


if __name__ == "__main__":
    unittest.main()
