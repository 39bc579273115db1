# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""map --window and --archive: the map that comes out is the one without a window, whatever the robot drives."""
import json
import os
import re
import resource
import subprocess
import unittest

import kitti_folder as kitti
from command_case import DONE, TIME_LIMIT_S, CommandCase, command_path

WINDOW = ("--window", 10)
# The images of a scan need more memory than these maps have. By them, too, a block that is in the archive while a scan sees it is not contradicted.
RAYS = ("--carving", "rays")
# Where blocks leave that scans still reach, they take their votes along; evidence alone adds up wherever its blocks are meanwhile.
NEAR = (*RAYS, "--inference", "multi-entropy")
THERE_AND_BACK = [*range(0, 60, 4), *range(60, 0, -6), 200, 3, 7]


class Window(CommandCase):
    def setUp(self):
        super().setUp()
        self.data = kitti.write_dataset(
            self.folder / "data", [kitti.corner_scan(i, pose=kitti.moved(x)) for i, x in enumerate(THERE_AND_BACK)])
        self.archive = self.folder / "spill" / "blocks.tsa"

    def archived(self, out, *options):
        return self.map_dataset(self.data, self.folder / out, *WINDOW, "--archive", "spill", *options)

    def whole(self, *options):
        _, report = self.map_dataset(self.data, self.folder / "whole.tsm", *options)
        return report, (self.folder / "whole.tsm").read_bytes()

    def test_window_and_archive_are_the_map_without_a_window_byte_by_byte(self):
        for options in ((), ("--counts", "dense"), ("--inference", "counting", "--max-evidence", 0)):
            with self.subTest(options):
                plain, expected = self.whole(*options)
                self.archive.unlink(missing_ok=True)
                result, report = self.archived("map.tsm", *options)
                self.assertEqual(expected, (self.folder / "map.tsm").read_bytes())
                self.assertEqual(plain["digest"], report["digest"])
                self.assert_not_warned(result)
                window = report["window"]
                self.assertGreater(window["evicted"], 300)
                self.assertGreater(window["reloaded"], 100)
                for none in ("merged", "lost_blocks", "evictions_refused", "reloads_failed", "backlog"):
                    self.assertEqual(0, window[none], none)
                self.assertEqual(self.archive.stat().st_size, window["archive_bytes"])
                self.assertEqual(10, window["radius_m"])
                self.assertLess(report["memory"]["blocks"], plain["memory"]["blocks"] / 2)
                self.assertEqual(0, report["heap_allocations_after_init"] or 0)
                self.assertEqual(plain["totals"]["left_out"], report["totals"]["left_out"])

    def test_a_map_that_does_not_fit_in_memory(self):
        plain, expected = self.whole(*RAYS)
        small = ("--memory", "3M", *RAYS)
        _, lossy = self.map_dataset(self.data, self.folder / "map.tsm", *small, "--window", 300)
        self.assertGreater(lossy["memory"]["refused"], 1000)
        result, report = self.archived("map.tsm", *small)
        self.assert_not_warned(result)
        self.assertEqual(0, report["totals"]["left_out"])
        self.assertEqual(plain["digest"], report["digest"])
        self.assertEqual(expected, (self.folder / "map.tsm").read_bytes())

    def test_a_window_with_more_than_memory_holds(self):
        for options in (NEAR, RAYS):
            with self.subTest(options):
                _, expected = self.whole(*options)
                self.archive.unlink(missing_ok=True)
                result, report = self.map_dataset(self.data, self.folder / "map.tsm", "--memory", "3M", *options, "--window", 300, "--archive", "spill")
                self.assert_not_warned(result)
                self.assertEqual(0, report["totals"]["left_out"])
                self.assertGreater(report["window"]["near_evicted"], 300)
                self.assertGreater(report["window"]["reloaded"], 100)
                self.assertEqual(self.observed("whole.tsm"), self.observed("map.tsm"))
                if options == NEAR:
                    self.assertEqual(expected, (self.folder / "map.tsm").read_bytes())

    def observed(self, map_file):
        """How many voxels have labels, are free, or are occupied."""
        self.done("info", self.folder / map_file, "--report", "info.json")
        report = json.loads((self.folder / "info.json").read_text())
        return [report[key] for key in ("label_voxels", "free_voxels", "occupied_state")]

    def spilled(self, out, *options):
        """A run that keeps all, in memory that does not hold it."""
        return self.map_dataset(self.data, self.folder / out, "--max-range", 10, "--memory", "3M", *RAYS, *options)

    def test_without_options_a_map_that_does_not_fit_goes_on_through_an_archive_beside_it(self):
        plain, expected = self.whole("--max-range", 10, *RAYS)
        self.assertNotIn("window", plain)
        result, report = self.spilled("map.tsm")
        self.assert_not_warned(result)
        self.assertIn("archive", result.stdout)
        self.assertEqual(0, report["totals"]["left_out"])
        self.assertEqual(plain["digest"], report["digest"])
        self.assertEqual(expected, (self.folder / "map.tsm").read_bytes())
        self.assertGreater(report["window"]["evicted"], 100)
        self.assertGreater(report["window"]["reloaded"], 100)
        self.assertEqual(0, report["window"]["merged"])
        self.assertEqual(0, report["heap_allocations_after_init"] or 0)
        self.assertIsNone(report["config"]["window"])
        self.assertFalse((self.folder / "map.tsm.archive").exists())

    def test_with_a_deadline_that_is_kept_it_goes_on_through_the_archive_too(self):
        plain, _ = self.whole("--max-range", 10, *RAYS)
        _, report = self.spilled("map.tsm", "--deadline", 60_000)
        self.assertEqual(plain["digest"], report["digest"])
        self.assertGreater(report["window"]["evicted"], 100)

    def test_where_scans_reach_farther_than_memory_near_blocks_leave_it_too(self):
        for reach in (0, 60):
            with self.subTest(reach):
                plain, _ = self.whole("--max-range", reach, *NEAR)
                result, report = self.map_dataset(self.data, self.folder / "map.tsm", "--max-range", reach, "--memory", "2500K", *NEAR)
                self.assert_not_warned(result)
                self.assertEqual(0, report["totals"]["left_out"])
                self.assertEqual(plain["digest"], report["digest"])
                self.assertGreater(report["window"]["evicted"], plain["memory"]["blocks"])
                self.assertFalse((self.folder / "map.tsm.archive").exists())

    def test_a_scan_that_adds_more_than_there_is_room_for_is_named_and_the_run_fails(self):
        result = self.run_command("map", "--dataset", self.data, "--max-range", 0, "--memory", "2M", *RAYS, "--out", self.folder / "map.tsm",
                                  "--report", self.folder / "map.json")
        self.assertEqual(2, result.returncode)
        said = result.stderr.splitlines()[-1]
        for part in ("points and rays of ", "number 0, 1, ", "a scan takes more than there is room for", "--memory"):
            self.assertIn(part, said)
        self.assertGreater(json.loads((self.folder / "map.json").read_text())["memory"]["refused"], 0)
        self.assertTrue((self.folder / "map.tsm").exists())

    def test_a_range_that_no_window_reaches_needs_none(self):
        _, report = self.map_dataset(self.data, self.folder / "map.tsm", "--max-range", 1e6)
        self.assertNotIn("window", report)

    def test_an_archive_that_was_asked_for_is_kept_wherever_it_is(self):
        self.map_dataset(self.data, self.folder / "map.tsm", *WINDOW, "--archive", "map.tsm.archive")
        self.assertTrue((self.folder / "map.tsm.archive" / "blocks.tsa").exists())

    def test_an_archive_beside_the_output_that_an_earlier_run_left(self):
        first, second = self.parts(9)
        self.archived("first.tsm", *RAYS, *first)
        left = self.folder / "refused.tsm.archive" / "blocks.tsa"
        left.parent.mkdir()
        left.write_bytes(self.archive.read_bytes())
        self.map_refused(self.data, "--max-range", 10, saying=("refused.tsm.archive/blocks.tsa", "--continue"))
        self.spilled("refused.tsm", *second, "--continue", left)
        self.assertFalse(left.exists())
        self.spilled("whole.tsm")
        self.assertEqual((self.folder / "whole.tsm").read_bytes(), (self.folder / "refused.tsm").read_bytes())

    def spill_fails(self, out, file_limit=resource.RLIM_INFINITY):
        """What a run says that neither memory nor disk hold."""
        result = subprocess.run(
            [command_path(), "map", "--dataset", self.data, "--out", out, "--report", "r.json", "--max-range", "10", "--memory", "3M", *RAYS],
            cwd=self.folder, text=True, capture_output=True, timeout=TIME_LIMIT_S, check=False, restore_signals=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (file_limit, file_limit)))
        self.assertEqual(2, result.returncode, result.stderr)
        return result.stderr

    def drive(self, scans):
        self.data = kitti.write_dataset(self.folder / "far", [kitti.corner_scan(i, pose=kitti.moved(6 * i)) for i in range(scans)])

    def test_where_no_archive_can_be_made_the_run_says_what_the_whole_would_take(self):
        self.drive(40)
        (self.folder / "map.tsm.archive").write_text("")
        said = self.spill_fails("map.tsm")
        mebibytes = int(re.search(r"--memory (\d+)M", said)[1])
        # The scans so far are there.
        done = int(re.search(r"after scan (\d+) of 40", said)[1])
        self.done("info", "map.tsm")
        self.assertEqual(done, len(json.loads((self.folder / "r.json").read_text())["scans"]))
        with_memory = lambda m: self.run_command("map", "--dataset", self.data, "--out", "map.tsm", "--max-range", 10, *RAYS, "--memory", f"{m}M")
        enough = next(m for m in range(3, 30) if with_memory(m).returncode == DONE)
        self.assertLess(abs(mebibytes / enough - 1), 0.3, enough)

    @unittest.skipIf(os.environ.get("TESSERA_SANITIZE"), "sanitizers write files of their own")
    def test_a_disk_that_is_full_keeps_what_it_holds(self):
        self.drive(40)
        said = self.spill_fails("map.tsm", 65536)
        self.assertIn("File too large", said)
        self.spilled("map.tsm", "--continue", "map.tsm.archive/blocks.tsa", "--first", 39)
        self.done("info", "map.tsm")

    def test_eval_query_and_info_work_on_what_comes_out(self):
        plain, _ = self.whole()
        self.archived("map.tsm")
        self.done("info", "map.tsm", "--report", "info.json")
        self.assertEqual(plain["digest"], json.loads((self.folder / "info.json").read_text())["digest"])
        scores = []
        for name in ("map.tsm", "whole.tsm"):
            self.done("eval", "--map", name, "--dataset", self.data, "--report", "eval.json")
            scores.append(json.loads((self.folder / "eval.json").read_text()))
        self.assertGreater(scores[0]["coverage_any"], 0.98)
        for key in ("coverage_any", "mean_iou", "points"):
            self.assertEqual(scores[1][key], scores[0][key])

    def test_a_window_narrower_than_the_scans_adds_what_meets_again(self):
        exact = (*RAYS, "--inference", "counting", "--counts", "dense", "--max-evidence", 0)
        plain, _ = self.whole(*exact)
        _, report = self.map_dataset(self.data, self.folder / "map.tsm", "--window", 2, "--archive", "spill", *exact)
        self.assertGreater(report["window"]["merged"], 0)
        self.assertEqual(plain["digest"], report["digest"])

    def test_without_an_archive_what_is_lost_is_counted_and_said(self):
        result, report = self.map_dataset(self.data, self.folder / "map.tsm", *WINDOW)
        self.assert_warned(result, "lost", "--archive")
        self.assertGreater(report["window"]["lost_blocks"], 300)
        self.assertEqual(report["window"]["lost_blocks"], report["window"]["evicted"])
        self.assertEqual(0, report["window"]["archive_bytes"])

    def parts(self, cut):
        first = ("--last", cut - 1)
        second = ("--first", cut)
        return first, second

    def test_going_on_from_map_and_archive(self):
        plain, _ = self.whole()
        first, second = self.parts(13)
        self.archived("map.tsm", *first)
        _, report = self.archived("map.tsm", *second, "--continue", "map.tsm")
        self.assertEqual(plain["digest"], report["digest"])
        self.assertEqual(0, report["window"]["merged"])
        self.assertEqual((self.folder / "map.tsm").read_bytes(), (self.folder / "whole.tsm").read_bytes())

    def test_going_on_after_a_run_that_was_cut_short(self):
        first, second = self.parts(13)
        self.archived("map.tsm", *first)
        sound = self.archive.read_bytes()
        for cut in (1, 40, 300):  # the mark of a complete run takes 32 bytes
            with self.subTest(cut):
                self.archive.write_bytes(sound[:-cut])
                self.map_refused(self.data, *second, *WINDOW, "--archive", "spill", "--continue", "map.tsm",
                                 saying=("another state", "blocks.tsa"))
                result, report = self.archived("again.tsm", *second, "--continue", self.archive)
                self.assert_warned(result, "cut short")
                self.assertGreater(report["window"]["reloaded"], 0)
                self.done("info", "again.tsm")

    def test_an_archive_that_nothing_goes_on_from_is_not_overwritten(self):
        self.archived("map.tsm", "--last", 9)
        before = self.archive.read_bytes()
        self.map_refused(self.data, *WINDOW, "--archive", "spill", saying=("earlier run", "--continue"))
        other = kitti.write_dataset(self.folder / "other", [kitti.corner_scan(1)] * 3)
        self.map_dataset(other, self.folder / "other.tsm")
        self.map_refused(self.data, *WINDOW, "--archive", "spill", "--continue", "other.tsm", saying=("another state",))
        self.assertEqual(before, self.archive.read_bytes())

    def test_files_that_are_no_archives_or_are_damaged(self):
        self.archived("map.tsm")
        sound = self.archive.read_bytes()
        middle = bytearray(sound)
        middle[sound.index(b"BLCK", 5000) + 24] ^= 1  # of a block's payload; zeros between records are not checked
        newer = bytearray(sound)
        newer[8] = 9
        for data in (b"", b"ply\n" * 100, bytes(5000), sound[:50], bytes(newer), bytes(middle)):
            with self.subTest(len(data)):
                self.archive.write_bytes(data)
                self.map_refused(self.data, *WINDOW, "--archive", "spill", "--continue", self.archive, saying=("blocks.tsa",))
                self.assertEqual(data, self.archive.read_bytes())

    def test_an_archive_alone_has_the_window_that_scans_reach_within(self):
        _, report = self.map_dataset(self.data, self.folder / "alone.tsm", "--max-range", 8, "--archive", "spill")
        self.assertEqual(8, report["window"]["radius_m"])
        self.assertEqual(8, report["config"]["window"])

    def test_options_that_do_not_go_together(self):
        self.map_refused(self.data, "--archive", "spill", "--max-range", 0, saying=("--archive", "--window", "--max-range"))
        for metres in (0, -5, 1e9):
            self.map_refused(self.data, "--window", metres, saying=("--window",))
        self.refused("map", "--dataset", self.data, *WINDOW, "--archive", "spill", "--out", self.archive,
                     saying=("--out", "--archive"))
        (self.folder / "file").write_text("")
        self.map_refused(self.data, *WINDOW, "--archive", "file", saying=("file",))

    @unittest.skipIf(os.environ.get("TESSERA_SANITIZE"), "sanitizers write files of their own")
    def test_a_full_disk_loses_nothing(self):
        """The archive may not grow over a limit: the blocks stay in the map, and OUT, smaller, has all of them."""
        exact = ("--counts", "dense", *WINDOW, "--archive", "spill", "--memory", "48M")
        _, expected = self.whole("--counts", "dense")
        limit = len(expected) + 4096
        self.archived("map.tsm", "--counts", "dense")
        self.assertGreater(self.archive.stat().st_size, limit)
        self.archive.unlink()
        # Signals are left as Python has them, that is with SIGXFSZ ignored, so that writing fails instead.
        result = subprocess.run(
            [command_path(), "map", "--dataset", self.data, "--out", "full.tsm", "--report", "full.json", *map(str, exact)],
            cwd=self.folder, text=True, capture_output=True, timeout=TIME_LIMIT_S, check=False, restore_signals=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        self.assertEqual(DONE, result.returncode, result.stderr)
        self.assert_warned(result, "could not be written", "could not take all")
        self.assertGreater(json.loads((self.folder / "full.json").read_text())["window"]["evictions_refused"], 0)
        self.assertEqual(expected, (self.folder / "full.tsm").read_bytes())


if __name__ == "__main__":
    unittest.main()
