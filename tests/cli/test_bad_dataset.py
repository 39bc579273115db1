# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Datasets that are incomplete or damaged: what cannot be used is refused, what can be left out is counted."""
import math
import shutil
import unittest

import kitti_folder as kitti
from command_case import USAGE, CommandCase


class RefusedDataset(CommandCase):
    def setUp(self):
        super().setUp()
        self.data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(1), kitti.corner_scan(2)])

    def test_missing_folder(self):
        self.map_refused(self.folder / "absent", saying=("absent", "does not exist"))

    def test_file_in_place_of_the_folder(self):
        self.map_refused(self.data / "poses.txt", saying=("poses.txt",))

    def test_missing_velodyne(self):
        shutil.rmtree(self.data / "velodyne")
        self.map_refused(self.data, saying=("velodyne", "does not exist"))

    def test_empty_velodyne(self):
        for scan in (self.data / "velodyne").iterdir():
            scan.unlink()
        self.map_refused(self.data, saying=("velodyne", "no scans"))

    def test_missing_poses(self):
        (self.data / "poses.txt").unlink()
        self.map_refused(self.data, saying=("poses.txt", "does not exist"))

    def test_a_frame_that_is_not_rigid(self):
        (self.data / "T_global_map.txt").write_text("2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        self.map_refused(self.data, saying=("T_global_map.txt", "rigid"))

    def test_a_folder_in_place_of_a_scan(self):
        (self.data / "velodyne" / "000002.bin").mkdir()
        self.map_refused(self.data, saying=("000002.bin", "not a regular file"))

    def test_fewer_poses_than_scans(self):
        kitti.write_poses(self.data, [kitti.IDENTITY])
        self.map_refused(self.data, saying=("poses.txt", "1 poses", "--last"))

    def test_pose_row_with_too_few_numbers(self):
        kitti.write_poses(self.data, [kitti.IDENTITY, kitti.IDENTITY[:11]])
        self.map_refused(self.data, saying=("poses.txt", "line 2", "11 numbers"))

    def test_pose_row_with_a_word(self):
        kitti.write_poses(self.data, [kitti.IDENTITY, ("north",) + kitti.IDENTITY[1:]])
        self.map_refused(self.data, saying=("poses.txt", "line 2", "a word is not a number"))

    def test_truncated_scan(self):
        scan = self.data / "velodyne" / "000001.bin"
        scan.write_bytes(scan.read_bytes()[:-5])
        self.map_refused(self.data, saying=("000001.bin", "truncated"))

    def test_label_count_that_differs(self):
        labels = self.data / "predictions" / "000001.label"
        labels.write_bytes(labels.read_bytes()[:-4])
        self.map_refused(self.data, saying=("000001.label", "299 labels", "300 points"))

    def test_missing_label_file(self):
        (self.data / "predictions" / "000001.label").unlink()
        self.map_refused(self.data, saying=("000001.label",))

    def test_missing_named_label_folder(self):
        self.map_refused(self.data, "--labels", "guesses", saying=("guesses", "does not exist", "--labels"))

    def test_missing_default_label_folder(self):
        shutil.rmtree(self.data / "predictions")
        self.map_refused(self.data, saying=("predictions", "does not exist"))

    def test_no_scan_in_range(self):
        self.map_refused(self.data, "--first", 7, saying=("--first",))
        self.map_refused(self.data, "--first", 1, "--last", 0, saying=("--first 1", "--last 0"))
        self.map_refused(self.data, "--first", -1, saying=("--first", "from 0"))

    def test_damaged_class_table(self):
        (self.data / "classes.toml").write_text("[[class]\nid = 1\n")
        self.map_refused(self.data, saying=("classes.toml",))

    def test_refusal_keeps_an_earlier_output(self):
        out = self.folder / "kept.tsm"
        self.map_dataset(self.data, out)
        before = out.read_bytes()
        (self.data / "poses.txt").unlink()
        self.refused("map", "--dataset", self.data, "--out", out)
        self.assertEqual(before, out.read_bytes())


class CountedDataset(CommandCase):
    def map_scans(self, scans, *options):
        data = kitti.write_dataset(self.folder / "data", scans)
        return self.map_dataset(data, self.folder / "map.tsm", *options)

    def test_points_that_are_not_finite_are_counted(self):
        good = kitti.corner_scan(1)
        bad = kitti.corner_scan(1)
        for i, value in enumerate((math.nan, math.inf, -math.inf)):
            point = [5.0, 0.0, 0.0]
            point[i] = value
            bad.points.append(tuple(point))
            bad.predicted.append(kitti.ROAD)
            bad.true.append(kitti.ROAD)
        result, report = self.map_scans([bad])
        self.assert_warned(result, "3 of 303 points refused: coordinates that are not finite")
        self.assertEqual(3, report["scans"][0]["non_finite"])
        self.assertEqual(3, report["totals"]["non_finite"])
        _, clean = self.map_scans([good])
        self.assertEqual(clean["digest"], report["digest"], "a refused point left a trace")

    def test_points_on_the_sensor_are_counted(self):
        scan = kitti.corner_scan(1)
        scan.points.append((0.2, 0.2, 0.2))
        for ids in (scan.predicted, scan.true):
            ids.append(kitti.ROAD)
        result, report = self.map_scans([scan])
        self.assert_warned(result, "1 of 301 points refused: nearer to the sensor than --min-range")
        self.assertEqual(1, report["totals"]["too_near"])
        result, _ = self.map_scans([scan], "--min-range", "0")
        self.assert_not_warned(result)

    def test_a_map_of_next_to_no_point_is_warned_about_first(self):
        scan = kitti.corner_scan(1)
        in_mm = [tuple(1000 * axis for axis in point) for point in scan.points]
        result, _ = self.map_scans([kitti.Scan([*in_mm, (2.0, 0.0, 0.0), (0.0, 0.0, 0.0)], [*scan.predicted, kitti.ROAD, kitti.ROAD])])
        first, *_ = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
        self.assertEqual("warning: almost no point was mapped: 300 of 302 points are beyond --max-range; give a larger one, or points in metres", first)
        self.assert_warned(result, "1 of 302 points refused: nearer to the sensor than --min-range, at 0, 0, 0 (no return)")

    def test_labels_that_are_all_zero_are_warned_about(self):
        bare = kitti.Scan(kitti.corner_scan(1).points, [kitti.UNLABELLED] * 300)
        result, _ = self.map_scans([bare])
        self.assert_warned(result, "no label was mapped: all 300 points in range are unlabelled in predictions")
        self.assert_not_warned(self.map_scans([bare], "--labels", "none")[0])

    def test_unknown_class_ids_count_as_unlabelled(self):
        scan = kitti.corner_scan(1)
        scan.predicted[:4] = [7, 300, 65535, 7]
        result, report = self.map_scans([scan])
        self.assert_warned(result, "4 points with class ids that are in no class (7, 300, 65535), first in scan 0")
        self.assertEqual(4, report["totals"]["unknown_ids"])
        scan.predicted[:4] = [kitti.UNLABELLED] * 4
        _, unlabelled = self.map_scans([scan])
        self.assertEqual(unlabelled["digest"], report["digest"])

    def test_instance_ids_are_not_part_of_the_class(self):
        scan = kitti.corner_scan(1)
        _, plain = self.map_scans([scan])
        scan.predicted = [(17 << 16) | raw for raw in scan.predicted]
        result, report = self.map_scans([scan])
        self.assert_not_warned(result)
        self.assertEqual(plain["digest"], report["digest"])

    def test_a_scan_whose_pose_is_not_rigid_is_left_out(self):
        stretched = (2.0,) + kitti.IDENTITY[1:]
        mirrored = (-1.0,) + kitti.IDENTITY[1:]
        unknown = ("nan",) + kitti.IDENTITY[1:]
        nowhere = kitti.IDENTITY[:3] + ("inf",) + kitti.IDENTITY[4:]
        for name, pose in {"stretched": stretched, "mirrored": mirrored, "nan": unknown, "inf": nowhere}.items():
            with self.subTest(name):
                result, report = self.map_scans([kitti.corner_scan(1), kitti.corner_scan(2, pose=pose)])
                self.assert_warned(result, "1 scan left out", "pose", ": 1")
                self.assertEqual(1, report["totals"]["bad_poses"])
                self.assertEqual(["ok", "refused"], [scan["pose"] for scan in report["scans"]])
                self.assertEqual(0, report["scans"][1]["voxel_updates"])
                _, alone = self.map_scans([kitti.corner_scan(1)], "--last", 0)
                self.assertEqual(alone["digest"], report["digest"], "a refused scan left a trace")

    def test_a_pose_out_of_the_grid_refuses_its_points(self):
        result, report = self.map_scans([kitti.corner_scan(1, pose=kitti.moved(1e9)), kitti.corner_scan(2)])
        self.assert_warned(result, "1 scan left out, with a pose outside the grid: 0; subtract an origin")
        self.assertEqual(1, report["totals"]["bad_poses"])
        _, alone = self.map_scans([kitti.corner_scan(1, pose=kitti.moved(1e9)), kitti.corner_scan(2)], "--first", 1)
        self.assertEqual(alone["digest"], report["digest"], "a refused scan left a trace")

    def test_a_range_without_a_usable_pose_leaves_no_map(self):
        """Beyond the grid's reach, or not rigid: they need other remedies."""
        poses = (kitti.moved(5e5, 4.2e6), (2.0, *kitti.IDENTITY[1:]), kitti.IDENTITY)
        data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(1, pose=pose) for pose in poses])
        for first, last, reason, remedy in ((0, 0, "1 pose is within the grid, which reaches 839 km from 0, 0, 0;", "subtract an origin"),
                                            (1, 1, "1 pose is a rigid transform;", "check the poses"),
                                            (0, 1, "2 poses is a rigid transform within the grid;", "check the poses")):
            result = self.run_command("map", "--dataset", data, "--first", first, "--last", last, "--out", "no.tsm")
            self.assertEqual(USAGE, result.returncode)
            self.assertIn(f"tessera: no scan is in the map: not one of {reason} {remedy}", result.stderr.splitlines()[-1])
            self.assertFalse((self.folder / "no.tsm").exists())

    def test_many_bad_poses_are_told_in_one_line(self):
        bad = [kitti.Scan([], [], pose=("nan",) + kitti.IDENTITY[1:]) for _ in range(12)]
        result, report = self.map_scans(bad + [kitti.corner_scan(1)])
        self.assert_warned(result, "12 scans left out", ": 0, 1, 2, 3, 4, 5, 6, 7, ...")
        self.assertEqual(12, report["totals"]["bad_poses"])

    def test_a_dataset_without_a_rigid_pose_is_refused(self):
        data = kitti.write_dataset(self.folder / "data", [kitti.Scan([], [], pose=("nan",) + kitti.IDENTITY[1:])] * 3)
        self.refused("map", "--dataset", data, "--out", "no.tsm", saying=("poses.txt", "none of its 3 poses is a rigid transform"))

    def test_an_empty_scan_is_a_scan(self):
        _, report = self.map_scans([kitti.Scan([], []), kitti.corner_scan(1)])
        self.assertEqual([0, 300], [scan["points"] for scan in report["scans"]])
        self.assertGreater(report["memory"]["label_voxels"], 0)

    def test_a_dataset_of_empty_scans_gives_an_empty_map(self):
        _, report = self.map_scans([kitti.Scan([], [])])
        self.assertEqual(0, report["memory"]["label_voxels"])
        self.assertEqual(0, report["memory"]["bytes_per_label_voxel"])

    def test_missing_scan_numbers_are_told(self):
        data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(i) for i in range(3)])
        (data / "velodyne" / "000001.bin").unlink()
        result, report = self.map_dataset(data, self.folder / "map.tsm")
        self.assert_warned(result, "no scans 1")
        self.assertEqual([0, 2], [scan["index"] for scan in report["scans"]])


if __name__ == "__main__":
    unittest.main()
