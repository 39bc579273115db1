# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What a start leaves of the files of earlier ones: docs/reference/operations.md, Maps that are kept."""
import time
import unittest

import own_network
from fault_case import Faults
from sensor_sender import WALL_CLASS

own_network.enter_or_skip()


class Restarts(Faults):
    def test_a_start_overwrites_no_map_of_an_earlier_one(self):
        """Neither its own map, nor the global one, nor what it published."""
        names = ("node", "global", "contribution")
        output = {"global_map": "global.tsm", "contribution": "contribution.tsm"}
        empty = {"output": output, "robot": {"restart": "empty"}}
        node, sensors = self.mapping(**empty)
        time.sleep(0.5)
        node.end()
        first = {name: (self.folder / f"{name}.tsm").read_bytes() for name in names}
        # One that crashes before it has written anything, then one that writes.
        crashed = self.node(**empty)
        place = 0
        for name in names:
            place = crashed.says(f"{name}.epoch-1.tsm", place)
        self.assertEqual(3, crashed.said.count("the earlier map is kept as"))
        crashed.kill()
        for name in names:
            self.assertEqual(first[name], (self.folder / f"{name}.tsm").read_bytes())
        sensors.position = [50.0, 0.0, 0.0]
        last = self.node_that_maps(sensors, **empty)
        time.sleep(0.5)
        report = last.end()
        self.assertEqual(3, report["epoch"])
        self.assertEqual([], report["mapping"]["kept_maps"])
        for name in names:
            self.assertEqual(first[name], (self.folder / f"{name}.epoch-1.tsm").read_bytes())
            self.assertNotEqual(first[name], (self.folder / f"{name}.tsm").read_bytes())
        self.assertEqual(3, len([*self.folder.glob("*epoch*")]))
        self.assertEqual([("unknown", 0), ("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1), (55.1, 0.1, 0.1)))
        # Whose it is the next start reads in each.
        self.node(**empty).says("global.epoch-3.tsm")

    def test_maps_may_be_overwritten_where_that_is_configured(self):
        output = {"global_map": "global.tsm", "keep_maps": False}
        node, sensors = self.mapping(output=output)
        node.end()
        self.assertEqual([], self.node_that_maps(sensors, output=output).end()["mapping"]["kept_maps"])
        self.assertEqual([], [*self.folder.glob("*epoch*")])

    def test_a_file_that_is_no_map_is_kept_too(self):
        (self.folder / "node.tsm").write_text("not a map")
        node, _ = self.mapping()
        report = node.end()
        self.assertEqual("not a map", (self.folder / "node.earlier.tsm").read_text())
        self.assertEqual(1, len(report["mapping"]["kept_maps"]))


if __name__ == "__main__":
    unittest.main()
