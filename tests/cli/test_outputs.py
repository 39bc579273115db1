# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""An output never takes the place of an input or of another output, whatever name it goes by; and a place that cannot be
written to is told before the work."""
import os
import unittest

import kitti_folder as kitti
from command_case import CommandCase


class Outputs(CommandCase):
    def setUp(self):
        super().setUp()
        self.data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(1, count=40)])
        self.map_dataset(self.data, self.folder / "map.tsm")
        (self.folder / "points.csv").write_text("x,y,z\n1,2,3\n")
        (self.folder / "T.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        self.before = self.contents()

    def contents(self):
        return {str(p): p.read_bytes() for p in sorted(self.folder.rglob("*")) if p.is_file()}

    def kept(self, *arguments, saying=()):
        """Refused, and every file is as it was."""
        with self.subTest(" ".join(map(str, arguments))):
            self.refused(*arguments, saying=saying)
            self.assertEqual(self.before, self.contents())

    def test_the_map_that_is_read(self):
        query = ("query", "--map", "map.tsm", "--points", "points.csv")
        evaluate = ("eval", "--map", "map.tsm", "--dataset", self.data)
        same = ("the same file as", "map.tsm")
        self.kept("export", "--map", "map.tsm", "--format", "png", "--out", "map.tsm", saying=("--out", *same))
        self.kept("export", "--map", "map.tsm", "--format", "ply", "--out", "a.ply", "--report", "map.tsm",
                  saying=("--report", *same))
        self.kept(*query, "--out", "map.tsm", saying=("--out", *same))
        self.kept(*query, "--out", "a.csv", "--report", "map.tsm", saying=("--report", *same))
        self.kept(*evaluate, "--report", "map.tsm", saying=("--report", *same))
        self.kept("info", "map.tsm", "--report", "map.tsm", saying=("--report", *same))
        self.kept("map", "--dataset", self.data, "--out", "a.tsm", "--continue", "map.tsm", "--report", "map.tsm",
                  saying=("--report", *same))

    def test_other_files_that_are_read(self):
        self.kept("query", "--map", "map.tsm", "--points", "points.csv", "--out", "points.csv",
                  saying=("the same file as --points",))
        self.kept("eval", "--map", "map.tsm", "--dataset", self.data, "--transform", "T.txt", "--report", "T.txt",
                  saying=("the same file as --transform",))
        self.kept("eval", "--map", "map.tsm", "--dataset", self.data, "--overlap-of", "map.tsm", "map.tsm", "--report",
                  "map.tsm", saying=("the same file as",))

    def test_another_output(self):
        self.kept("map", "--dataset", self.data, "--out", "x.tsm", "--report", "x.tsm", saying=("the same file as --out",))
        self.kept("map", "--dataset", self.data, "--out", "x.tsm", "--report", "./x.tsm", saying=("the same file as --out",))
        self.kept("export", "--map", "map.tsm", "--format", "png", "--out", "x", "--report", "x",
                  saying=("the same file as --out",))

    def test_files_of_the_dataset(self):
        for name in ("poses.txt", "calib.txt", "classes.toml", "velodyne/000000.bin", "velodyne/new.bin",
                     "predictions/000000.label", "labels/000000.label"):
            path = self.data / name
            self.kept("map", "--dataset", self.data, "--out", path, saying=("--out", "dataset"))
            self.kept("map", "--dataset", self.data, "--out", "a.tsm", "--report", path, saying=("--report", "dataset"))
            self.kept("eval", "--map", "map.tsm", "--dataset", self.data, "--report", path, saying=("--report", "dataset"))

    def test_label_folders_of_other_names(self):
        (self.data / "labels").rename(self.data / "truth")
        self.before = self.contents()
        path = self.data / "truth" / "000000.label"
        self.kept("map", "--dataset", self.data, "--labels", "truth", "--out", path, saying=("--out", "dataset"))
        self.kept("eval", "--map", "map.tsm", "--dataset", self.data, "--truth", "truth", "--report", path,
                  saying=("--report", "dataset"))

    def test_other_names_of_the_same_file(self):
        os.symlink("map.tsm", self.folder / "soft")
        os.link(self.folder / "map.tsm", self.folder / "hard")
        os.symlink(self.data / "velodyne", self.folder / "scans")
        os.symlink(self.data, self.folder / "also")
        self.before = self.contents()
        for name in ("soft", "hard", "../" + self.folder.name + "/map.tsm", self.folder / "map.tsm"):
            self.kept("export", "--map", "map.tsm", "--format", "png", "--out", name, saying=("the same file as --map",))
        for name in ("scans/000000.bin", "also/poses.txt"):
            self.kept("map", "--dataset", self.data, "--out", name, saying=("dataset",))

    def test_beside_the_dataset_is_allowed(self):
        self.map_dataset(self.data, self.data / "map.tsm")
        self.map_dataset(self.data, self.data / "map.tsm", "--continue", self.data / "map.tsm")

    def test_unwritable_places_are_told_before_the_input_is_read(self):
        self.refused("export", "--map", "absent.tsm", "--format", "png", "--out", "nowhere/a.png", saying=("nowhere",))
        self.refused("query", "--map", "absent.tsm", "--points", "absent.csv", "--out", "nowhere/a.csv",
                     saying=("nowhere",))


if __name__ == "__main__":
    unittest.main()
