# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""map --submap-length and --corrections: a map in submaps is read as the one that their frames give."""
import csv
import json
import math
import signal
import subprocess
import unittest

import kitti_folder as kitti
from command_case import FAILURE, TIME_LIMIT_S, CommandCase, command_path

# Counts that add up exactly, whatever the order; nothing reaches a cap, and no scan contradicts what is in an ended submap.
EXACT = ("--inference", "counting", "--counts", "dense", "--max-evidence", 0, "--carving", "rays")
DRIVE = range(0, 60, 3)
SCANS = len(DRIVE)


def turned(degrees, x, y, z=0.0):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return (c, -s, 0.0, x, s, c, 0.0, y, 0.0, 0.0, 1.0, z)


def product(a, b):
    rows = [a[0:4], a[4:8], a[8:12]]
    other = [b[0:4], b[4:8], b[8:12], (0.0, 0.0, 0.0, 1.0)]
    return tuple(sum(row[k] * other[k][c] for k in range(4)) for row in rows for c in range(4))


class Submaps(CommandCase):
    def setUp(self):
        super().setUp()
        self.poses = [kitti.moved(float(x)) for x in DRIVE]
        self.data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(i, pose=pose) for i, pose in enumerate(self.poses)])

    def mapped(self, out, *options):
        return self.map_dataset(self.data, self.folder / out, *EXACT, *options)

    def in_submaps(self, out, *options):
        return self.mapped(out, "--submap-length", 12, *options)

    def write_poses(self, name, poses):
        (self.folder / name).write_text("".join(" ".join(repr(v) for v in pose) + "\n" for pose in poses))
        return self.folder / name

    def voxels(self, map_file):
        """Evidence by voxel."""
        self.done("export", "--map", map_file, "--format", "csv", "--voxels", "observed", "--out", "voxels.csv")
        with open(self.folder / "voxels.csv") as file:
            return {(row["x"], row["y"], row["z"]): tuple(row.values())[3:] for row in csv.DictReader(file)}

    def test_without_a_correction_it_is_the_map_in_one_piece(self):
        _, whole = self.mapped("whole.tsm")
        result, report = self.in_submaps("map.tsm")
        self.assertIn("submaps", result.stdout)
        submaps = report["submaps"]
        self.assertGreaterEqual(len(submaps), 4)
        self.assertEqual(list(range(len(submaps))), [s["number"] for s in submaps])
        self.assertEqual(12, report["config"]["submap_length"])
        # Each scan is in one of them.
        scans = [n for s in submaps for n in range(s["first_scan"], s["last_scan"] + 1)]
        self.assertEqual(list(range(SCANS)), scans)
        for s in submaps[:-1]:
            self.assertTrue(9 <= s["length_m"] <= 12, s)
        self.assertEqual(whole["totals"]["points_kept"], report["totals"]["points_kept"])
        self.assertEqual(self.voxels("whole.tsm"), self.voxels("map.tsm"))

    def test_a_map_that_is_not_in_submaps_has_the_bits_that_it_had(self):
        _, one = self.mapped("one.tsm")
        self.assertNotIn("submaps", one)
        _, long = self.mapped("long.tsm", "--submap-length", 1e5)
        self.assertEqual(1, len(long["submaps"]))
        self.assertEqual(one["digest"], long["submaps"][0]["digest"])

    def test_a_correction_moves_what_was_mapped_as_if_it_had_been_mapped_there(self):
        """By whole voxels, to the bit: also by a quarter of a turn."""
        for degrees, x, y in ((0, 3.0, -1.5), (90, 4.0, 2.0), (180, -2.0, 0.0)):
            with self.subTest(degrees):
                moved = [product(turned(degrees, x, y), pose) for pose in self.poses]
                _, report = self.in_submaps("map.tsm", "--corrections", self.write_poses("moved.txt", moved))
                (correction,) = report["corrections"]
                self.assertEqual(len(report["submaps"]), correction["submaps_moved"])
                self.assertLess(correction["residual_m"], 1e-3)
                self.assertEqual({2}, {s["revision"] for s in report["submaps"]})
                if degrees:
                    continue
                kitti.write_poses(self.data, moved)
                self.mapped("there.tsm")
                kitti.write_poses(self.data, self.poses)
                self.assertEqual(self.voxels("there.tsm"), self.voxels("map.tsm"))

    def test_each_correction_is_applied_after_its_last_scan_and_the_last_one_counts(self):
        """Odometry that drifts away, and a pose graph that gets better."""
        true = [kitti.moved(float(x)) for x in DRIVE]
        drifted = [turned(1.5 * i, 3.0 * i, 0.05 * i * i) for i in range(SCANS)]
        kitti.write_poses(self.data, drifted)
        files = [self.write_poses(f"until_{n}.txt", true[:n]) for n in (5, 12, SCANS)]
        _, report = self.in_submaps("map.tsm", *(o for f in files for o in ("--corrections", f)))
        self.assertEqual([4, 11, SCANS - 1], [c["after_scan"] for c in report["corrections"]])
        self.assertEqual([str(f) for f in files], [c["file"] for c in report["corrections"]])
        _, at_once = self.in_submaps("once.tsm", "--corrections", files[-1])
        self.assertEqual(at_once["digest"], report["digest"])
        self.assertEqual([s["T_map_submap"] for s in at_once["submaps"]], [s["T_map_submap"] for s in report["submaps"]])
        # Within a submap the drift stays: the frames meet the middle of each.
        self.assertLess(report["corrections"][-1]["residual_m"], 0.4)
        self.assertGreater(report["corrections"][0]["most_m"], 0.2)
        self.assertNotEqual(report["digest"], self.in_submaps("drifted.tsm")[1]["digest"])

    def test_scans_after_a_correction_go_on_from_its_last_pose(self):
        moved = [product(turned(0, 3.0, 0.0), pose) for pose in self.poses]
        _, report = self.in_submaps("map.tsm", "--corrections", self.write_poses("some.txt", moved[:6]))
        for submap in report["submaps"]:
            self.assertAlmostEqual(3.0, submap["T_map_submap"][3], 3)

    def test_a_corrected_trajectory_with_stamps(self):
        (self.data / "times.txt").write_text("".join(f"{0.5 * i}\n" for i in range(SCANS)))
        rows = "".join(f"{0.25 * i} {1.5 * i + 3.0} 0 0 0 0 0 1\n" for i in range(2 * SCANS))
        (self.folder / "stamped.txt").write_text(rows)
        _, report = self.in_submaps("map.tsm", "--corrections", "stamped.txt")
        (correction,) = report["corrections"]
        self.assertLess(correction["residual_m"], 1e-3)
        for submap in report["submaps"]:
            self.assertAlmostEqual(3.0, submap["T_map_submap"][3], 3)

    def test_rows_of_a_dataset_are_of_its_camera_as_its_poses_are(self):
        (self.data / "calib.txt").write_text("Tr: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 -0.3\n")
        _, report = self.in_submaps("map.tsm", "--corrections", self.data / "poses.txt")
        (correction,) = report["corrections"]
        self.assertLess(correction["most_m"], 1e-3)
        self.assertLess(correction["residual_m"], 1e-3)

    def test_stamps_where_scans_have_none(self):
        (self.folder / "stamped.txt").write_text("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n")
        self.map_refused(self.data, "--submap-length", 5, "--corrections", "stamped.txt", saying=("stamped.txt", "times.txt"))

    def test_every_command_reads_it(self):
        moved = [product(turned(30, 3.0, -1.5), pose) for pose in self.poses]
        _, report = self.in_submaps("map.tsm", "--corrections", self.write_poses("moved.txt", moved))
        info = self.done("info", "map.tsm", "--report", "info.json", "--verify").stdout
        self.assertIn(f"in {len(report['submaps'])} submaps", info)
        read = json.loads((self.folder / "info.json").read_text())
        self.assertEqual("submaps", read["kind"])
        self.assertEqual(report["digest"], read["digest"])
        self.assertEqual([s["T_map_submap"] for s in report["submaps"]], [s["T_map_submap"] for s in read["submaps"]])
        (self.folder / "t.txt").write_text("{} {} {} {}\n{} {} {} {}\n{} {} {} {}\n0 0 0 1\n".format(*turned(30, 3.0, -1.5)))
        self.done("eval", "--map", "map.tsm", "--dataset", self.data, "--transform", "t.txt", "--report", "eval.json")
        self.assertGreater(json.loads((self.folder / "eval.json").read_text())["coverage_any"], 0.7)
        (self.folder / "p.csv").write_text("x,y,z\n0,0,0\n")
        self.done("query", "--map", "map.tsm", "--points", "p.csv", "--out", "r.csv")
        for name in ("m.png", "m.ply"):
            self.done("export", "--map", "map.tsm", "--format", name[2:], "--out", name)

    def test_fuse_takes_the_submaps_in_their_frames(self):
        moved = [product(turned(0, 3.0, -1.5), pose) for pose in self.poses]
        self.in_submaps("a.tsm", "--corrections", self.write_poses("moved.txt", moved))
        self.mapped("b.tsm", "--robot", 1)
        kitti.write_poses(self.data, moved)
        self.mapped("c.tsm")
        for a in ("a.tsm", "c.tsm"):
            self.done("fuse", a, "b.tsm", "--diffusion", "none", "--out", f"with_{a}")
        self.assertEqual(self.voxels("with_c.tsm"), self.voxels("with_a.tsm"))
        # Two files of one robot are not one map.
        self.in_submaps("d.tsm")
        self.done("fuse", "a.tsm", "d.tsm", "--out", "both.tsm", "--report", "both.json")

    def test_what_does_not_go_together(self):
        self.map_refused(self.data, "--corrections", self.write_poses("p.txt", self.poses), saying=("--corrections", "--submap-length"))
        for option in (("--window", 10), ("--archive", "spill"), ("--continue", "x.tsm")):
            self.map_refused(self.data, "--submap-length", 5, *option, saying=("--submap-length", option[0]))
        for metres in (0.05, -1, 1e9):
            self.map_refused(self.data, "--submap-length", metres, saying=("--submap-length",))
        self.in_submaps("map.tsm")
        self.map_refused(self.data, "--continue", "map.tsm", saying=("map.tsm", "in submaps"))

    def test_corrections_that_are_none(self):
        for text in ("", "1 2 3\n", "a b c d e f g h i j k l\n"):
            (self.folder / "bad.txt").write_text(text)
            self.map_refused(self.data, "--submap-length", 5, "--corrections", "bad.txt", saying=("bad.txt",))
        self.map_refused(self.data, "--submap-length", 5, "--corrections", "none.txt", saying=("none.txt",))
        # Of a pose that is not rigid nothing is taken; of one that is absurd, no frame.
        rows = [kitti.moved(float("nan")) if i % 2 else kitti.moved(1e9) for i in range(SCANS)]
        _, report = self.in_submaps("map.tsm", "--corrections", self.write_poses("absurd.txt", rows))
        self.assertEqual(0, report["corrections"][0]["submaps_moved"])

    def test_a_file_that_is_damaged(self):
        self.in_submaps("map.tsm")
        sound = (self.folder / "map.tsm").read_bytes()
        for size in (0, 100, len(sound) // 2, len(sound) - 30, len(sound) - 1):
            with self.subTest(size):
                (self.folder / "cut.tsm").write_bytes(sound[:size])
                self.refused("export", "--map", "cut.tsm", "--format", "png", "--out", "x.png", saying=("cut.tsm",))
                self.refused("info", "cut.tsm", saying=("cut.tsm",))
        for at in range(4000, len(sound), len(sound) // 40):
            damaged = bytearray(sound)
            damaged[at] ^= 4
            (self.folder / "bad.tsm").write_bytes(damaged)
            self.refused("info", "bad.tsm", "--verify", saying=("bad.tsm",))

    def test_an_interrupted_run_has_the_submaps_so_far(self):
        scan = kitti.scattered_scan(1, count=20000)
        data = kitti.write_dataset(self.folder / "long", [scan] * 60)
        kitti.write_poses(data, [kitti.moved(1.0 * i) for i in range(60)])
        process = subprocess.Popen(
            [command_path(), "map", "--dataset", str(data), "--submap-length", "5", "--out", "map.tsm", "--report", "map.json"],
            cwd=self.folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertIn("mapping: 10 %", process.stderr.readline())
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=TIME_LIMIT_S)
        self.assertEqual(FAILURE, process.returncode, error)
        mapped = len(json.loads((self.folder / "map.json").read_text())["scans"])
        self.done("info", "map.tsm", "--verify", "--report", "info.json")
        self.assertEqual(mapped - 1, json.loads((self.folder / "info.json").read_text())["submaps"][-1]["last_scan"])


if __name__ == "__main__":
    unittest.main()
