# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""eval, on voxels few enough to compute by hand."""
import json
import math
import struct
import unittest

import kitti_folder as kitti
from command_case import CommandCase, crc32c
from counting import COUNTING, probability

EVAL_KEYS = {"mean_iou", "iou", "input_mean_iou", "input_iou", "coverage", "coverage_any", "accuracy",
             "calibration_error", "brier_score", "risk_coverage_area", "by_label", "points"}


class Eval(CommandCase):
    """A: one voxel, twice road and once car in the map. B: car. C: occupied, no label. E: not in the map."""
    A = [(2.02, 0.05, 0.05), (2.05, 0.05, 0.05), (2.08, 0.05, 0.05)]
    B, C, E, UNTRUE = (3.05, 0.05, 0.05), (4.05, 0.05, 0.05), (10.05, 0.05, 0.05), (2.07, 0.05, 0.05)

    def setUp(self):
        super().setUp()
        self.map_file = self.folder / "map.tsm"
        learnt = kitti.write_dataset(self.folder / "learnt", [kitti.Scan(
            [*self.A, self.B, self.C], [kitti.ROAD, kitti.CAR, kitti.ROAD, kitti.CAR, kitti.UNLABELLED])])
        self.map_dataset(learnt, self.map_file, *COUNTING)
        self.data = kitti.write_dataset(self.folder / "judged", [kitti.Scan(
            [*self.A, self.B, self.C, self.E, self.UNTRUE],
            [kitti.ROAD, kitti.ROAD, kitti.CAR, kitti.CAR, kitti.UNLABELLED, kitti.ROAD, kitti.ROAD],
            [kitti.ROAD, kitti.CAR, kitti.ROAD, kitti.BUILDING, kitti.CAR, kitti.ROAD, kitti.UNLABELLED])])

    def evaluate(self, *options):
        report = self.folder / "eval.json"
        result = self.done("eval", "--map", self.map_file, "--dataset", self.data, "--report", report, *options)
        return result, json.loads(report.read_text())

    def test_has_every_key_of_the_contract(self):
        self.assertLessEqual(EVAL_KEYS, self.evaluate()[1].keys())

    def test_hand_computed(self):
        _, report = self.evaluate()
        self.assertEqual(6, report["points"])
        self.assertAlmostEqual(2 / 6, report["accuracy"])
        self.assertAlmostEqual(4 / 6, report["coverage"])
        self.assertAlmostEqual(5 / 6, report["coverage_any"])
        self.assertEqual({"car", "road", "building"}, report["iou"].keys())
        self.assertAlmostEqual(2 / 4, report["iou"]["road"])  # two right, a car taken for road, E missed
        self.assertAlmostEqual(0.0, report["iou"]["car"])
        self.assertAlmostEqual(0.0, report["iou"]["building"])
        self.assertAlmostEqual(0.5 / 3, report["mean_iou"])

    def test_points_of_raw_ids_that_do_not_count(self):
        """What the truth has in these ids is left out, whatever the map says there."""
        _, report = self.evaluate("--without", f"{kitti.BUILDING},{kitti.CAR}")
        self.assertEqual({"road"}, report["iou"].keys())
        self.assertEqual([kitti.BUILDING, kitti.CAR], report["config"]["without"])
        self.assertEqual(self.evaluate()[1]["counts"]["road"]["true_positives"], report["counts"]["road"]["true_positives"])
        self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--without", "car", saying=("--without",))

    def test_scores_that_are_worth_little_are_warned_about(self):
        self.assert_not_warned(self.evaluate()[0])
        elsewhere = kitti.write_dataset(self.folder / "elsewhere", [kitti.Scan([self.A[0], self.E, self.E], [kitti.ROAD] * 3)])
        result = self.done("eval", "--map", self.map_file, "--dataset", elsewhere)
        self.assert_warned(result, "only 33.3 % of the points are in occupied voxels")
        self.assertNotIn("has no label", result.stderr)
        self.map_dataset(self.folder / "learnt", self.map_file, *COUNTING, "--labels", "none")
        result, _ = self.evaluate()
        self.assert_warned(result, "the map has no label")
        self.assertNotIn("in occupied voxels", result.stderr)

    def test_hand_computed_input(self):
        _, report = self.evaluate()
        self.assertAlmostEqual(2 / 4, report["input_iou"]["road"])
        self.assertAlmostEqual(0.0, report["input_iou"]["car"])
        self.assertAlmostEqual(0.5 / 3, report["input_mean_iou"])

    def test_hand_computed_counts(self):
        _, report = self.evaluate()
        keys = ("true_positives", "false_positives", "false_negatives")
        for name, counts in (("road", (2, 1, 1)), ("car", (0, 1, 2)), ("building", (0, 0, 1)), ("pole", (0, 0, 0))):
            self.assertEqual(dict(zip(keys, counts, strict=True)), report["counts"][name], name)
        self.assertEqual((2, 1, 1), tuple(report["input_counts"]["road"][key] for key in keys))
        self.assertIsNone(self.evaluate("--input", "none")[1]["input_counts"])

    def test_hand_computed_calibration(self):
        # A and B fall into different ones of the 15 bins.
        a, b = probability(2, 3), probability(1, 1)
        self.assertNotEqual(int(a * 15), int(b * 15))
        self.assertAlmostEqual((abs(2 - 3 * a) + abs(0 - b)) / 4, self.evaluate()[1]["calibration_error"])

    def test_hand_computed_brier_score(self):
        """Three points in A, of which two are road, and B, which is a building."""
        # Of 21 components, those that have evidence and one that has none.
        parts = [probability(2, 3), probability(1, 3), probability(0, 3)], [probability(1, 1), probability(0, 1)]
        road = (1 - parts[0][0]) ** 2 + parts[0][1] ** 2 + 19 * parts[0][2] ** 2
        car = parts[0][0] ** 2 + (1 - parts[0][1]) ** 2 + 19 * parts[0][2] ** 2
        building = parts[1][0] ** 2 + (1 - parts[1][1]) ** 2 + 19 * parts[1][1] ** 2
        report = self.evaluate()[1]
        self.assertAlmostEqual((2 * road + car + building) / 4, report["brier_score"])
        self.assertAlmostEqual((2 * road + car) / 3, report["by_label"]["road"]["brier_score"])
        self.assertAlmostEqual(building, report["by_label"]["car"]["brier_score"])

    def test_hand_computed_risk_and_coverage(self):
        """B's label is the most probable one, and wrong; of the three points in A one is, and none of them before the others."""
        report = self.evaluate()[1]
        self.assertAlmostEqual((1 / 1 + (4 / 3) / 2 + (5 / 3) / 3 + 2 / 4) / 4, report["risk_coverage_area"])
        self.assertEqual({"road", "car"}, report["by_label"].keys())
        self.assertAlmostEqual(1 / 3, report["by_label"]["road"]["risk_coverage_area"])
        self.assertAlmostEqual(1.0, report["by_label"]["car"]["risk_coverage_area"])
        self.assertEqual([3, 1], [report["by_label"][name]["points"] for name in ("road", "car")])

    def test_range(self):
        _, report = self.evaluate("--max-range", "3.5")
        self.assertEqual(4, report["points"])
        self.assertAlmostEqual(2 / 4, report["accuracy"])
        self.assertEqual({"car", "road", "building"}, report["iou"].keys())

    def test_range_is_the_maps_own_by_default(self):
        self.map_dataset(self.folder / "learnt", self.map_file, *COUNTING, "--max-range", "5")
        self.assertEqual(5, self.evaluate()[1]["points"])
        self.assertEqual(6, self.evaluate("--max-range", "0")[1]["points"])

    def test_labels_from_elsewhere(self):
        _, report = self.evaluate("--truth", "predictions", "--input", "none")
        self.assertEqual(6, report["points"])
        self.assertIsNone(report["input_mean_iou"])
        self.assertIsNone(report["input_iou"])

    def test_dataset_in_another_frame(self):
        T = self.folder / "T.txt"
        T.write_text("1 0 0 -100\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        kitti.write_poses(self.data, [kitti.moved(100.0)])
        self.assertEqual(0.0, self.evaluate()[1]["coverage"])
        self.assertAlmostEqual(4 / 6, self.evaluate("--transform", T)[1]["coverage"])
        T.write_text("2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--transform", T, saying=("rigid",))

    def map_of_b(self, name, b, *options):
        data = kitti.write_dataset(self.folder / name, [kitti.Scan([b], [kitti.CAR])])
        self.map_dataset(data, self.folder / f"{name}.tsm", *COUNTING, *options)
        return self.folder / f"{name}.tsm"

    def test_overlap_of_two_maps(self):
        result, report = self.evaluate("--overlap-of", self.map_file, self.map_of_b("other", self.B))
        self.assertEqual(1, report["points"])
        self.assert_not_warned(result)

    def test_overlap_of_maps_whose_frames_are_related_by_T_global_map(self):
        x, y, z = self.B
        # A quarter turn about z, then 5 m along the global x; B in the other robot's frame, and its place here.
        other = self.map_of_b("other", (y, 5.0 - x, z), "--robot", "1")
        missing = self.map_of_b("missing", self.B, "--robot", "1")
        self.place(other, (0.0, -1.0, 0.0, 5.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0))
        result, report = self.evaluate("--overlap-of", self.map_file, other)
        self.assert_warned(result, "map.tsm has no T_global_map")
        self.assertEqual(1, report["points"])
        self.place(self.map_file, kitti.IDENTITY)
        result, report = self.evaluate("--overlap-of", self.map_file, other)
        self.assert_not_warned(result)
        self.assertEqual(1, report["points"])
        self.place(self.map_file, kitti.moved(0.0, 1.0))
        self.assertEqual(0, self.evaluate("--overlap-of", self.map_file, other)[1]["points"])
        result, report = self.evaluate("--overlap-of", other, missing)
        self.assert_warned(result, "missing.tsm has no T_global_map")

    def test_overlap_with_other_classes(self):
        data = kitti.write_dataset(self.folder / "few", [kitti.Scan([self.B], [kitti.CAR])])
        (data / "classes.toml").write_text('[[class]]\nid = 1\nname = "thing"\ncolor = [1, 2, 3]\nraw = [10]\n')
        self.map_dataset(data, self.folder / "few.tsm", *COUNTING)
        self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--overlap-of", self.map_file, "few.tsm",
                     saying=("few.tsm", "classes"))

    def place(self, map_file, T_global_map):
        """Writes T_global_map into the header of a map file; docs/reference/memory.md has its layout."""
        data = bytearray(map_file.read_bytes())
        end = 16 + struct.unpack_from("<I", data, 12)[0]
        data[19] = 1
        struct.pack_into("<12d", data, 56, *T_global_map)
        struct.pack_into("<I", data, end, crc32c(data[:end]))
        map_file.write_bytes(data)

    def test_labels_in_no_class_are_counted_and_told(self):
        folders = {"labels": [7, 7], "predictions": [300]}
        for folder, ids in folders.items():
            path = self.data / folder / "000000.label"
            path.write_bytes(kitti.labels_bytes(ids) + path.read_bytes()[4 * len(ids):])
        result, report = self.evaluate()
        self.assert_warned(result, "2 points of labels with class ids that are in no class (7)",
                           "1 point of predictions with class ids that are in no class (300)")
        self.assertEqual((2, 1), (report["unknown_truth_ids"], report["unknown_input_ids"]))
        self.assertEqual(4, report["points"])

    def test_what_cannot_be_judged_is_counted_and_told(self):
        scan = kitti.Scan([*self.A, (math.nan, 0.0, 0.0)], [kitti.ROAD] * 4)
        self.data = kitti.write_dataset(self.folder / "bad", [scan, kitti.Scan([self.B], [kitti.ROAD])])
        kitti.write_poses(self.data, [kitti.IDENTITY, (2.0,) + kitti.IDENTITY[1:]])
        result, report = self.evaluate()
        self.assert_warned(result, "1 point left out", "1 scan left out", "not a rigid transform: 1")
        self.assertEqual((1, 1, 3), (report["non_finite"], report["bad_poses"], report["points"]))

    def test_the_report_has_every_option(self):
        _, report = self.evaluate("--first", "0", "--max-range", "20")
        self.assertEqual({"map": str(self.map_file), "dataset": str(self.data), "truth": "labels", "input": "predictions",
                          "report": str(self.folder / "eval.json"), "first": 0, "last": None, "max_range": 20.0,
                          "overlap_of": [], "without": [], "deskew": "where timed", "transform": ""}, report["config"])

    def test_a_transform_is_sixteen_numbers(self):
        T = self.folder / "T.txt"
        for text in ("1 0 0 0\n0 1 0 0\n0 0 1 0\n", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n5",
                     "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n", "1 0 0 0\n0 1 0 0\n0 0 one 0\n0 0 0 1\n", "",
                     "nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"):
            with self.subTest(text):
                T.write_text(text)
                self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--transform", T, saying=("T.txt",))

    def test_there_must_be_a_truth(self):
        self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--truth", "none", saying=("--truth none",))

    def test_bad_input(self):
        self.refused("eval", "--map", "absent.tsm", "--dataset", self.data, saying=("absent.tsm",))
        self.refused("eval", "--map", self.map_file, "--dataset", "absent", saying=("absent",))
        self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--truth", "absent", saying=("absent",))
        self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--input", "absent", saying=("absent",))
        for value in ("-1", "nan"):
            self.refused("eval", "--map", self.map_file, "--dataset", self.data, f"--max-range={value}",
                         saying=("--max-range",))
        self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--report", "absent/r.json",
                     saying=("absent",))


if __name__ == "__main__":
    unittest.main()
