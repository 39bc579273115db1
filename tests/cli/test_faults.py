# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a node when sensors, poses, the clock, memory, other robots or a thread of its own fail: the rows of
docs/operations.md that need no CAN bus."""
import contextlib
import ctypes
import os
import pathlib
import random
import re
import signal
import socket
import sys
import tempfile
import time
import unittest

import own_network

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "support"))
from running_node import RunningNode, sensing, until, write_config
from sensor_sender import WALL_CLASS, Sensors, wall

import command_case

if not own_network.enter():
    print("skipped: no network namespaces permitted here (unshare -rn)", file=sys.stderr)
    raise unittest.SkipTest("no network namespaces")

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
SEIZE, INTERRUPT, DETACH = 0x4206, 0x4207, 17


class Faults(command_case.CommandCase):
    def setUp(self):
        super().setUp()
        self.closing = contextlib.ExitStack()
        self.addCleanup(self.closing.close)

    def sensors(self, **options):
        sensors = Sensors(**options)
        self.closing.callback(sensors.close)
        return sensors

    def node(self, name="node", robot=0, environment=None, **changes):
        config = write_config(self.folder, name, sensing(name, robot), **changes)
        node = RunningNode(self.folder, config, environment=environment)
        self.closing.callback(node.close)
        return node

    def mapping(self, **changes):
        """A node that maps already, and its sensors."""
        sensors = self.sensors()
        node = self.node(**changes)
        node.says("mapping: goes on")
        return node, sensors

    def states_at(self, *points, file="node.tsm"):
        rows = self.query_rows(file, "x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in points))[1]
        return [(row["state"], int(row["label"])) for row in rows]

    def check_scans(self, report, sensors):
        """Each cloud that was sent is in one counter. Those before the node heard are in none."""
        match = report["sensors"]["match"]
        ends = ("given", "future", "ancient", "duplicates", "out_of_order", "without_pose", "without_images", "superseded")
        self.assertLessEqual(sum(match[end] for end in ends), sensors.clouds)
        self.assertLessEqual(report["mapping"]["cycles"] + report["mapping"]["paused"], match["given"])


class SensorFaults(Faults):
    def test_a_silent_sensor(self):
        node, sensors = self.mapping()
        sensors.with_clouds = False
        place = node.says("no scan for ")
        sensors.with_clouds = True
        node.says("scans come again", place)
        report = node.end()
        self.assertEqual(1, report["sensors"]["silences"])
        self.check_scans(report, sensors)

    def test_a_burst_and_the_newest_wins(self):
        node, sensors = self.mapping()
        sensors.with_clouds = False
        time.sleep(0.3)
        place = node.here()
        now_us = sensors.stamp_us()
        newest = [(3.1, 0.05 + 0.1 * i, 0.05 + 0.1 * k) for i in range(8) for k in range(8)]
        for i in range(50):
            sensors.send_cloud(now_us - 1000 * (50 - i))
        sensors.send_cloud(now_us, points=newest, component=WALL_CLASS + 1)
        node.says("more scans than can be mapped", place)
        time.sleep(0.3)
        report = node.end()
        match = report["sensors"]["match"]
        self.assertGreater(match["superseded"], 20)
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

    def test_poses_of_another_frame_are_not_mapped_with(self):
        node, sensors = self.mapping()
        sensors.position = [50.0, 0.0, 0.0]
        node.says("poses are of another frame")
        time.sleep(0.5)
        report = node.end()
        self.assertEqual(1, report["sensors"]["relocations"])
        self.assertGreater(report["mapping"]["paused"], 0)
        self.assertEqual([("occupied", WALL_CLASS), ("unknown", 0)], self.states_at((5.1, 0.1, 0.1), (55.1, 0.1, 0.1)))

    def test_stamps_that_step(self):
        """The clock of who sends, not that of the machine: docs/operations.md names the test of that one."""
        node, sensors = self.mapping(sensors={"clock": "monotonic"})
        for offset_s, words in ((100.0, "poses are corrupt"), (-100.0, "poses are stale")):
            place = node.here()
            sensors.offset_s = offset_s
            place = node.says(words, place)
            sensors.offset_s = 0.0
            node.says("poses are good", place)
        report = node.end()
        match = report["sensors"]["match"]
        self.assertGreater(match["future"], 0)
        self.assertGreater(match["ancient"], 0)
        self.assertEqual(0, match["clock_steps"])
        self.check_scans(report, sensors)
        self.assertEqual(0, report["sensors"]["relocations"])


class OwnFaults(Faults):
    def test_the_map_s_memory_is_full(self):
        sensors = self.sensors()
        sensors.points = wall() + [(8.0 + 0.2 * (i % 40), -4.0 + 0.2 * (i // 40), 1.0) for i in range(1600)]
        node = self.node(map={"resolution_m": 0.05, "memory": "3M", "downsample_m": "off"})
        node.says("the map's memory is full")
        before = node.here()
        node.says("the map's memory is full", before)
        report = node.end()
        self.assertGreater(report["mapping"]["refused_memory"], 0)
        self.assertGreater(report["scans"]["left_out"], 0)
        self.assertLessEqual(report["memory"]["used_bytes"], report["memory"]["budget_bytes"])
        self.done("info", "node.tsm")

    def test_the_global_map_s_memory_is_full(self):
        """Of one of two; the other has all."""
        sensors = self.sensors()
        sensors.points = [(3.0 + 0.25 * (i % 50), -6.0 + 0.25 * (i // 50), 0.1) for i in range(2400)]
        settings = {"map": {"resolution_m": 0.1, "memory": "24M"}, "output": {"global_map": None}}
        small = self.node("small", 0, fusion={"memory": "2M"}, **settings)
        large = self.node("large", 1, **settings)
        small.says("records of other robots refused")
        time.sleep(1)
        reports = [node.end() for node in (small, large)]
        self.assertGreater(reports[0]["global_map"]["refused_replicas"] + reports[0]["global_map"]["refused_blocks"], 0)
        self.assertLessEqual(reports[0]["memory"]["used_bytes"], reports[0]["memory"]["budget_bytes"])
        self.assertGreater(reports[0]["mapping"]["cycles"], 0)
        self.assertEqual(0, reports[1]["exchange"]["records_refused"])

    def test_a_process_that_was_stopped_for_three_seconds(self):
        node, _ = self.mapping()
        node.process.send_signal(signal.SIGSTOP)
        time.sleep(3)
        place = node.here()
        node.process.send_signal(signal.SIGCONT)
        node.says("poses are stale", place)
        node.says("poses are good", place)
        time.sleep(0.5)
        report = node.end()
        self.assertGreaterEqual(report["ticks"]["overruns"], 1)
        self.assertGreaterEqual(report["ticks"]["worst_late_ms"], 1000)
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1)))


class Service(Faults):
    """As a service manager would start it."""

    def setUp(self):
        super().setUp()
        self.manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.closing.callback(self.manager.close)
        folder = self.closing.enter_context(tempfile.TemporaryDirectory(prefix="tessera-n-"))
        self.address = f"{folder}/notify"
        self.manager.bind(self.address)
        self.manager.settimeout(0.5)

    def told(self, words, limit_s=30):
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            with contextlib.suppress(TimeoutError):
                if self.manager.recv(4096).decode() == words:
                    return
        self.fail(f"the service manager is not told {words}")

    def is_silent(self):
        """Nothing more comes after what waits."""
        for _ in range(10_000):
            try:
                self.manager.recv(4096)
            except TimeoutError:
                return True
        return False

    def served(self, **changes):
        sensors = self.sensors()
        node = self.node(environment={"NOTIFY_SOCKET": self.address}, **changes)
        self.told("READY=1")
        return node, sensors

    def test_a_service_manager_is_told_and_sigterm_saves_the_map(self):
        node, _ = self.served()
        self.told("WATCHDOG=1")
        node.says("mapping: goes on")
        time.sleep(0.5)
        begin = time.monotonic()
        report = node.end()
        print(f"ended {time.monotonic() - begin:.2f} s after SIGTERM, saving took {report['realtime']['save_ms']:.0f} ms", file=sys.stderr)
        self.told("STOPPING=1")
        self.assertEqual("signal", report["ended_by"])
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1)))

    def test_a_thread_that_hangs_is_told_by_silence(self):
        node, _ = self.served()
        node.says("mapping: goes on")
        thread = next(task for task in pathlib.Path(f"/proc/{node.process.pid}/task").iterdir()
                      if (task / "comm").read_text().strip() == "tessera-map")
        libc = ctypes.CDLL(None, use_errno=True)
        for request in (SEIZE, INTERRUPT):
            if libc.ptrace(ctypes.c_long(request), ctypes.c_long(int(thread.name)), None, None) != 0:
                self.skipTest(f"skipped: no thread can be held here: {os.strerror(ctypes.get_errno())}")
        node.says("the mapping thread gives no sign of life")
        self.assertTrue(self.is_silent())
        os.waitpid(int(thread.name), 0x40000000)  # __WALL
        self.assertEqual(0, libc.ptrace(ctypes.c_long(DETACH), ctypes.c_long(int(thread.name)), None, None))
        self.told("WATCHDOG=1")
        report = node.end()
        self.assertEqual(1, report["realtime"]["silences"])


class Team(Faults):
    def digests(self, nodes, sensors):
        """Of all in the end, once nothing is new."""
        sensors.with_clouds = False
        time.sleep(2.5)
        reports = [node.end() for node in nodes]
        for report in reports:
            self.assertEqual([], [one for one in report["contributions"] if not one["complete"]])
        return reports

    def test_a_robot_that_is_gone_and_comes_back(self):
        sensors = self.sensors()
        first, second = self.node("first", 0), self.node("second", 1)
        place = first.says("robots in reach: 1")
        time.sleep(1)
        second.kill()
        place = first.says("robots in reach: 0", place)
        self.assertIsNone(first.process.poll())
        again = self.node("second", 1)
        first.says("robots in reach: 1", place)
        time.sleep(1)
        reports = self.digests((first, again), sensors)
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])
        self.assertEqual(2, reports[1]["epoch"])
        # What it had published before it was killed came back to it.
        self.assertEqual([(0, 1), (1, 1), (1, 2)], sorted((one["robot"], one["epoch"]) for one in reports[1]["contributions"]))

    def test_killed_at_any_moment_and_started_again(self):
        chance = random.Random(20)
        sensors = self.sensors()
        first = self.node("first", 0)
        for epoch in range(1, 6):
            second = self.node("second", 1)
            second.says("mapping: goes on")
            # In the middle of a save, or before it or behind it.
            for _ in range(4):
                second.process.send_signal(signal.SIGUSR1)
                time.sleep(chance.uniform(0.0, 0.12))
            second.kill()
            starts = (self.folder / "state/robot_1.starts").read_text()
            self.assertIn(str(epoch), starts)
            if (self.folder / "second.tsm").exists():
                self.done("info", "second.tsm")
        self.assertTrue((self.folder / "second.tsm").exists(), "nothing was ever saved")
        for left in self.folder.glob("*.part"):  # Of a process that had no time to take it away.
            left.unlink()
        last = self.node("second", 1)
        last.says("robots in reach: 1")
        time.sleep(1)
        reports = self.digests((first, last), sensors)
        self.assertEqual(6, reports[1]["epoch"])
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1), file="second.tsm"))


if __name__ == "__main__":
    unittest.main()
