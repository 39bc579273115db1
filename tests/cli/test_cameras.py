# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Labels from cameras, and scans swept while the robot drives: simulated, mapped, judged, and refused where files are
missing or wrong."""
import json
import pathlib
import shutil
import unittest

from command_case import USAGE, CommandCase


class Cameras(CommandCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.simulated = cls.class_folder()
        cls.simulate(cls.simulated, "--robots", 2, "--scans", 3, "--seed", 4, "--cameras", "on", "--sweep", "on")

    def setUp(self):
        super().setUp()
        # The second robot has 16 beams.
        self.data = self.folder / "s" / "robot_1"
        shutil.copytree(pathlib.Path(self.simulated) / "robot_1", self.data)

    def map(self, *options):
        self.done("map", "--dataset", self.data, "--out", "map.tsm", "--report", "map.json", "--memory", "128M", *options)
        return json.loads((self.folder / "map.json").read_text())

    def mean_iou(self, *options):
        self.done("eval", "--map", "map.tsm", "--dataset", self.data, "--report", "eval.json", *options)
        return json.loads((self.folder / "eval.json").read_text())["mean_iou"]

    def test_labels_of_cameras_make_a_map_about_as_good_as_labels_of_points(self):
        points = self.map()
        self.assertNotIn("projection", points["totals"])
        of_points = self.mean_iou()
        cameras = self.map("--labels", "cameras")
        self.assertEqual(0, cameras["heap_allocations_after_init"])
        self.assertEqual("cameras", cameras["config"]["labels"])
        total = cameras["totals"]["projection"]
        self.assertEqual(3, total["scans"])
        self.assertEqual(0, total["cameras_left_out"])
        self.assertGreater(total["labelled"], 0.7 * total["points"])
        self.assertEqual(3, len(cameras["scans"][0]["projection"]["cameras"]))
        of_cameras = self.mean_iou("--input", "cameras")
        self.assertGreater(of_cameras, 0.85 * of_points)

    def test_motion_is_taken_out_unless_told_otherwise(self):
        report = self.map()
        self.assertEqual(report["totals"]["points"], report["totals"]["deskew"]["moved"])
        self.assertEqual(0, report["totals"]["deskew"]["unplaced"])
        self.assertEqual(report["digest"], self.map("--deskew", "on")["digest"])
        whole = self.mean_iou()
        smeared = self.map("--deskew", "off")
        self.assertNotIn("deskew", smeared["totals"])
        self.assertNotEqual(report["digest"], smeared["digest"])
        self.assertGreater(whole, self.mean_iou() + 0.05)

    def test_what_is_missing_or_wrong_is_told_with_the_remedy(self):
        def refused(*options, saying):
            self.refused("map", "--dataset", self.data, "--out", "map.tsm", *options, saying=saying)

        refused("--deskew", "maybe", saying=("--deskew", "on or off"))
        toml = (self.data / "cameras.toml").read_text()
        (self.data / "cameras.toml").write_text(toml.replace('"fisheye"', '"fish"'))
        refused("--labels", "cameras", saying=("cameras.toml, line", '"pinhole" or "fisheye"'))
        (self.data / "cameras.toml").unlink()
        refused("--labels", "cameras", saying=("cameras.toml", "--labels"))
        (self.data / "cameras.toml").write_text(toml)
        image = self.data / "cameras" / "2" / "000001.png"
        image.write_bytes(image.read_bytes()[:-100])
        cut = self.run_command("map", "--dataset", self.data, "--out", "map.tsm", "--labels", "cameras")
        self.assertEqual(USAGE, cut.returncode)
        self.assertRegex(cut.stderr.splitlines()[-1], "000001.png is not an intact PNG.*complete copy")
        self.assertFalse((self.folder / "map.tsm").exists())
        image.unlink()
        refused("--labels", "cameras", saying=("000001.png", "'rear'"))
        (self.data / "times" / "000001.bin").write_bytes(b"1234")
        refused(saying=("000001.bin", "--deskew off"))
        shutil.rmtree(self.data / "times")
        refused("--deskew", "on", saying=("times", "--deskew off"))
        self.refused("simulate", "--cameras", "yes", "--out", "t", saying=("--cameras", "on or off"))

    def test_a_run_without_them_leaves_no_cameras_and_no_times(self):
        self.done("simulate", "--robots", 2, "--scans", 2, "--seed", 4, "--out", "s")
        left = sorted(p.name for p in self.data.iterdir())
        self.assertEqual(["T_global_map.txt", "labels", "poses.txt", "predictions", "simulated.txt", "times.txt",
                          "velodyne"], left)


if __name__ == "__main__":
    unittest.main()
