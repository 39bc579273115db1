# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""query, on voxels few enough to compute by hand."""
import unittest

import kitti_folder as kitti
from command_case import CommandCase
from counting import COMPONENTS, COUNTING, PRIOR, effective_number, effective_probability, probability, variance


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

    def test_columns_of_probabilities(self):
        """Of an unknown voxel all are as likely; of a known one the label has its own; they sum to one."""
        self.map_scan(kitti.Scan([(2.02, 0.05, 0.05), (2.05, 0.05, 0.05), (2.08, 0.05, 0.05)], [kitti.ROAD, kitti.CAR, kitti.ROAD]))
        points = "x,y,z\n2.05,0.05,0.05\n900,0,0\n"
        plain, _ = self.query_rows(self.map_file, points)
        columns, rows = self.query_rows(self.map_file, points, "--probabilities")
        names = [f"probability_{i}" for i in range(COMPONENTS)]
        self.assertEqual(plain + names, columns)
        self.assertAlmostEqual(probability(2.0, 3.0), float(rows[0][names[kitti.ROAD_LABEL]]), places=8)
        self.assertAlmostEqual(probability(1.0, 3.0), float(rows[0][names[kitti.CAR_LABEL]]), places=8)
        self.assertEqual(rows[0]["probability"], rows[0][names[kitti.ROAD_LABEL]])
        for row in rows:
            self.assertAlmostEqual(1.0, sum(float(row[name]) for name in names), places=6)
        self.assertEqual(1, len({rows[1][name] for name in names}))

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

    def test_probabilities_of_a_map_of_kernels(self):
        """Road and pole beside each other; the map comes from its file."""
        data = kitti.write_dataset(self.folder / "data", [kitti.Scan([(2.05, 0.05, 0.05), (2.15, 0.05, 0.05)], [kitti.ROAD, kitti.POLE])])
        for mode, around in (("lattice", 0.9), ("multi-entropy", 0.0)):
            _, report = self.map_dataset(data, self.map_file, "--counts", "dense", "--inference", mode)
            self.assertEqual(around, report["calibration"]["around"])
            worth = [1.0, *report["calibration"]["worth"].values(), 0.75]
            _, rows = self.query_rows(self.map_file, "x,y,z\n2.05,0.05,0.05\n2.15,0.05,0.05\n")
            for row in rows:
                sigma = [float(row[f"sigma_{i}"]) for i in range(COMPONENTS)]
                p = effective_probability(int(row["label"]), sigma, worth, around)
                self.assertAlmostEqual(p, float(row["probability"]), places=6)
                self.assertAlmostEqual(variance(p, effective_number(sigma, around)), float(row["variance"]), places=6)
                self.assertNotAlmostEqual(probability(max(sigma), sum(sigma)), p, places=2)

    def test_says_how_probabilities_come_about(self):
        data = kitti.write_dataset(self.folder / "data", [kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD])])
        _, report = self.map_dataset(data, self.map_file)
        self.assertEqual("effective", report["calibration"]["probabilities"])
        worth = report["calibration"]["worth"]
        self.assertEqual(19, len(worth))
        self.assertGreater(worth["road"], worth["terrain"])
        self.assertGreater(worth["terrain"], worth["pole"])
        for options in (("--inference", "counting"), ("--prior", "0")):
            _, report = self.map_dataset(data, self.map_file, *options)
            self.assertEqual({"probabilities": "shares"}, report["calibration"])

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

    def test_a_point_on_a_border_is_in_the_voxel_that_begins_there(self):
        self.map_scan(kitti.Scan([(2.15, 0.05, 0.05)], [kitti.ROAD]))
        _, rows = self.query_rows(self.map_file, "x,y,z\n2.1,0.0,0\n2.0999999999,0,0\n2.2,0,0\n")
        self.assertEqual(["occupied", "unknown", "unknown"], [row["state"] for row in rows])

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

    def test_a_byte_order_mark_is_skipped(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]))
        _, rows = self.query_rows(self.map_file, "\ufeffx,y,z\n2.05,0.05,0.05\n")
        self.assertEqual(["occupied"], [row["state"] for row in rows])

    def test_files_that_are_not_there(self):
        self.map_scan(kitti.Scan([(2.05, 0.05, 0.05)], [kitti.ROAD]))
        points = self.folder / "points.csv"
        points.write_text("x,y,z\n")
        self.refused("query", "--map", self.map_file, "--points", self.folder / "absent.csv", "--out", "o.csv",
                     saying=("absent.csv",))
        self.refused("query", "--map", self.map_file, "--points", self.folder, "--out", "o.csv",
                     saying=("folder",))
        self.refused("query", "--map", "absent.tsm", "--points", points, "--out", "o.csv", saying=("absent.tsm",))
        self.refused("query", "--map", self.map_file, "--points", points, "--out", "absent/o.csv", saying=("absent",))


if __name__ == "__main__":
    unittest.main()
