# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""map that is interrupted by Ctrl+C or SIGTERM: it writes what it has and says so; a second signal ends it at once."""
import json
import os
import signal
import subprocess
import time
import unittest

import kitti_folder as kitti
from command_case import FAILURE, TIME_LIMIT_S, CommandCase, command_path

SCANS = 150
MEMORY = ("--memory", "256M")
SMALL = ("--memory", "36M")


class Interrupt(CommandCase):
    def setUp(self):
        super().setUp()
        # Points all around, so that a scan takes long enough to be interrupted in the middle of the run.
        scan = kitti.scattered_scan(1, count=20000)
        self.data = kitti.write_dataset(self.folder / "data", [scan])
        for kind, ending in (("velodyne", "bin"), ("predictions", "label"), ("labels", "label")):
            for i in range(1, SCANS):
                os.link(self.data / kind / f"000000.{ending}", self.data / kind / f"{i:06d}.{ending}")
        kitti.write_poses(self.data, [kitti.moved(1.0 * i) for i in range(SCANS)])

    def start(self, *options, memory=MEMORY):
        return subprocess.Popen([command_path(), "map", "--dataset", str(self.data), "--out", "map.tsm", "--report", "map.json", *memory,
                                 *options], cwd=self.folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def interrupted(self, by, *options, memory=MEMORY, left="map.tsm", at=10):
        """The scans that were mapped when the signal came, and the report. left: what one can go on from."""
        process = self.start(*options, memory=memory)
        for percent in range(10, at + 1, 10):
            self.assertIn(f"mapping: {percent} %", process.stderr.readline())
        process.send_signal(by)
        _, error = process.communicate(timeout=TIME_LIMIT_S)
        self.assertEqual(FAILURE, process.returncode, error)
        report = json.loads((self.folder / "map.json").read_text())
        mapped = len(report["scans"])
        self.assertIs(True, report["interrupted"])
        self.assertTrue(0 < mapped < SCANS, mapped)
        self.assertIn(f"tessera: interrupted after scan {mapped} of {SCANS}: ", error)
        self.assertIn(f"continue with --continue {left} --first {mapped}", error)
        return mapped, report

    def test_what_was_mapped_is_written(self):
        for by in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(by):
                mapped, report = self.interrupted(by)
                _, whole = self.map_dataset(self.data, "first.tsm", "--last", mapped - 1, *MEMORY)
                self.assertIs(False, whole["interrupted"])
                self.assertEqual(whole["digest"], report["digest"])
                self.assertEqual((self.folder / "first.tsm").read_bytes(), (self.folder / "map.tsm").read_bytes())

    def test_with_an_archive_too_and_one_can_go_on(self):
        options = ("--window", 9, "--archive", "spill", "--max-range", 8)
        mapped, report = self.interrupted(signal.SIGINT, *map(str, options))
        self.assertGreater(report["window"]["evicted"], 0)
        _, rest = self.map_dataset(self.data, "map.tsm", *options, "--continue", "map.tsm", "--first", mapped, *MEMORY)
        _, whole = self.map_dataset(self.data, "whole.tsm", "--max-range", 8, *MEMORY)
        self.assertEqual(whole["digest"], rest["digest"])

    def test_what_went_to_an_archive_beside_the_output_is_there_to_go_on_from(self):
        reach = ("--max-range", 8)
        archive = "map.tsm.archive/blocks.tsa"
        mapped, report = self.interrupted(signal.SIGINT, *map(str, reach), memory=SMALL, left=archive, at=50)
        self.assertGreater(report["window"]["evicted"], 0)
        _, rest = self.map_dataset(self.data, "map.tsm", *reach, "--continue", archive, "--first", mapped, *SMALL)
        self.assertFalse((self.folder / archive).exists())
        _, whole = self.map_dataset(self.data, "whole.tsm", *reach, *MEMORY)
        self.assertEqual(whole["digest"], rest["digest"])

    def test_a_second_signal_ends_it_at_once_and_leaves_what_there_was(self):
        (self.folder / "map.tsm").write_text("an earlier map")
        # Scans that take so long that the second signal comes before the first one is looked at.
        process = self.start("--resolution", "0.02", "--last", "19")
        self.assertIn("mapping: 10 %", process.stderr.readline())
        process.send_signal(signal.SIGTERM)
        time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=TIME_LIMIT_S)
        self.assertEqual(-signal.SIGINT, process.returncode)
        self.assertEqual("an earlier map", (self.folder / "map.tsm").read_text())
        self.assertFalse((self.folder / "map.json").exists())


if __name__ == "__main__":
    unittest.main()
