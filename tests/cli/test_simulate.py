# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""simulate: a dataset a robot, which the other subcommands take as it is."""
import json
import os
import unittest

from command_case import CommandCase

FILES = ("velodyne/000000.bin", "labels/000000.label", "predictions/000000.label", "poses.txt", "T_global_map.txt")


class Simulate(CommandCase):
    def simulate(self, out, *options):
        self.done("simulate", "--scene", "street", "--robots", 2, "--scans", 1, "--out", out, *options)
        return self.folder / out

    def contents(self, out):
        return {str(p.relative_to(out)): p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}

    def test_two_robots(self):
        out = self.simulate("street", "--seed", 1)
        self.assertEqual(["robot_0", "robot_1"], sorted(p.name for p in out.iterdir() if p.is_dir()))
        for robot in ("robot_0", "robot_1"):
            for name in FILES:
                with self.subTest(robot=robot, name=name):
                    self.assertGreater((out / robot / name).stat().st_size, 0)
            points = (out / robot / "velodyne" / "000000.bin").stat().st_size // 16
            self.assertGreater(points, 1000)
            for folder in ("labels", "predictions"):
                self.assertEqual(points, (out / robot / folder / "000000.label").stat().st_size // 4)

    def test_the_seed_decides(self):
        one, again, other = (self.contents(self.simulate(name, "--seed", seed))
                             for name, seed in (("a", 1), ("b", 1), ("c", 2)))
        self.assertEqual(one, again)
        self.assertNotEqual(one, other)

    def test_the_result_can_be_mapped_and_judged(self):
        data = self.simulate("street", "--seed", 3) / "robot_0"
        result, _ = self.map_dataset(data, "map.tsm", "--memory", "256M")
        self.assert_not_warned(result)
        self.done("eval", "--map", "map.tsm", "--dataset", data, "--report", "eval.json")
        report = json.loads((self.folder / "eval.json").read_text())
        self.assertGreater(report["coverage"], 0.9)
        self.assertGreater(report["mean_iou"], 0.2)

    def test_the_report_has_every_option(self):
        self.simulate("street", "--seed", "18446744073709551615", "--pose-error", "0.5", "--rotation-error", "2",
                      "--report", "simulate.json")
        config = json.loads((self.folder / "simulate.json").read_text())["config"]
        self.assertEqual({"scene": "street", "robots": 2, "scans": 1, "seed": (1 << 64) - 1, "out": "street",
                          "apart": 60.0, "pose_error": 0.5, "rotation_error": 2.0, "cameras": "off", "sweep": "off", "topk": 0,
                          "report": "simulate.json"}, config)

    def test_a_report_does_not_replace_what_is_simulated(self):
        before = self.contents(self.simulate("street"))
        self.refused("simulate", "--scans", 1, "--out", "street", "--report", "street/robot_1/poses.txt",
                     saying=("--report", "poses.txt"))
        self.assertEqual(before, self.contents(self.folder / "street"))

    def test_a_perturbed_frame_beside_the_true_one(self):
        robot = self.simulate("street", "--pose-error", "0.5") / "robot_1"
        texts = [(robot / name).read_text() for name in ("T_global_map.txt", "T_global_map_perturbed.txt")]
        self.assertNotEqual(*texts)
        self.assertEqual([16, 16], [len(text.split()) for text in texts])

    def starts(self, out):
        """x of where each robot starts, in the street's frame."""
        return [float((out / robot / "T_global_map.txt").read_text().split()[3]) for robot in ("robot_0", "robot_1")]

    def test_how_far_apart_robots_start(self):
        for apart in (0, 60, 437.5, 2000):
            with self.subTest(apart=apart):
                first, second = self.starts(self.simulate("street", "--apart", apart))
                self.assertAlmostEqual(apart, second - first, places=6)
                self.assertAlmostEqual(0, second + first, places=6)
        self.assertIn("starts 2000 m apart", (self.folder / "street/robot_1/simulated.txt").read_text())

    def test_robots_start_60_m_apart_unless_asked_otherwise(self):
        usual, stated, other = (self.contents(self.simulate(name, *options))
                                for name, options in (("a", ()), ("b", ("--apart", 60)), ("c", ("--apart", 61))))
        self.assertEqual(usual, stated)
        self.assertNotEqual(usual, other)

    def test_a_distance_out_of_range_is_refused_with_the_range(self):
        self.refused("simulate", "--apart", 2000.5, "--out", "street", saying=("--apart", "2000.5", "metres from 0 to 2000"))

    def test_bad_usage(self):
        for option, value in (("--scene", "moon"), ("--robots", "0"), ("--robots", "-2"), ("--robots", "99"),
                              ("--scans", "0"), ("--scans", "-1"), ("--scans", "many"), ("--seed", "dice"), ("--seed", "-1"),
                              ("--apart", "-1"), ("--apart", "2001"), ("--apart", "nan"), ("--apart", "far"),
                              ("--pose-error", "-1"), ("--pose-error", "nan"), ("--pose-error", "1e+300"),
                              ("--rotation-error", "-1"), ("--rotation-error", "181")):
            with self.subTest(option=option, value=value):
                self.refused("simulate", f"{option}={value}", "--out", "street", saying=(option, value))
                self.assertFalse((self.folder / "street").exists())

    def test_what_somebody_else_put_there_is_not_replaced(self):
        scans = self.folder / "mine" / "robot_0" / "velodyne"
        scans.mkdir(parents=True)
        (scans / "000500.bin").write_bytes(b"mine")
        self.refused("simulate", "--scans", 1, "--out", "mine", saying=("robot_0", "not simulated"))
        self.assertEqual(["000500.bin"], [p.name for p in (self.folder / "mine").rglob("*") if p.is_file()])
        robot = self.simulate("street") / "robot_1"
        (robot / "calib.txt").write_text("Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")
        self.refused("simulate", "--scans", 1, "--out", "street", saying=("robot_1", "calib.txt"))

    def test_simulating_again_replaces_a_longer_run(self):
        self.done("simulate", "--robots", 1, "--scans", 3, "--out", "again")
        self.done("simulate", "--robots", 1, "--scans", 1, "--out", "again")
        self.done("simulate", "--robots", 1, "--scans", 1, "--out", "fresh")
        self.assertEqual(self.contents(self.folder / "fresh"), self.contents(self.folder / "again"))

    @unittest.skipIf(os.environ.get("TESSERA_SANITIZE"), "takes minutes with sanitizers")
    def test_a_map_knows_where_it_lies(self):
        street = self.simulate("street", "--seed", 3)
        for robot in (0, 1):
            data, out = street / f"robot_{robot}", f"map_{robot}.tsm"
            self.map_dataset(data, out, "--robot", robot, "--memory", "256M")
            self.done("info", out, "--report", "info.json")
            info = json.loads((self.folder / "info.json").read_text())
            given = [float(x) for x in (data / "T_global_map.txt").read_text().split()]
            self.assertEqual(given[:12], info["T_global_map"])
        result = self.done("eval", "--map", "map_0.tsm", "--dataset", street / "robot_0", "--overlap-of", "map_0.tsm",
                           "map_1.tsm")
        self.assert_not_warned(result)

    def test_unwritable_output(self):
        (self.folder / "file").write_text("")
        self.refused("simulate", "--scans", 1, "--out", "file", saying=("file",))
        self.refused("simulate", "--scans", 1, "--out", "file/street", saying=("file",))
        self.refused("simulate", "--scans", 1, "--out", "street", "--report", "absent/r.json", saying=("absent",))
        self.assertFalse((self.folder / "street").exists())


if __name__ == "__main__":
    unittest.main()
