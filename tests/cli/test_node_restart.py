# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera node that is killed or ended and started again: it has its map, submaps and corrections."""
import json
import time
import unittest

import own_network
from fault_case import Faults
from running_node import until
from sensor_sender import WALL_CLASS

own_network.enter_or_skip()

WALL = (5.1, 0.1, 0.1)
OTHER_WALL = (55.1, 0.1, 0.1)
SOON = {"robot": {"state_loss_s": 0.4}}


class Restart(Faults):
    def journals(self):
        return sorted((self.folder / "state").glob("*.tsj"))

    def kept_map(self, node):
        """Waits until what it has mapped up to now is durable."""
        since = time.time()
        until(lambda: [path for path in self.journals() if path.stat().st_mtime > since + 1.0], "a durable map")
        self.assertIsNone(node.process.poll())

    def killed(self, **changes):
        """A node that has mapped the wall, and was killed; and its sensors, which see nothing any more."""
        node, sensors = self.mapping(**SOON, **changes)
        self.kept_map(node)
        sensors.with_clouds = False
        node.kill()
        return sensors

    def started_again(self, sensors, words="continues the map of epoch 1", **changes):
        node = self.node(**{**SOON, **changes})
        node.says(words)
        return node

    def test_a_node_that_was_killed_has_its_map_and_goes_on(self):
        sensors = self.killed()
        node = self.started_again(sensors)
        report = node.end()
        self.assertEqual((2, 1), (report["epoch"], report["state"]["map_epoch"]))
        self.assertEqual(0, report["state"]["damaged_bytes"])
        self.assertIn(report["heap_allocations_after_start"], (0, None))
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at(WALL))
        digest, blocks = report["local_digest"], report["state"]["resumed_blocks"]
        # Every command reads what is kept.
        (journal,) = self.journals()
        self.done("info", journal, "--report", "info.json")
        info = json.loads((self.folder / "info.json").read_text())
        self.assertEqual((digest, 1, True), (info["digest"], info["epoch"], info["verified"]))
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at(WALL, file=journal))
        # After an end in order too, and nothing has changed.
        report = self.started_again(sensors).end()
        self.assertEqual((digest, blocks), (report["local_digest"], report["state"]["resumed_blocks"]))
        # It maps on in it, and what it has published is all of it.
        node = self.started_again(sensors)
        sensors.with_clouds = True
        node.says("integrated the first scan")
        self.kept_map(node)
        sensors.with_clouds = False
        report = node.end()
        self.assertGreaterEqual(report["state"]["resumed_blocks"], blocks)
        self.assertGreater(report["state"]["most_lost_ms"], 0)
        self.assertEqual([4], [c["epoch"] for c in report["contributions"] if c["own"]])

    def test_submaps_frames_and_corrections_are_those_of_before(self):
        in_submaps = {"map": {"submap_m": 1000}}
        node, sensors = self.mapping(**SOON, **in_submaps)
        self.kept_map(node)
        sensors.position = [50.0, 0.0, 0.0]
        node.says("submap 1 begins")
        self.kept_map(node)
        until(lambda: len(self.journals()) == 1 and list((self.folder / "state").glob("*.submap-0.tsm")), "the submap in its file")
        sensors.with_clouds = False
        node.kill()
        report = self.started_again(sensors, **in_submaps).end()
        self.assertEqual((1, [0]), (report["submaps"]["number"], [row["number"] for row in report["submaps"]["kept"]]))
        self.assertEqual([("occupied", WALL_CLASS)] * 2, self.states_at(WALL, OTHER_WALL))
        self.done("info", "node.tsm", "--verify", "--report", "info.json")
        info = json.loads((self.folder / "info.json").read_text())
        self.assertEqual([0, 1], [submap["number"] for submap in info["submaps"]])
        self.assertEqual(report["local_digest"], info["digest"])
        # Killed at once, which costs nothing.
        for _ in range(2):
            self.started_again(sensors, **in_submaps).kill()
        self.done("info", journal := self.journals()[0])
        self.assertIn("submap-1", journal.name)
        # Another jump: the next number.
        node = self.started_again(sensors, **in_submaps)
        sensors.with_clouds = True
        node.says("integrated the first scan")
        sensors.position = [0.0, 50.0, 0.0]
        node.says("submap 2 begins")
        node.end()
        self.assertEqual([("occupied", WALL_CLASS)] * 3, self.states_at(WALL, OTHER_WALL, (5.1, 50.1, 0.1)))

    def test_poses_of_another_frame_after_the_start(self):
        sensors = self.killed()
        sensors.position = [50.0, 0.0, 0.0]
        node = self.started_again(sensors)
        node.says("the map is saved, then cleared")
        node.says("the earlier map is kept as ")
        sensors.with_clouds = True
        node.says("integrated the first scan")
        self.kept_map(node)
        node.end()
        self.assertEqual([("unknown", 0), ("occupied", WALL_CLASS)], self.states_at(WALL, OTHER_WALL))
        # What is durable is the map after it was cleared.
        sensors.with_clouds = False
        self.started_again(sensors).end()
        self.assertEqual([("unknown", 0), ("occupied", WALL_CLASS)], self.states_at(WALL, OTHER_WALL))

    def test_damage_costs_the_damaged_part(self):
        sensors = self.killed()
        (journal,) = self.journals()
        data = bytearray(journal.read_bytes())
        data[len(data) // 2] ^= 0x55
        journal.write_bytes(bytes(data) + b"torn")
        node = self.started_again(sensors)
        node.says("bytes of the kept map were damaged and are left out")
        node.says("the last append to the kept map was not finished: 4 bytes are left out")
        report = node.end()
        self.assertGreater(report["state"]["damaged_bytes"], 4)
        self.assertEqual(4, report["state"]["torn_bytes"])
        self.assertGreater(report["state"]["resumed_blocks"], 1)
        # What it begins with says nothing that the settings do not say.
        blocks = report["state"]["resumed_blocks"]
        for place in (3, 40):
            data = bytearray(journal.read_bytes())
            data[place] ^= 0x55
            journal.write_bytes(bytes(data))
            report = self.started_again(sensors, "its begin is damaged").end()
            self.assertEqual((blocks, 1), (report["state"]["resumed_blocks"], report["state"]["notes"]))
            self.assertEqual(b"TSJRN", journal.read_bytes()[:5])
        # Frames that cannot be read cost frames alone, and stay under another name.
        frames = self.folder / "state/robot_0.epoch-1.frames"
        frames.write_bytes(b"torn")
        report = self.started_again(sensors, "is damaged").end()
        self.assertEqual(blocks, report["state"]["resumed_blocks"])
        self.assertEqual(b"torn", frames.with_name(frames.name + ".damaged").read_bytes())

    def test_a_node_that_has_mapped_nothing_yet_knows_of_no_pose(self):
        sensors = self.sensors()
        sensors.with_clouds = False
        node = self.node(**SOON)
        until(self.journals, "a journal")
        node.kill()
        sensors.position = [50.0, 0.0, 0.0]
        node = self.node(**SOON)
        sensors.with_clouds = True
        node.says("integrated the first scan")
        report = node.end()
        self.assertEqual((1, 0), (report["state"]["map_epoch"], report["mapping"]["clears"]))
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at(OTHER_WALL))

    def test_a_lost_state_overwrites_nothing(self):
        sensors = self.killed()
        (journal,) = self.journals()
        before = journal.read_bytes()
        (self.folder / "state/robot_0.state").unlink()
        node = self.started_again(sensors, "which the robot's state does not know of")
        report = node.end()
        self.assertEqual((1, 0), (report["state"]["map_epoch"], report["state"]["resumed_blocks"]))
        self.assertEqual(before, journal.with_name(journal.name + ".earlier").read_bytes())

    def test_what_cannot_be_continued_stays_where_it_is(self):
        sensors = self.killed()
        (journal,) = self.journals()
        before = journal.read_bytes()
        node = self.started_again(sensors, "begins with an empty map", map={"resolution_m": 0.4})
        report = node.end()
        self.assertEqual((2, 0), (report["state"]["map_epoch"], report["state"]["resumed_blocks"]))
        self.assertEqual(before, journal.read_bytes())
        self.assertIn(journal.name, report["mapping"]["kept_maps"][0])
        # An empty map, as was asked for.
        report = self.started_again(sensors, "the earlier map is kept as", robot={"restart": "empty"}).end()
        self.assertNotIn("state", report)

    def test_what_does_not_go_together(self):
        self.folder.joinpath("node.toml").write_text('[robot]\nid = 1\nstate = "state"\nrestart = "continue"\n[replay]\ndataset = "street"\n')
        self.refused("node", "--config", "node.toml", saying=("restart", "[sensors]"))


if __name__ == "__main__":
    unittest.main()
