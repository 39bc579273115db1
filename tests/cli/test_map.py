# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""map: options that are refused, memory that is scarce, outputs that cannot be written, going on from a map, and the
report."""
import json
import os
import resource
import subprocess
import unittest

import kitti_folder as kitti
from command_case import FAILURE, MEMORY, TIME_LIMIT_S, CommandCase, command_path

SCAN_KEYS = {"index", "points", "voxel_updates", "milliseconds", "left_out"}
TOTALS_KEYS = {"median_ms", "p99_ms", "max_ms", "scans"}
MEMORY_KEYS = {"budget_bytes", "used_bytes", "peak_bytes", "scratch_bytes", "label_voxels", "free_voxels",
               "bytes_per_label_voxel", "refused"}
# Every option that says how a map is made, as the report's "config" names it.
CONFIG_KEYS = {"dataset", "out", "first", "last", "labels", "resolution", "inference", "kernel_length", "prior",
               "max_range", "downsample", "free_space", "memory", "counts", "robot", "min_weight", "max_evidence",
               "continue", "carving", "window", "archive", "report", "min_range", "thinning_weight", "free_weight", "work_budget",
               "deadline", "deskew"}


class MapCase(CommandCase):
    def setUp(self):
        super().setUp()
        self.scans = [kitti.corner_scan(i, pose=kitti.moved(0.3 * i)) for i in range(3)]
        self.data = kitti.write_dataset(self.folder / "data", self.scans)
        self.out = self.folder / "map.tsm"


class Options(MapCase):
    def test_resolution_must_be_a_length(self):
        for value in ("0", "-0.1", "nan", "inf", "1e9", "fine"):
            with self.subTest(value):
                self.map_refused(self.data, f"--resolution={value}", saying=("--resolution",))

    def test_numbers_out_of_range(self):
        for option, value in (("--prior", "-1"), ("--prior", "nan"), ("--max-range", "-3"), ("--max-range", "nan"),
                              ("--min-weight", "-1"), ("--min-weight", "2"), ("--max-evidence", "-1"),
                              ("--max-evidence", "nan"), ("--free-weight", "0"), ("--downsample", "0"),
                              ("--downsample", "much"), ("--free-space", "maybe"), ("--inference", "guess"),
                              ("--robot", "-1"), ("--robot", "x"), ("--first", "one"), ("--work-budget", "-1"), ("--deadline", "-1"),
                              ("--deadline", "0.0009"), ("--deadline", "2e9"), ("--deadline", "soon"),
                              ("--min-range", "-1"), ("--min-range", "50"), ("--thinning-weight", "most")):
            with self.subTest(option=option, value=value):
                self.map_refused(self.data, f"{option}={value}", saying=(option,))

    def test_memory_that_is_no_size(self):
        for value in ("lots", "12Q", "-5M", "nan", "inf", "", "1e30G", "5MM"):
            with self.subTest(value):
                self.map_refused(self.data, "--memory", value, saying=("--memory",))

    def test_memory_of_many_spellings(self):
        for value, size in (("33554432", 32 << 20), ("32768K", 32 << 20), ("32M", 32 << 20), ("32MB", 32 << 20),
                            ("0.03125G", 32 << 20)):
            with self.subTest(value):
                _, report = self.map_dataset(self.data, self.out, "--memory", value)
                self.assertEqual(size, report["memory"]["budget_bytes"])

    def test_unknown_option(self):
        self.map_refused(self.data, "--resolutoin", "0.1", saying=("--resolutoin",))

    def test_missing_required_option(self):
        self.refused("map", "--out", self.out, saying=("--dataset",))
        self.refused("map", "--dataset", self.data, saying=("--out",))

    def test_kernel_length_needs_a_mode_that_has_kernels(self):
        self.map_refused(self.data, "--inference", "multi-entropy", "--kernel-length", "0.3",
                         saying=("--kernel-length", "kernel and lattice"))
        self.map_refused(self.data, "--resolution", "0.3", "--kernel-length", "0.5", saying=("--kernel-length", "0.25 m"))

    def test_kernel_length_out_of_range(self):
        for value in ("0", "-1", "nan", "1000"):
            with self.subTest(value):
                self.map_refused(self.data, "--inference", "kernel", f"--kernel-length={value}",
                                 saying=("--kernel-length",))

    def test_counts_are_dense_or_compact(self):
        self.map_refused(self.data, "--counts", "sparse", saying=("--counts", "sparse", "dense or compact"))
        for counts in ("dense", "compact"):
            _, report = self.map_dataset(self.data, self.out, "--counts", counts)
            self.assertEqual(counts, report["config"]["counts"])
            self.assertIn(f"{counts} counts", self.done("info", self.out).stdout)
        _, report = self.map_dataset(self.data, self.out)
        self.assertEqual("compact", report["config"]["counts"])


class Memory(MapCase):
    def test_too_small_for_a_scan_maps_what_fits_and_fails(self):
        data = kitti.write_dataset(self.folder / "scattered", [kitti.scattered_scan(i) for i in range(4)])
        made = self.folder / "map.json"
        result = self.run_command("map", "--dataset", data, "--out", self.out, "--report", made, "--memory", "2M", "--carving", "rays")
        self.assertEqual(2, result.returncode)
        report = json.loads(made.read_text())
        self.assert_warned(result, "lack of memory", "--memory")
        memory = report["memory"]
        self.assertGreater(memory["refused"], 0)
        self.assertGreater(memory["label_voxels"], 0)
        self.assertLessEqual(memory["peak_bytes"] + memory["scratch_bytes"], memory["budget_bytes"])
        self.assertGreater(sum(scan["left_out"] for scan in report["scans"]), 0)
        self.done("info", self.out)

    def test_too_small_for_any_map(self):
        for value in ("1K", "0", "1"):
            with self.subTest(value):
                self.map_refused(self.data, "--memory", value, saying=("--memory", "at least"))

    def test_the_size_that_a_refusal_names_is_enough(self):
        message = self.map_refused(self.data, "--memory", "1K")
        self.map_dataset(self.data, self.out, "--memory", message.split()[-1])
        self.assertIn("take --carving rays, which needs 16M less, or give", message)
        message = self.map_refused(self.data, "--memory", "1K", "--carving", "rays")
        self.assertNotIn("--carving", message)
        self.map_dataset(self.data, self.out, "--memory", message.split()[-1], "--carving", "rays")

    @unittest.skipIf(os.environ.get("TESSERA_SANITIZE"), "the sanitizer reports such an allocation itself")
    def test_more_than_the_machine_has(self):
        result = self.run_command("map", "--dataset", self.data, "--out", self.out, "--memory", "900000G")
        self.assertIn(result.returncode, (1, 2))
        self.assertEqual(1, len(result.stderr.splitlines()), result.stderr)
        self.assertIn("--memory", result.stderr)
        self.assertFalse(self.out.exists())

    def test_enough_memory_refuses_nothing(self):
        result, report = self.map_dataset(self.data, self.out)
        self.assert_not_warned(result)
        self.assertEqual(0, report["memory"]["refused"])


class Output(MapCase):
    def test_folder_that_is_missing(self):
        self.refused("map", "--dataset", self.data, "--out", self.folder / "absent" / "a.tsm",
                     saying=("absent", "folder does not exist"))

    def test_folder_in_place_of_a_file(self):
        self.refused("map", "--dataset", self.data, "--out", self.folder, saying=("it is a folder",))

    def test_a_device_that_fills_up_leaves_nothing(self):
        """A limit on the size of files stands for a full disk."""
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        self.out.write_text("an earlier map")
        # Signals are left as Python has them, that is with SIGXFSZ ignored, so that writing fails instead.
        result = subprocess.run([command_path(), "map", "--dataset", self.data, "--out", self.out, *MEMORY],
                                cwd=self.folder, text=True, capture_output=True, timeout=TIME_LIMIT_S, check=False,
                                preexec_fn=limit, restore_signals=False)
        self.assertEqual(FAILURE, result.returncode, result.stderr)
        errors = [line for line in result.stderr.splitlines() if line.startswith("tessera: ")]
        self.assertEqual(1, len(errors), result.stderr)
        self.assertIn("map.tsm", errors[0])
        self.assertEqual("an earlier map", self.out.read_text())

    def test_empty_name(self):
        self.refused("map", "--dataset", self.data, "--out", "")

    def test_unwritable_report_is_told_before_the_work(self):
        self.refused("map", "--dataset", self.data, "--out", self.out, "--report", self.folder / "absent" / "r.json",
                     saying=("absent",))
        self.assertFalse(self.out.exists())


class Continue(MapCase):
    def test_gives_what_one_go_gives(self):
        for options in ((), ("--counts", "dense"), ("--inference", "kernel"), ("--inference", "counting"), ("--free-space", "off")):
            with self.subTest(options):
                _, whole = self.map_dataset(self.data, self.out, *options)
                part, rest = self.folder / "part.tsm", self.folder / "rest.tsm"
                self.map_dataset(self.data, part, *options, "--last", 0)
                _, continued = self.map_dataset(self.data, rest, *options, "--first", 1, "--continue", part)
                self.assertEqual(whole["digest"], continued["digest"])

    def test_over_its_own_file(self):
        _, whole = self.map_dataset(self.data, self.out)
        part = self.folder / "part.tsm"
        self.map_dataset(self.data, part, "--last", 1)
        _, continued = self.map_dataset(self.data, part, "--first", 2, "--continue", part)
        self.assertEqual(whole["digest"], continued["digest"])

    def test_with_another_resolution(self):
        self.map_dataset(self.data, self.out)
        self.map_refused(self.data, "--resolution", "0.2", "--continue", self.out, saying=("--resolution", "0.1"))

    def test_with_another_setting_that_is_fixed_for_the_life_of_a_map(self):
        self.map_dataset(self.data, self.out, "--robot", 3)
        for option, other, held in (("--prior", "0.01", "0.001"), ("--max-evidence", "50", "100"),
                                    ("--free-weight", "1", "0.4"), ("--robot", "4", "3")):
            with self.subTest(option):
                self.map_refused(self.data, option, other, "--continue", self.out, saying=(option, held))
                self.map_dataset(self.data, self.folder / "same.tsm", option, held, "--continue", self.out)

    def test_keeps_how_counts_are_stored(self):
        for held, other in (("dense", "compact"), ("compact", "dense")):
            self.map_dataset(self.data, self.out, "--counts", held)
            self.map_refused(self.data, "--counts", other, "--continue", self.out, saying=("--counts", held))
            _, report = self.map_dataset(self.data, self.folder / "more.tsm", "--continue", self.out)
            self.assertEqual(held, report["config"]["counts"])

    def test_in_another_mode_is_warned_about(self):
        self.map_dataset(self.data, self.out, "--inference", "counting")
        run, _ = self.map_dataset(self.data, self.folder / "more.tsm", "--continue", self.out)
        self.assert_warned(run, "--inference counting")
        run, _ = self.map_dataset(self.data, self.folder / "same.tsm", "--inference", "counting", "--continue", self.out)
        self.assert_not_warned(run)

    def test_keeps_the_resolution_and_the_robot(self):
        self.map_dataset(self.data, self.out, "--resolution", "0.25", "--robot", "7", "--last", "0")
        _, report = self.map_dataset(self.data, self.out, "--first", 1, "--continue", self.out)
        self.assertEqual(0.25, report["config"]["resolution"])
        self.assertIn("robot 7", self.done("info", self.out).stdout)

    def test_with_other_classes(self):
        self.map_dataset(self.data, self.out)
        (self.data / "classes.toml").write_text('[[class]]\nid = 1\nname = "thing"\ncolor = [1, 2, 3]\nraw = [40]\n')
        self.map_refused(self.data, "--continue", self.out, saying=("classes",))

    def test_with_a_file_that_is_no_map(self):
        self.map_refused(self.data, "--continue", self.data / "poses.txt", saying=("poses.txt", "not a map file"))
        self.map_refused(self.data, "--continue", self.folder / "absent.tsm", saying=("absent.tsm",))

    def test_in_memory_too_small_for_the_map(self):
        data = kitti.write_dataset(self.folder / "scattered", [kitti.scattered_scan(i) for i in range(8)])
        _, whole = self.map_dataset(data, self.out, "--memory", "64M")
        rays = ("--carving", "rays")
        message = self.map_refused(data, "--memory", "3M", *rays, "--continue", self.out, saying=("--memory 3M", "map.tsm"))
        enough = message.split()[-1]
        _, more = self.map_dataset(data, self.folder / "more.tsm", "--memory", enough, *rays, "--continue", self.out)
        self.assertGreaterEqual(more["file"]["label_voxels"], whole["file"]["label_voxels"])


class Report(MapCase):
    def test_has_every_key_of_the_contract(self):
        _, report = self.map_dataset(self.data, self.out)
        self.assertEqual(3, len(report["scans"]))
        for scan in report["scans"]:
            self.assertLessEqual(SCAN_KEYS, scan.keys())
        self.assertLessEqual(TOTALS_KEYS, report["totals"].keys())
        self.assertLessEqual(MEMORY_KEYS, report["memory"].keys())
        self.assertEqual(CONFIG_KEYS, report["config"].keys())
        self.assertEqual(0.4, report["config"]["free_weight"])
        self.assertEqual(str(self.folder / "map.json"), report["config"]["report"])
        self.assertIn("heap_allocations_after_init", report)
        self.assertRegex(report["digest"], r"^[0-9a-f]{16}$")
        self.assertEqual({key: report["totals"][key] for key in ("voxels_doubted", "voxels_cleared")}, report["contradicted"])

    def test_figures_agree_with_each_other(self):
        _, report = self.map_dataset(self.data, self.out)
        memory, totals = report["memory"], report["totals"]
        self.assertEqual([0, 1, 2], [scan["index"] for scan in report["scans"]])
        self.assertEqual([300] * 3, [scan["points"] for scan in report["scans"]])
        self.assertEqual(3, totals["scans"])
        self.assertLessEqual(totals["median_ms"], totals["p99_ms"])
        self.assertLessEqual(totals["p99_ms"], totals["max_ms"])
        self.assertAlmostEqual(memory["used_bytes"] / memory["label_voxels"], memory["bytes_per_label_voxel"])
        self.assertLessEqual(memory["used_bytes"], memory["peak_bytes"])
        self.assertLessEqual(memory["peak_bytes"] + memory["scratch_bytes"], memory["budget_bytes"])

    def test_the_summary_counts_what_was_integrated(self):
        result, report = self.map_dataset(self.data, self.out, "--free-space", "off")
        admitted, in_range = (sum(scan[key] for scan in report["scans"]) for key in ("admitted", "in_range"))
        self.assertIn(f"3 scans, {admitted} thinned points into {self.out}: of 900 returns, {in_range} in range\n", result.stdout)

    def test_a_map_of_no_point_is_warned_about(self):
        result, report = self.map_dataset(self.data, self.out, "--max-range", "1")
        self.assertEqual((900, 900), (report["totals"]["points"], report["totals"]["beyond_range"]))
        self.assert_warned(result, "all 900 points are beyond --max-range; give a larger one, or points in metres")
        self.assertIn("3 scans, 0 thinned points into ", result.stdout)
        result, _ = self.map_dataset(self.data, self.out, "--min-range", "1000", "--max-range", "2000")
        self.assert_warned(result, "no point was mapped: all 900 points are nearer to the sensor than --min-range")

    def test_no_heap_use_while_mapping(self):
        _, report = self.map_dataset(self.data, self.out)
        # Sanitizers keep the heap to themselves; the count is then null.
        self.assertIn(report["heap_allocations_after_init"], (0, None))

    def test_digest_of_the_same_scans_is_the_same(self):
        _, once = self.map_dataset(self.data, self.out)
        _, again = self.map_dataset(self.data, self.folder / "again.tsm")
        self.assertEqual(once["digest"], again["digest"])
        self.assertEqual(self.out.read_bytes(), (self.folder / "again.tsm").read_bytes())

    def test_digest_does_not_depend_on_memory(self):
        digests = {self.map_dataset(self.data, self.out, "--memory", memory)[1]["digest"]
                   for memory in ("32M", "64M", "512M")}
        self.assertEqual(1, len(digests))

    def test_digest_tells_other_maps_apart(self):
        variants = ((), ("--last", 1), ("--prior", 0.01), ("--resolution", 0.2), ("--free-space", "off"),
                    ("--inference", "counting"), ("--labels", "none"), ("--counts", "dense"))
        digests = {self.map_dataset(self.data, self.out, *options)[1]["digest"] for options in variants}
        self.assertEqual(len(variants), len(digests))

    def test_digest_is_the_one_that_info_tells(self):
        _, report = self.map_dataset(self.data, self.out)
        self.assertIn(report["digest"], self.done("info", self.out).stdout)


if __name__ == "__main__":
    unittest.main()
