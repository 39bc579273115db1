# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a node when its memory, another robot or a thread of its own fails, and when it is killed: rows of
docs/reference/operations.md."""
import contextlib
import ctypes
import json
import math
import os
import pathlib
import random
import signal
import socket
import struct
import sys
import tempfile
import threading
import time
import unittest

import own_network
from fault_case import Faults
from running_node import LIMIT_S, until
from sensor_sender import GROUP, WALL_CLASS

own_network.enter_or_skip()

SEIZE, INTERRUPT, DETACH = 0x4206, 0x4207, 17


def all_around(count):
    """Points in all directions, 8 to 19 m away: their rays go through as many blocks as can be."""
    points = []
    for i in range(count):
        z, angle, length = 2.0 * (i + 0.5) / count - 1.0, 2.399963 * i, 8.0 + 11.0 * (i % 7) / 7
        around = math.sqrt(1.0 - z * z)
        points.append((length * around * math.cos(angle), length * around * math.sin(angle), length * z))
    return points


class OwnFaults(Faults):
    def test_the_map_s_memory_is_full(self):
        sensors = self.sensors()
        sensors.points = all_around(1800)
        # Too little for the whole of a scan too.
        node = self.node(map={"resolution_m": 0.05, "memory": "2M", "carving": "rays", "downsample_m": "off"})
        node.says("memory is full")
        before = node.here()
        node.says("memory is full", before)
        report = node.end()
        scans = report["scans"]
        self.assertGreater(min(scans["over_capacity"], scans["refused_memory"]), 0)
        self.assertEqual(scans["over_capacity"] + scans["refused_memory"] + scans["rays_refused_memory"], report["mapping"]["refused_memory"])
        self.assertEqual(scans["over_capacity"], report["mapping"]["over_capacity"])
        self.assertGreater(scans["left_out"], 0)
        self.assertLessEqual(report["memory"]["used_bytes"], report["memory"]["budget_bytes"])
        self.done("info", "node.tsm")

    def test_the_global_map_s_memory_is_full(self):
        """Of one of two; the other has all."""
        sensors = self.sensors()
        sensors.points = all_around(3000)
        settings = {"map": {"resolution_m": 0.1, "memory": "40M"}, "output": {"global_map": None}}
        small = self.node("small", 0, fusion={"memory": "23M"}, **settings)
        large = self.node("large", 1, **settings)
        small.says("exchange records_refused")
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
        node.process.send_signal(signal.SIGCONT)
        time.sleep(1)
        report = node.end()
        # What waited for it in the socket was too old.
        self.assertGreater(report["sensors"]["poses_refused"] + report["sensors"]["match"]["ancient"], 0)
        self.assertGreaterEqual(report["ticks"]["overruns"], 1)
        self.assertGreaterEqual(report["ticks"]["worst_late_ms"], 1000)
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1)))

    def test_sensors_whose_scans_are_left_out_are_not_silent(self):
        node, sensors = self.mapping(run={"silence_s": 2, "quiet_s": 0.5})
        place = node.here()
        sensors.with_poses = False
        node.says("poses are stale", place)
        time.sleep(4)
        self.assertIsNone(node.process.poll(), node.said)
        sensors.with_clouds = False
        node.process.wait(timeout=LIMIT_S)
        self.assertEqual("quiet", json.loads(node.report_path.read_text())["ended_by"])

    def test_what_is_lost_on_the_way_is_in_the_report(self):
        node, sensors = self.mapping(service={"queries": True})
        # A long message's first part, of two.
        head = struct.pack(">IIIIHH", 0x4C433033, 1_000_000, 2000, 0, 0, 2)
        sensors.socket.sendto(head + b"TESSERA_CLOUD\0" + bytes(1000), GROUP)
        time.sleep(0.5)
        report = node.end()
        sensing, match, queries = report["sensors"], report["sensors"]["match"], report["queries"]
        fragments = sensing["fragments"]
        self.assertEqual((1, 0), (fragments.pop("taken"), fragments.pop("messages")))
        self.assertEqual({"malformed", "too_large", "inconsistent", "duplicates", "torn", "timed_out", "superseded", "evicted"}, set(fragments))
        self.assertEqual({0}, set(fragments.values()))
        # Those that the guard refused at the start.
        self.assertGreater(sensing["poses_filtered"], 0)
        self.assertEqual(sensing["poses_refused"], sensing["poses_filtered"])
        self.assertEqual((0, 0), (sensing["poses_queue_full"], sum(sensing["by_fault"])))
        for end in ("dropped_by_step", "unknown_camera", "images_future", "images_ancient", "poses_future", "poses_ancient", "poses_not_rigid"):
            self.assertEqual(0, match[end], end)
        self.assertEqual((0, 0), (queries["queue_full"], queries["work"]))


class Service(Faults):
    """As a service manager would start it."""

    def setUp(self):
        super().setUp()
        self.manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        folder = self.closing.enter_context(tempfile.TemporaryDirectory(prefix="tessera-n-"))
        self.address = f"{folder}/notify"
        self.manager.bind(self.address)
        self.manager.settimeout(0.1)
        self.heard, self.stopping = [], False
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        self.closing.callback(self.stop)

    def read(self):
        while not self.stopping:
            with contextlib.suppress(TimeoutError):
                self.heard.append(self.manager.recv(4096).decode())

    def stop(self):
        self.stopping = True
        self.reader.join(10)
        self.manager.close()

    def told(self, words, since=0):
        until(lambda: words in self.heard[since:], f"the service manager is not told {words}")

    def is_silent(self):
        time.sleep(0.2)
        before = len(self.heard)
        time.sleep(1.5)
        return len(self.heard) == before

    def served(self, **changes):
        sensors = self.sensors()
        node = self.node(environment={"NOTIFY_SOCKET": self.address}, **changes)
        self.told("READY=1")
        return node, sensors

    def test_a_service_manager_is_told_and_sigterm_saves_the_map(self):
        node, _ = self.served()
        self.told("WATCHDOG=1")
        node.says("integrated the first scan")
        time.sleep(0.5)
        begin = time.monotonic()
        report = node.end()
        print(f"ended {time.monotonic() - begin:.2f} s after SIGTERM, saving took {report['realtime']['save_ms']:.0f} ms", file=sys.stderr)
        self.told("STOPPING=1")
        self.assertEqual("signal", report["ended_by"])
        self.assertEqual([("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1)))

    @contextlib.contextmanager
    def held(self, node, name):
        """A thread of the node stands still."""
        thread = next(int(task.name) for task in pathlib.Path(f"/proc/{node.process.pid}/task").iterdir()
                      if (task / "comm").read_text().strip() == name)
        libc = ctypes.CDLL(None, use_errno=True)
        for request in (SEIZE, INTERRUPT):
            if libc.ptrace(ctypes.c_long(request), ctypes.c_long(thread), None, None) != 0:
                self.skipTest(f"skipped: no thread can be held here: {os.strerror(ctypes.get_errno())}")
        yield
        os.waitpid(thread, 0x40000000)  # __WALL
        self.assertEqual(0, libc.ptrace(ctypes.c_long(DETACH), ctypes.c_long(thread), None, None))

    def test_a_thread_that_hangs_is_told_by_silence(self):
        node, _ = self.served()
        place = node.says("integrated the first scan")
        names = {"tessera-map": "mapping", "tessera-sense": "sensing", "tessera-share": "sharing"}
        for name, called in names.items():
            with self.held(node, name):
                place = node.says("does not respond", place)
                self.assertTrue(self.is_silent(), name)
            self.assertTrue(node.said[:place].endswith(f"the {called} thread does not respond"), node.said)
            self.told("WATCHDOG=1", since=len(self.heard))
        report = node.end()
        self.assertEqual(len(names), report["realtime"]["silences"])

    def test_a_long_period_is_no_silence(self):
        node, sensors = self.served(mapping={"period_ms": 5000})
        node.says("integrated the first scan")
        sensors.with_clouds = False
        time.sleep(4)
        self.told("WATCHDOG=1", since=len(self.heard))
        self.assertNotIn("does not respond", node.said)
        self.assertEqual(0, node.end()["realtime"]["silences"])


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
            second.says("integrated the first scan")
            # In the middle of a save, or before it or behind it.
            for _ in range(4):
                second.process.send_signal(signal.SIGUSR1)
                time.sleep(chance.uniform(0.0, 0.12))
            second.kill()
            state = (self.folder / "state/robot_1.state").read_text()
            self.assertIn(f"\nepoch {epoch}\n", state)
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
