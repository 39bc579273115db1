# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""query and eval, on voxels few enough to compute by hand: counting mode, a point adds one to its voxel."""
import json
import unittest

import kitti_folder as kitti
from command_case import CommandCase

COMPONENTS = 21  # free, 19 classes, occupied but unlabelled
PRIOR = 0.001
COUNTING = ("--inference", "counting", "--free-space", "off", "--downsample", "off", "--prior", PRIOR)
EVAL_KEYS = {"mean_iou", "iou", "input_mean_iou", "input_iou", "coverage", "coverage_any", "accuracy",
             "calibration_error", "points"}


def probability(count, evidence):
    """Paper eq. 8."""
    return (PRIOR + count) / (COMPONENTS * PRIOR + evidence)


def variance(p, evidence):
    """Paper eq. 17."""
    return p * (1 - p) / (COMPONENTS * PRIOR + evidence + 1)


class Query(CommandCase):
    def setUp(self):
        super().setUp()
        self.map_file = self.folder / "map.tsm"

    def map_scan(self, scan, *options):
        data = kitti.write_dataset(self.folder / "data", [scan])
        self.map_dataset(data, self.map_file, *(options or COUNTING))

    def test_columns(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]))
        columns, _ = self.query_rows(self.map_file, "x,y,z\n")
        self.assertEqual(["x", "y", "z", "state", "label", "probability", "variance", "evidence"] +
                         [f"sigma_{i}" for i in range(COMPONENTS)], columns)

    def assert_row(self, row, state, label, counts):
        evidence = sum(counts.values())
        p = probability(counts[label], evidence) if label else 0.0
        self.assertEqual(state, row["state"])
        self.assertEqual(label, int(row["label"]))
        self.assertAlmostEqual(p, float(row["probability"]), places=8)
        self.assertAlmostEqual(variance(p, evidence) if label else 0.0, float(row["variance"]), places=8)
        self.assertAlmostEqual(evidence, float(row["evidence"]), places=6)
        for i in range(COMPONENTS):
            self.assertAlmostEqual(counts.get(i, 0.0), float(row[f"sigma_{i}"]), places=6)

    def test_one_point(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]))
        _, rows = self.query_rows(self.map_file, "x,y,z\n2.01,0.09,0.02\n2.15,0.05,0.05\n")
        self.assert_row(rows[0], "occupied", kitti.ROAD_LABEL, {kitti.ROAD_LABEL: 1.0})
        self.assert_row(rows[1], "unknown", 0, {})

    def test_points_that_disagree(self):
        self.map_scan(kitti.Scan([(2.02, 0.05, 0.05), (2.05, 0.05, 0.05), (2.08, 0.05, 0.05)],
                                 [kitti.ROAD, kitti.CAR, kitti.ROAD]))
        _, rows = self.query_rows(self.map_file, "x,y,z\n2.05,0.05,0.05\n")
        self.assert_row(rows[0], "occupied", kitti.ROAD_LABEL, {kitti.ROAD_LABEL: 2.0, kitti.CAR_LABEL: 1.0})

    def test_a_tie_goes_to_the_lower_class(self):
        self.map_scan(kitti.Scan([(2.02, 0.05, 0.05), (2.08, 0.05, 0.05)], [kitti.ROAD, kitti.CAR]))
        _, rows = self.query_rows(self.map_file, "x,y,z\n2.05,0.05,0.05\n")
        self.assert_row(rows[0], "occupied", kitti.CAR_LABEL, {kitti.ROAD_LABEL: 1.0, kitti.CAR_LABEL: 1.0})

    def test_an_unlabelled_point_occupies(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.UNLABELLED]))
        _, rows = self.query_rows(self.map_file, "x,y,z\n2.05,0.05,0.05\n")
        self.assert_row(rows[0], "occupied", 0, {kitti.UNLABELLED_COMPONENT: 1.0})

    def test_a_ray_frees_what_it_passes(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]), "--inference", "counting", "--free-space", "on",
                      "--free-weight", "0.5", "--prior", PRIOR)
        _, rows = self.query_rows(self.map_file, "x,y,z\n1.05,0.05,0.05\n2.05,0.05,0.05\n2.15,0.05,0.05\n")
        self.assert_row(rows[0], "free", 0, {0: 0.5})
        self.assertEqual(["free", "occupied", "unknown"], [row["state"] for row in rows])

    def test_negative_coordinates_round_down(self):
        self.map_scan(kitti.Scan([(-2.05, -0.05, -0.05)], [kitti.ROAD]))
        _, rows = self.query_rows(self.map_file, "x,y,z\n-2.01,-0.01,-0.01\n-2.05,0.05,-0.05\n")
        self.assertEqual(["occupied", "unknown"], [row["state"] for row in rows])

    def test_a_pose_moves_the_points(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD], pose=kitti.moved(10.0, -5.0, 1.0)))
        _, rows = self.query_rows(self.map_file, "x,y,z\n12.05,-4.95,1.05\n2.05,0.05,0.05\n")
        self.assertEqual(["occupied", "unknown"], [row["state"] for row in rows])

    def test_nowhere_is_unknown(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]))
        places = ("nan,0,0", "0,inf,0", "0,0,-inf", "1e300,0,0", "0,-1e39,0", "1e12,0,0", "0,0,1e400", "9e5,9e5,-9e5")
        _, rows = self.query_rows(self.map_file, "x,y,z\n" + "".join(place + "\n" for place in places))
        self.assertEqual(["unknown"] * len(places), [row["state"] for row in rows])
        for row in rows:
            self.assert_row(row, "unknown", 0, {})

    def test_blank_lines_and_windows_line_ends(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]))
        _, rows = self.query_rows(self.map_file, "x,y,z\r\n 2.05, 0.05 ,0.05\r\n\r\n+2.05,0.05,0.05")
        self.assertEqual(["occupied", "occupied"], [row["state"] for row in rows])

    def test_bad_tables(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]))
        points, out = self.folder / "bad.csv", self.folder / "bad-out.csv"
        for text, where in (("", "line 1"), ("a,b,c\n1,2,3\n", "line 1"), ("1,2,3\n", "line 1"),
                            ("x,y,z\n1,2,3\n1,2\n", "line 3"), ("x,y,z\n1,2,3,4\n", "line 2"),
                            ("x,y,z\n1,,3\n", "line 2"), ("x,y,z\n1,two,3\n", "line 2"), ("x,y,z\n1;2;3\n", "line 2")):
            with self.subTest(text):
                points.write_text(text)
                self.refused("query", "--map", self.map_file, "--points", points, "--out", out,
                             saying=("bad.csv", where))
                self.assertFalse(out.exists())

    def test_files_that_are_not_there(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]))
        points = self.folder / "points.csv"
        points.write_text("x,y,z\n")
        self.refused("query", "--map", self.map_file, "--points", self.folder / "absent.csv", "--out", "o.csv",
                     saying=("absent.csv",))
        self.refused("query", "--map", self.map_file, "--points", self.folder, "--out", "o.csv")
        self.refused("query", "--map", "absent.tsm", "--points", points, "--out", "o.csv", saying=("absent.tsm",))
        self.refused("query", "--map", self.map_file, "--points", points, "--out", "absent/o.csv", saying=("absent",))


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

    def test_hand_computed_input(self):
        _, report = self.evaluate()
        self.assertAlmostEqual(2 / 4, report["input_iou"]["road"])
        self.assertAlmostEqual(0.0, report["input_iou"]["car"])
        self.assertAlmostEqual(0.5 / 3, report["input_mean_iou"])

    def test_hand_computed_calibration(self):
        # A and B fall into different ones of the 15 bins.
        a, b = probability(2, 3), probability(1, 1)
        self.assertNotEqual(int(a * 15), int(b * 15))
        self.assertAlmostEqual((abs(2 - 3 * a) + abs(0 - b)) / 4, self.evaluate()[1]["calibration_error"])

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
        self.assertEqual(0.0, report["input_mean_iou"])

    def test_dataset_in_another_frame(self):
        T = self.folder / "T.txt"
        T.write_text("1 0 0 -100\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        kitti.write_poses(self.data, [kitti.moved(100.0)])
        self.assertEqual(0.0, self.evaluate()[1]["coverage"])
        self.assertAlmostEqual(4 / 6, self.evaluate("--transform", T)[1]["coverage"])
        T.write_text("2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        self.refused("eval", "--map", self.map_file, "--dataset", self.data, "--transform", T, saying=("rigid",))

    def test_overlap_of_two_maps(self):
        other = self.folder / "other.tsm"
        data = kitti.write_dataset(self.folder / "other", [kitti.Scan([self.B], [kitti.CAR])])
        self.map_dataset(data, other, *COUNTING)
        self.assertEqual(1, self.evaluate("--overlap-of", self.map_file, other)[1]["points"])

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
