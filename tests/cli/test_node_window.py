# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera node with [map] window_m and archive: the map that it saves is the one without a window."""
import json
import os
import pathlib
import signal
import subprocess
import time
import unittest

import kitti_folder as kitti
import own_network
from command_case import DONE, TIME_LIMIT_S, command_path
from node_case import NodeCase

own_network.enter_or_skip()

THERE_AND_BACK = [*range(0, 60, 4), *range(60, 0, -6), 200, 3, 7]
WINDOW = {"window_m": 10, "archive": "spill"}
ROOT = pathlib.Path(os.environ.get("TESSERA_DATA", pathlib.Path(__file__).resolve().parents[3] / "shared" / "data"))
DRIVE = ROOT / "kitti_raw_0013"


class NodeWindow(NodeCase):
    def setUp(self):
        super().setUp()
        self.data = kitti.write_dataset(
            self.folder / "data", [kitti.corner_scan(i, pose=kitti.moved(x)) for i, x in enumerate(THERE_AND_BACK)])
        self.archive = self.folder / "spill" / "blocks.tsa"

    def alone(self, **changes):
        """The configuration of a robot that is alone."""
        tables = {"replay": {"dataset": str(self.data)}, "map": {"memory": "40M", "max_range_m": 40.0, "resolution_m": 0.1},
                  "output": {"local_map": "local.tsm", "global_map": None, "contribution": None},
                  "run": {"wait_for_peers": 0, "quiet_s": 0.5}}
        for table, keys in changes.items():
            tables[table] = {**tables.get(table, {}), **keys}
        return self.config(0, **tables)

    def start(self, config):
        return subprocess.Popen([command_path(), "node", "--config", str(config)], cwd=self.folder, text=True,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def finished(self, process):
        _, error = process.communicate(timeout=TIME_LIMIT_S)
        self.assertEqual(DONE, process.returncode, error)
        return json.loads((self.folder / "robot_0.json").read_text())

    def run_node(self, **changes):
        return self.finished(self.start(self.alone(**changes)))

    def digest(self, map_file):
        self.done("info", map_file, "--report", "info.json")
        return json.loads((self.folder / "info.json").read_text())["digest"]

    def assert_same_map(self, whole, bounded):
        self.assertEqual(whole["local_digest"], bounded["local_digest"])
        self.assertEqual(whole["local_digest"], self.digest("local.tsm"))
        self.assertEqual(0, bounded["scans"]["left_out"])
        for none in ("lost_blocks", "reloads_failed"):
            self.assertEqual(0, bounded["window"][none], none)
        self.assertEqual(0, bounded["heap_allocations_after_start"] or 0)
        self.assertLessEqual(bounded["memory"]["used_bytes"], bounded["memory"]["budget_bytes"])

    def test_the_saved_map_is_that_of_the_command_and_the_archive_goes_with_the_run(self):
        _, whole = self.map_dataset(self.data, self.folder / "whole.tsm", "--resolution", 0.1)
        bounded = self.run_node(map=WINDOW, replay={"rate_hz": 30}, run={"tick_ms": 10})
        self.assert_same_map({"local_digest": whole["digest"]}, bounded)
        window = bounded["window"]
        self.assertEqual(10, window["radius_m"])
        self.assertGreater(window["evicted"], 300)
        self.assertGreater(window["reloaded"], 100)
        self.assertGreater(window["archived_blocks"], 0)
        self.assertGreater(window["archive_bytes"], 10_000)
        self.assertFalse(self.archive.exists())

    def test_where_the_window_has_more_than_memory_holds_the_node_waits_and_loses_nothing(self):
        # By evidence alone: votes are away with the blocks that have left.
        mode = {"carving": "rays", "inference": "multi-entropy"}
        _, whole = self.map_dataset(self.data, self.folder / "whole.tsm", "--resolution", 0.1, *(f"--{key}={value}" for key, value in mode.items()))
        bounded = self.run_node(map={**WINDOW, "window_m": 300, "memory": "4M", **mode})
        self.assert_same_map({"local_digest": whole["digest"]}, bounded)
        window = bounded["window"]
        self.assertGreater(window["near_evicted"], 300)
        self.assertGreater(window["reloaded"], 100)
        self.assertLess(window["reach_blocks"] * 0.8, 300)
        self.assertEqual(0, bounded["scans"]["refused_memory"])

    def test_with_a_rate_it_does_not_wait_and_says_what_has_left(self):
        process = self.start(self.alone(map={**WINDOW, "window_m": 300, "memory": "4M", "carving": "rays"}, replay={"rate_hz": 30}, run={"tick_ms": 10}))
        _, error = process.communicate(timeout=TIME_LIMIT_S)
        self.assertEqual(DONE, process.returncode, error)
        report = json.loads((self.folder / "robot_0.json").read_text())
        self.assertEqual(0, report["mapping"]["waited_ms"])
        self.assertGreater(report["window"]["near_evicted"], 100)
        self.assertLessEqual(report["window"]["most_evicted"], 2 * 1024)
        self.assertIn("within the window went to the archive", error)

    def test_an_archive_alone_has_the_window_that_scans_reach_within(self):
        report = self.run_node(map={"archive": "spill", "max_range_m": 8})
        self.assertEqual(8, report["window"]["radius_m"])

    def test_saved_while_it_runs_and_kept_after_a_crash(self):
        process = self.start(self.alone(map=WINDOW, replay={"rate_hz": 20, "loop": True}, run={"duration_s": 60}))
        saved = self.folder / "local.tsm"
        self.addCleanup(process.kill)
        for _ in range(400):
            if self.archive.exists() and self.archive.stat().st_size > 50_000:
                break
            time.sleep(0.02)
        process.send_signal(signal.SIGUSR1)
        for _ in range(400):
            if saved.exists():
                break
            time.sleep(0.02)
        self.digest("local.tsm")
        info = json.loads((self.folder / "info.json").read_text())
        self.assertGreater(info["blocks"], 300)
        process.kill()
        process.communicate()
        crashed = self.archive.read_bytes()
        report = self.run_node(map=WINDOW)
        kept = self.folder / "spill" / "blocks.earlier.tsa"
        self.assertIn(str(kept), report["mapping"]["kept_maps"])
        self.assertEqual(crashed, kept.read_bytes())

    def test_settings_that_do_not_go_together(self):
        for keys, saying in (({"window_m": 10}, ("window_m", "archive")),
                             ({"window_m": -5, "archive": "spill"}, ("window_m",)),
                             ({"archive": "spill", "max_range_m": 0}, ("archive", "window_m", "max_range_m")),
                             ({"archive": 3}, ("archive",))):
            with self.subTest(keys):
                self.refused("node", "--config", self.alone(map=keys), saying=saying)
        (self.folder / "file").write_text("")
        self.refused("node", "--config", self.alone(map={"archive": "file"}), saying=("file",))

    @unittest.skipUnless(DRIVE.is_dir(), "no kitti_raw_0013")
    def test_a_long_drive_in_64_mib(self):
        # There and back, with voxels of 0.1 m: bench/node_window.py.
        drive = {"dataset": str(DRIVE), "labels": "none"}
        settings = {"resolution_m": 0.2, "memory": "512M"}
        # What is shared is no part of this: it may end while others lack something.
        run = {"quiet_s": 0.5, "linger_s": 2}
        whole = self.run_node(replay=drive, map=settings, run=run)
        bounded = self.run_node(replay=drive, map={**settings, "memory": "64M", "window_m": 45, "archive": "spill"}, run=run)
        self.assert_same_map(whole, bounded)
        self.assertEqual(0, whole["scans"]["left_out"])


if __name__ == "__main__":
    unittest.main()
