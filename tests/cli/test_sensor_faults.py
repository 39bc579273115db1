# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a node when its sensors, their poses or their stamps fail: the rows of docs/reference/operations.md that need no
CAN bus."""
import re
import time
import unittest

import own_network
from fault_case import Faults
from sensor_sender import WALL_CLASS

own_network.enter_or_skip()

IMAGE = (64, 48)
CAMERAS = f"""[[camera]]
name = "front"
model = "pinhole"
width = {IMAGE[0]}
height = {IMAGE[1]}
focal = [32, 32]
centre = [32, 24]
T_camera_lidar = [0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0]
"""


class SensorFaults(Faults):
    def test_a_silent_sensor(self):
        node, sensors = self.mapping()
        sensors.with_clouds = False
        place = node.says("no scan for ")
        sensors.with_clouds = True
        node.says("scans arrive again", place)
        report = node.end()
        self.assertEqual(1, report["sensors"]["silences"])
        self.check_scans(report, sensors)

    def test_where_messages_went_that_became_no_scan(self):
        # Clouds of a sensor that is not configured, and clouds of more points than there is room for.
        for changes, words in (({"lidar": 1}, "of sensors that are not configured: "), ({"points": 1000}, "unreadable messages so far: ")):
            with self.subTest(words):
                sensors = self.sensors()
                node = self.node(sensors=changes)
                place = node.says("no scan for ")
                place = node.says(words, place)
                self.assertGreater(int(re.match(r"\d+", node.said[place:])[0]), 0)
                self.assertEqual(0, node.end()["sensors"]["match"]["given"])
                sensors.close()

    def test_a_burst_and_the_newest_wins(self):
        node, sensors = self.mapping()
        sensors.with_clouds = False
        time.sleep(0.3)
        place = node.here()
        now_us = sensors.stamp_us()
        newest = [(3.1, 0.05 + 0.1 * i, 0.05 + 0.1 * k) for i in range(8) for k in range(8)]
        for i in range(50):
            sensors.send_cloud(now_us - 1000 * (50 - i), points=[(x, y - 2.0, z) for x, y, z in newest])
        sensors.send_cloud(now_us, points=newest, component=WALL_CLASS + 1)
        node.says("more scans than can be mapped", place)
        time.sleep(0.3)
        report = node.end()
        match = report["sensors"]["match"]
        # How many depends on how fast they are sent and mapped.
        self.assertGreater(match["superseded"], 0)
        self.check_scans(report, sensors)
        self.assertEqual([("occupied", WALL_CLASS + 1)], self.states_at((3.1, 0.3, 0.3)))

    def test_a_camera_that_is_missing(self):
        (self.folder / "cameras.toml").write_text(CAMERAS)
        sensors = self.sensors()
        sensors.component = None
        node = self.node(sensors={"clouds": "raw", "cameras": "cameras.toml"})
        node.says("a scan without images")
        sensors.image = IMAGE
        time.sleep(1)
        report = node.end()
        match, registration = report["sensors"]["match"], report["sensors"]["registration"]
        self.assertGreater(match["unlabelled"], 0)
        self.assertGreater(match["images"], 0)
        self.assertGreater(registration["labelled"], 0)
        self.assertGreaterEqual(report["mapping"]["cycles"], match["given"] - report["mapping"]["paused"])
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1)))

    def test_a_camera_that_must_not_be_missing(self):
        (self.folder / "cameras.toml").write_text(CAMERAS)
        sensors = self.sensors()
        sensors.component = None
        node = self.node(sensors={"clouds": "raw", "cameras": "cameras.toml", "missing_images": "drop"})
        node.says("a scan without images")
        node.says("no scan for ")
        report = node.end()
        self.assertEqual(0, report["mapping"]["cycles"])
        self.assertGreater(report["sensors"]["match"]["without_images"], 0)

    def test_bad_poses_over_lcm(self):
        node, sensors = self.mapping()

        def fault(words, **what):
            with self.subTest(words):
                before = {key: getattr(sensors, key) for key in what}
                place = node.here()
                for key, value in what.items():
                    setattr(sensors, key, value)
                place = node.says(words, place)
                for key, value in before.items():
                    setattr(sensors, key, value)
                node.says("poses are good", place)

        fault("poses are stale", with_poses=False)
        fault("poses are uncertain", sigma_m=1.0)
        fault("poses are corrupt", position=[2e5, 0.0, 0.0])
        # Not a rotation, and not a number: refused before anybody looks at the pose.
        fault("poses are stale", rotation=(2.0, 0.0, 0.0, 0.0))
        fault("poses are stale", rotation=(float("nan"), 0.0, 0.0, 0.0))
        report = node.end()
        self.assertGreater(report["sensors"]["malformed"], 0)
        self.assertEqual(0, report["sensors"]["relocations"])
        self.assertEqual([("occupied", WALL_CLASS), ("free", 0)], self.states_at((5.1, 0.1, 0.1), (3.1, 0.1, 0.1)))

    def test_poses_of_another_frame_begin_another_map(self):
        node, sensors = self.mapping()
        time.sleep(0.5)  # So that something is mapped.
        sensors.position = [50.0, 0.0, 0.0]
        node.says("poses are of another frame")
        time.sleep(0.5)
        report = node.end()
        self.assertEqual((1, 1), (report["sensors"]["relocations"], report["mapping"]["clears"]))
        self.assertEqual([("unknown", 0), ("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1), (55.1, 0.1, 0.1)))
        # What was mapped before is not lost.
        self.assertEqual((["node.epoch-1.tsm"], 0), (self.kept(report), report["mapping"]["failed_keeps"]))
        self.assertIn("the earlier map is kept as", node.said)
        self.assertEqual([("occupied", WALL_CLASS), ("unknown", 0)],
                         self.states_at((5.1, 0.1, 0.1), (55.1, 0.1, 0.1), file="node.epoch-1.tsm"))

    def kept(self, report):
        return [path.rsplit("/", 1)[-1] for path in report["mapping"]["kept_maps"]]

    def test_each_of_several_maps_of_a_start_is_kept(self):
        node, sensors = self.mapping()
        time.sleep(0.5)  # So that something is mapped.
        for x_m in (50.0, 100.0):
            place = node.here()
            sensors.position = [x_m, 0.0, 0.0]
            place = node.says("the earlier map is kept as", place)
            node.says("poses are good", place)
            time.sleep(0.5)
        report = node.end()
        self.assertEqual(["node.epoch-1.tsm", "node.epoch-1.2.tsm"], self.kept(report))
        walls = [(x_m + 5.1, 0.1, 0.1) for x_m in (0.0, 50.0, 100.0)]
        for file, seen in (("node.epoch-1.tsm", 0), ("node.epoch-1.2.tsm", 1), ("node.tsm", 2)):
            with self.subTest(file):
                states = self.states_at(*walls, file=file)
                self.assertEqual([seen], [i for i, state in enumerate(states) if state == ("occupied", WALL_CLASS)])

    def test_without_a_local_map_it_is_kept_in_the_state_s_folder(self):
        node, sensors = self.mapping(output={"local_map": None})
        time.sleep(0.5)  # So that something is mapped.
        sensors.position = [50.0, 0.0, 0.0]
        node.says("the earlier map is kept as")
        self.assertEqual(["robot_0.epoch-1.tsm"], self.kept(node.end()))
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1), file="state/robot_0.epoch-1.tsm"))

    def test_a_map_that_cannot_be_kept_is_not_cleared(self):
        node, sensors = self.mapping(output={"local_map": "maps/node.tsm"}, before=lambda: (self.folder / "maps").mkdir())
        time.sleep(0.5)  # So that something is mapped.
        (self.folder / "maps").rename(self.folder / "elsewhere")
        sensors.position = [50.0, 0.0, 0.0]
        node.says("the map is not cleared, and mapping is paused")
        (self.folder / "elsewhere").rename(self.folder / "maps")
        node.says("the earlier map is kept as")
        report = node.end()
        self.assertEqual((["node.epoch-1.tsm"], 1), (self.kept(report), report["mapping"]["clears"]))
        self.assertGreater(report["mapping"]["failed_keeps"], 0)
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1), file="maps/node.epoch-1.tsm"))

    def test_maps_are_not_kept_where_that_is_not_wanted(self):
        node, sensors = self.mapping(output={"keep_maps": False})
        sensors.position = [50.0, 0.0, 0.0]
        node.says("poses are of another frame")
        time.sleep(0.5)
        report = node.end()
        self.assertEqual(([], 1), (self.kept(report), report["mapping"]["clears"]))
        self.assertEqual([], list(self.folder.glob("*epoch*")))

    def test_poses_that_come_too_seldom_are_named_with_what_is_needed(self):
        self.sensors(pose_every=10)
        node = self.node()
        place = node.says("poses come every 2")
        node.says("ms; at most 100 ms are allowed", place)
        # While it lasts.
        place = node.says("no scan for ", place)
        node.says("no scan for ", place)
        self.assertEqual(1, node.end()["sensors"]["silences"])

    def test_an_odometry_of_5_hz_with_the_keys_set(self):
        self.sensors(pose_every=10)
        node = self.node(sensors={"max_wait_ms": 400, "max_pose_gap_ms": 500}, vehicle={"pose_timeout_ms": 600})
        node.says("poses are good")
        time.sleep(2)
        report = node.end()
        self.assertGreater(report["mapping"]["cycles"], 5)
        self.assertNotIn("poses come every", node.said)
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1)))

    def test_a_jump_to_the_side_at_the_rate_of_the_scans(self):
        """At 8 m/s and 10 Hz: a step that the speed alone would allow."""
        sensors = self.sensors(pose_every=5)
        start = time.monotonic()
        sensors.x_m = lambda: 8.0 * (time.monotonic() - start)
        sensors.moves = True
        node = self.node(sensors={"max_wait_ms": 300})
        node.says("integrated the first scan")
        time.sleep(1)
        sensors.position = [0.0, 1.0, 0.0]
        node.says("poses are of another frame")
        place = node.says("the earlier map is kept as")
        node.says("poses are good", place)
        report = node.end()
        self.assertEqual((1, 1), (report["sensors"]["relocations"], report["mapping"]["clears"]))

    def test_no_scan_lies_half_way_between_two_frames(self):
        node, sensors = self.mapping()
        # At 200 Hz the last pose that was used and the first of the other frame are near enough to interpolate between.
        sensors.with_poses = False
        for cycle in range(500):
            if cycle == 200:
                sensors.position = [50.0, 0.0, 0.0]
            sensors.send_pose()
            time.sleep(0.005)
        report = node.end()
        self.assertEqual((1, 1), (report["sensors"]["relocations"], report["mapping"]["clears"]))
        between = self.states_at(*[(4.1 + 0.2 * i, 0.1, 0.1) for i in range(240)])
        self.assertNotIn("occupied", {state for state, _ in between})
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((55.1, 0.1, 0.1)))

    def test_stamps_that_step(self):
        """The clock of who sends, not that of the machine: docs/reference/operations.md names the test of that one."""
        node, sensors = self.mapping(sensors={"clock": "monotonic"})
        for offset_s, words in ((100.0, "poses are corrupt"), (-100.0, "poses are stale")):
            place = node.here()
            sensors.offset_s = offset_s
            place = node.says(words, place)
            time.sleep(0.3)  # Clouds too.
            sensors.offset_s = 0.0
            node.says("poses are good", place)
        report = node.end()
        match = report["sensors"]["match"]
        self.assertGreater(match["future"], 0)
        self.assertGreater(match["ancient"], 0)
        self.assertEqual(0, match["clock_steps"])
        self.check_scans(report, sensors)
        self.assertEqual(0, report["sensors"]["relocations"])


if __name__ == "__main__":
    unittest.main()
