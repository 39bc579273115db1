# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""align, and fuse --align: frames that are found from the maps, or refused with the reason."""
import json
import math
import pathlib
import shutil
import subprocess
import unittest

import kitti_folder as kitti
from command_case import FAILURE, TIME_LIMIT_S, USAGE, CommandCase, command_path

SCANS = 16
SEED = 16


def read_matrix(path):
    return [[float(word) for word in line.split()] for line in path.read_text().splitlines()]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def inverse(T):
    R = [[T[j][i] for j in range(3)] for i in range(3)]
    t = [-sum(R[i][k] * T[k][3] for k in range(3)) for i in range(3)]
    return [R[i] + [t[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def shifted(x_m, y_m):
    return [[1.0, 0.0, 0.0, x_m], [0.0, 1.0, 0.0, y_m], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]


def off(T, truth, p_b):
    """Metres at a point of b, and degrees."""
    def there(M):
        return [sum(M[i][k] * [*p_b, 1.0][k] for k in range(4)) for i in range(3)]
    between = product(inverse(truth), T)
    cosine = (between[0][0] + between[1][1] + between[2][2] - 1.0) / 2.0
    return math.dist(there(T), there(truth)), math.degrees(math.acos(min(1.0, cosine)))


class Align(CommandCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        shared = pathlib.Path(cls.class_folder())
        street = cls.street = shared / "street"
        cls.simulate(street, "--robots", 2, "--scans", SCANS, "--seed", SEED)
        cls.labelled, cls.unlabelled = ([cls.make_map(shared, street, robot, labels) for robot in (0, 1)] for labels in ("predictions", "none"))
        cls.frames = [read_matrix(street / f"robot_{robot}" / "T_global_map.txt") for robot in (0, 1)]
        cls.truth = product(inverse(cls.frames[0]), cls.frames[1])

    @staticmethod
    def make_map(folder, street, robot, labels):
        out = folder / f"{labels}_{robot}.tsm"
        subprocess.run([command_path(), "map", "--dataset", street / f"robot_{robot}", "--out", out, "--resolution", "0.2", "--robot", str(robot),
                        "--labels", labels, "--memory", "400M"], check=True, capture_output=True, timeout=TIME_LIMIT_S)
        return out

    def setUp(self):
        super().setUp()
        self.maps = self.labelled

    def align(self, *options):
        result = self.done("align", *self.maps, "--report", "align.json", *options)
        return result, json.loads((self.folder / "align.json").read_text())

    def test_a_frame_is_found_and_written(self):
        result, report = self.align("--out", "T.txt", "--png", "both.png")
        self.assertIn("found", result.stdout)
        self.assertRegex(result.stderr, r"aligning.*100 %")
        self.assertTrue(report["accepted"])
        self.assertIsNone(report["reason"])
        T = read_matrix(self.folder / "T.txt")
        self.assertEqual(report["transform"], [value for row in T for value in row])
        shift_m, turn_deg = off(T, self.truth, (0.0, 0.0, 0.0))
        self.assertLess(shift_m, 0.3)
        self.assertLess(turn_deg, 0.5)
        self.assertEqual(36, len(report["covariance"]))
        self.assertLess(report["sigma_m"], 0.1)
        # Both maps say where they are, and that was right.
        self.assertAlmostEqual(report["agreement"]["share"], report["agreement_before"]["share"], delta=0.02)
        self.assertGreater((self.folder / "both.png").stat().st_size, 10_000)

    def test_the_same_maps_give_the_same_bytes(self):
        self.align("--out", "T.txt")
        first = (self.folder / "T.txt").read_bytes(), (self.folder / "align.json").read_bytes()
        self.align("--out", "T.txt")
        self.assertEqual(first, ((self.folder / "T.txt").read_bytes(), (self.folder / "align.json").read_bytes()))

    def test_a_guess_is_enough_to_look_near(self):
        guess = [row[:] for row in self.truth]
        guess[0][3] += 2.0
        guess[1][3] -= 1.0
        (self.folder / "guess.txt").write_text("\n".join(" ".join(map(repr, row)) for row in guess))
        _, report = self.align("--guess", "guess.txt")
        self.assertTrue(report["accepted"])
        self.assertLess(off([report["transform"][4 * i:4 * i + 4] for i in range(4)], self.truth, (0.0, 0.0, 0.0))[0], 0.3)
        self.assertGreater(report["agreement"]["share"], report["agreement_before"]["share"])

    def test_maps_of_nothing_in_common_are_refused_with_the_reason(self):
        corner = kitti.write_dataset(self.folder / "corner", [kitti.corner_scan(seed=5, count=4000)])
        self.map_dataset(corner, "corner.tsm", "--resolution", 0.2)
        result = self.run_command("align", self.maps[0], "corner.tsm", "--out", "T.txt", "--report", "align.json")
        self.assertEqual(FAILURE, result.returncode)
        self.assertIn("are not aligned: ", result.stderr)
        self.assertIn("best place, not accepted: corner.tsm is moved by", result.stdout)
        self.assertFalse((self.folder / "T.txt").exists())
        report = json.loads((self.folder / "align.json").read_text())
        self.assertFalse(report["accepted"])
        self.assertIn(report["reason"], result.stderr)
        # And fuse places nothing that it could not find.
        result = self.run_command("fuse", self.maps[0], "corner.tsm", "--align", "--out", "global.tsm")
        self.assertEqual(FAILURE, result.returncode)
        self.assertIn("could not be placed", result.stderr)
        self.assertFalse((self.folder / "global.tsm").exists())

    def test_bad_input(self):
        (self.folder / "bad.txt").write_text("1 2 3")
        for words, text in (((self.maps[0],), "MAPS"), ((self.maps[0], "missing.tsm"), "missing.tsm"),
                            ((*self.maps, "--guess", "bad.txt"), "instead of 16"), ((*self.maps, "--out", self.maps[0]), "--out")):
            result = self.run_command("align", *words)
            self.assertEqual(USAGE, result.returncode, words)
            self.assertIn(text, result.stderr)

    def fuse(self, *options):
        result = self.done("fuse", *self.maps, "--out", "global.tsm", "--report", "fuse.json", *options)
        return result, json.loads((self.folder / "fuse.json").read_text())

    def transform_of(self, robot, T):
        path = self.folder / f"given_{robot}.txt"
        path.write_text("\n".join(" ".join(map(repr, row)) for row in T))
        return "--transform", f"{self.maps[robot]}={path}"

    def test_fuse_finds_frames_that_nobody_gave(self):
        # The second map is said to be somewhere else altogether.
        wrong = product([[0.0, -1.0, 0.0, 3.0], [1.0, 0.0, 0.0, -20.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]], self.frames[1])
        result, report = self.fuse("--align", *self.transform_of(0, self.frames[0]), *self.transform_of(1, wrong))
        self.assertNotIn("warning", result.stderr)
        self.assertRegex(result.stderr, r"finding frames.*100 %.*pair 1 of 1")
        first, second = report["contributions"]
        self.assertEqual(first["T_global_map"], [value for row in self.frames[0][:3] for value in row])
        found = [second["T_global_map"][4 * i:4 * i + 4] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
        self.assertLess(off(found, self.frames[1], (0.0, 0.0, 0.0))[0], 0.3)
        self.assertTrue(report["frames"][0]["accepted"])
        self.assertTrue(report["config"]["align"])
        _, given = self.fuse()
        self.assertAlmostEqual(given["overlap_voxels"], report["overlap_voxels"], delta=0.1 * given["overlap_voxels"])

    def test_fuse_searches_about_given_frames_however_far_from_each_other_maps_begin(self):
        """The origin of the second map's frame is 90 m from where that robot began: beyond the reach of a search about nothing."""
        FAR_M = 90.0
        moved = shutil.copytree(self.street / "robot_1", self.folder / "far" / "robot_1")
        rows = [[float(word) for word in line.split()] for line in (moved / "poses.txt").read_text().splitlines()]
        (moved / "poses.txt").write_text("\n".join(" ".join(repr(number + (FAR_M if i == 3 else 0.0)) for i, number in enumerate(row)) for row in rows))
        self.maps = [self.labelled[0], self.make_map(self.folder, self.folder / "far", 1, "predictions")]
        frame = product(self.frames[1], shifted(-FAR_M, 0.0))
        # What is given is 5 m off, where a search near it is enough, or 28 m.
        for wrong in shifted(4.0, -3.0), shifted(25.0, -12.0):
            _, report = self.fuse("--align", *self.transform_of(0, self.frames[0]), *self.transform_of(1, product(wrong, frame)))
            found = [report["contributions"][1]["T_global_map"][4 * i:4 * i + 4] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
            self.assertLess(off(found, frame, (FAR_M, 0.0, 0.0))[0], 0.3)
        result = self.run_command("fuse", *self.maps, "--align", "--out", "global.tsm", *self.transform_of(0, shifted(0.0, 0.0)),
                                  *self.transform_of(1, shifted(0.0, 0.0)))
        self.assertEqual(FAILURE, result.returncode, result.stderr)

    def test_fuse_tells_a_turn_from_a_shift(self):
        result, _ = self.fuse()
        self.assertNotIn("misaligned", result.stderr)
        c, s = math.cos(math.radians(4.0)), math.sin(math.radians(4.0))
        turned = product(self.frames[1], [[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
        result, report = self.fuse(*self.transform_of(1, turned))
        self.assertIn("are misaligned", result.stderr)
        self.assertRegex(result.stderr, r"turned by -(3\.[5-9]|4\.[0-5]) degrees about z")
        frame = report["frames"][0]
        self.assertGreater(frame["agreement"]["share"], frame["agreement_before"]["share"])

    def test_fuse_judges_maps_without_labels_too(self):
        self.maps = self.unlabelled
        moved = [row[:] for row in self.frames[1]]
        moved[0][3] += 0.6
        result, _ = self.fuse(*self.transform_of(1, moved))
        self.assertIn("are misaligned", result.stderr)
        self.assertRegex(result.stderr, r"moved by -0\.[567]\d, -?0\.[01]")


if __name__ == "__main__":
    unittest.main()
