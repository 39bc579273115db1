# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""fuse: sums by hand, frames, what is refused, and that neither the order nor the name of a map matters."""
import json
import math
import struct
import unittest

import kitti_folder as kitti
from command_case import CommandCase, crc32c
from counting import COUNTING

FUSE_KEYS = {"voxels", "overlap_voxels", "iterations", "residual", "milliseconds", "digest", "mean_variance",
             "mean_variance_undiffused", "alignment"}
ROAD, CAR, BUILDING = f"sigma_{kitti.ROAD_LABEL}", f"sigma_{kitti.CAR_LABEL}", f"sigma_{kitti.BUILDING_LABEL}"


def turned(degrees, x=0.0, y=0.0, z=0.0):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return [[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]]


class Fuse(CommandCase):
    """A and B see one place: A a road, B the road and a car of its own; each alone sees a building."""
    SHARED, OF_B, ALONE_A, ALONE_B = (2.05, 0.05, 0.05), (2.15, 0.05, 0.05), (20.05, 0.05, 0.05), (30.05, 0.05, 0.05)

    def make_map(self, name, points, ids, *options):
        folder = kitti.write_dataset(self.folder / f"data_{name}", [kitti.Scan(points, ids)])
        map_file = self.folder / f"{name}.tsm"
        self.map_dataset(folder, map_file, *COUNTING, *options)
        return map_file

    def setUp(self):
        super().setUp()
        self.a = self.make_map("a", [self.SHARED, self.ALONE_A], [kitti.ROAD, kitti.BUILDING])
        self.b = self.make_map("b", [self.SHARED, (2.06, 0.05, 0.05), self.OF_B, self.ALONE_B],
                               [kitti.ROAD, kitti.ROAD, kitti.CAR, kitti.BUILDING], "--robot", "1")
        self.out = self.folder / "global.tsm"

    def fuse(self, *words):
        report = self.folder / "fuse.json"
        result = self.done("fuse", *words, "--out", self.out, "--report", report)
        return result, json.loads(report.read_text())

    def row(self, p):
        return self.query_rows(self.out, "x,y,z\n%g,%g,%g\n" % p)[1][0]

    def test_has_every_key_of_the_contract(self):
        self.assertLessEqual(FUSE_KEYS, self.fuse(self.a, self.b)[1].keys())

    def test_plain_sum_by_hand(self):
        _, report = self.fuse(self.a, self.b, "--diffusion", "none")
        self.assertEqual(4, report["voxels"])
        self.assertEqual(2, report["overlap_voxels"])
        shared, alone = self.row(self.SHARED), self.row(self.ALONE_B)
        self.assertAlmostEqual(3.0, float(shared[ROAD]), places=4)
        self.assertEqual("occupied", alone["state"])
        self.assertAlmostEqual(1.0, float(alone[BUILDING]), places=4)
        self.assertEqual(report["mean_variance"], report["mean_variance_undiffused"])

    def test_diffusion_keeps_evidence_and_makes_no_voxels(self):
        _, report = self.fuse(self.a, self.b)
        self.assertEqual(4, report["voxels"])
        self.assertGreater(report["residual"], 0.0)
        shared, car = self.row(self.SHARED), self.row(self.OF_B)
        self.assertAlmostEqual(3.0, float(shared["evidence"]), places=2)
        self.assertAlmostEqual(1.0, float(car["evidence"]), places=2)
        self.assertGreater(float(shared[CAR]), 0.0)  # of its neighbour
        self.assertGreater(float(car[ROAD]), 0.0)
        self.assertAlmostEqual(1.0, float(self.row(self.ALONE_A)[BUILDING]), places=4)

    def test_paper_by_hand(self):
        # A_shared = 3 + 2 priors, A_car = 1 + 1 prior; the second pass adds each once more, and the neighbour by k_0(1/3).
        self.fuse(self.a, self.b, "--diffusion", "paper", "--iterations", "2", "--diffusion-length", "0.3")
        r = 1.0 / 3.0
        k = (2 + math.cos(2 * math.pi * r)) * (1 - r) / 3 + math.sin(2 * math.pi * r) / (2 * math.pi)
        shared = self.row(self.SHARED)
        self.assertAlmostEqual(2 * (3 + 0.002) + k * 0.001, float(shared[ROAD]), places=4)
        self.assertAlmostEqual(2 * 0.002 + k * (1 + 0.001), float(shared[CAR]), places=4)

    def test_neither_order_nor_name_matters(self):
        digest = self.fuse(self.a, self.b)[1]["digest"]
        first = self.out.read_bytes()
        self.assertEqual(digest, self.fuse(self.b, self.a)[1]["digest"])
        self.assertEqual(first, self.out.read_bytes())
        renamed = self.folder / "z.tsm"
        self.a.rename(renamed)
        self.assertEqual(digest, self.fuse(renamed, self.b)[1]["digest"])

    def test_maps_of_the_same_robot_number_are_two_robots(self):
        other = self.make_map("c", [self.SHARED], [kitti.CAR])
        _, report = self.fuse(self.a, other, "--diffusion", "none")
        self.assertEqual(1, report["overlap_voxels"])
        self.assertEqual([0, 1], sorted(c["robot"] for c in report["contributions"]))

    def change_header(self, map_file, form, offset, value):
        """docs/reference/memory.md has the header's layout."""
        data = bytearray(map_file.read_bytes())
        end = 16 + struct.unpack_from("<I", data, 12)[0]
        struct.pack_into(form, data, offset, value)
        struct.pack_into("<I", data, end, crc32c(data[:end]))
        map_file.write_bytes(data)

    def test_an_earlier_epoch_counts_where_the_later_has_no_evidence(self):
        self.change_header(self.b, "<I", 44, 0)
        self.change_header(self.b, "<I", 48, 3)
        result, report = self.fuse(self.b, self.a, "--diffusion", "none")
        self.assert_warned(result, "a.tsm is of an earlier epoch of robot 0 than", "b.tsm",
                           "it is used only where that has no evidence")
        self.assertEqual(0, report["overlap_voxels"])
        self.assertEqual([(0, 0), (0, 3)], sorted((c["robot"], c["epoch"]) for c in report["contributions"]))
        self.assertAlmostEqual(2.0, float(self.row(self.SHARED)[ROAD]), places=4)
        self.assertAlmostEqual(1.0, float(self.row(self.ALONE_A)[BUILDING]), places=4)
        self.assertAlmostEqual(1.0, float(self.row(self.ALONE_B)[BUILDING]), places=4)

    def test_a_map_is_held_to_the_largest_cap(self):
        # 300 points in one voxel, without a cap of the map: 250 where that is 0, and else the other's.
        full = [self.make_map(f"full_{robot}", [self.SHARED] * 300, [kitti.ROAD] * 300, "--robot", robot, "--max-evidence", "0")
                for robot in (0, 1)]
        self.fuse(*full, "--diffusion", "none")
        self.assertAlmostEqual(500.0, float(self.row(self.SHARED)[ROAD]), delta=0.1)
        high = self.make_map("high", [self.SHARED], [kitti.ROAD], "--robot", "2", "--max-evidence", "300", "--free-weight", "2")
        for map_file in full:
            self.change_header(map_file, "<f", 40, 2.0)
        self.fuse(*full, high, "--diffusion", "none")
        self.assertAlmostEqual(601.0, float(self.row(self.SHARED)[ROAD]), delta=0.1)

    def test_transform_moves_a_map(self):
        transform = self.folder / "T.txt"
        transform.write_text("\n".join(" ".join(map(str, row)) for row in turned(90.0, x=5.0)))
        self.fuse(self.a, self.b, "--diffusion", "none", "--transform", f"{self.b}={transform}")
        # (2.05, 0.05) goes to (4.95, 2.05).
        self.assertAlmostEqual(2.0, float(self.row((4.95, 2.05, 0.05))[ROAD]), places=4)
        self.assertAlmostEqual(1.0, float(self.row(self.SHARED)[ROAD]), places=4)

    def test_frames_that_are_off_are_warned_about(self):
        wall = [kitti.corner_scan(seed=5, count=4000)]
        maps = []
        for robot in (0, 1):
            folder = kitti.write_dataset(self.folder / f"wall_{robot}", wall)
            maps.append(self.folder / f"wall_{robot}.tsm")
            self.map_dataset(folder, maps[-1], *COUNTING, "--robot", robot)
        transform = self.folder / "T.txt"
        transform.write_text("\n".join(" ".join(map(str, row)) for row in turned(0.0)))
        result, report = self.fuse(*maps, *(word for path in maps for word in ("--transform", f"{path}={transform}")))
        self.assert_not_warned(result)
        self.assertAlmostEqual(1.0, report["alignment"])
        transform.write_text("\n".join(" ".join(map(str, row)) for row in turned(0.0, x=0.2)))
        result, report = self.fuse(*maps, "--transform", f"{maps[1]}={transform}")
        self.assert_warned(result, "are misaligned")
        self.assertAlmostEqual(-0.2, report["alignments"][0]["best_shift_m"][0])

    def test_maps_of_which_none_has_a_frame_are_warned_about(self):
        result, _ = self.fuse(self.a, self.b)
        self.assert_warned(result, "none of the 2 maps has a T_global_map: their frames are taken for the same one")
        self.assertEqual(1, result.stderr.count("warning: "))

    def test_global_maps_can_be_looked_at(self):
        self.fuse(self.a, self.b)
        text = self.done("info", self.out, "--report", "info.json").stdout
        for words in ("global map of robots 0, 1", "diffusion contractive, iterations 4", "the global one"):
            self.assertIn(words, text)
        settings = json.loads((self.folder / "info.json").read_text())["settings"]
        self.assertEqual(([0, 1], "contractive", 0.2), tuple(settings[k] for k in ("robots", "diffusion", "diffusion_length")))
        for form in ("ply", "png"):
            self.done("export", "--map", self.out, "--format", form, "--out", self.folder / f"g.{form}")
        self.done("eval", "--map", self.out, "--dataset", self.folder / "data_b")

    def test_probabilities_are_shares_where_the_paper_has_them(self):
        """In none and paper, and where a map of counting takes part."""
        kernels = []
        for robot, name in enumerate("ab"):
            kernels.append(self.folder / f"kernels_{name}.tsm")
            self.map_dataset(self.folder / f"data_{name}", kernels[-1], "--robot", robot, "--free-space", "off")
        for maps, mode, expected in ((kernels, "contractive", "effective"), (kernels, "none", "shares"), (kernels, "paper", "shares"),
                                     ((self.a, self.b), "contractive", "shares"), ((kernels[0], self.b), "contractive", "shares")):
            self.fuse(*maps, "--diffusion", mode)
            self.done("info", self.out, "--report", "info.json")
            self.assertEqual(expected, json.loads((self.folder / "info.json").read_text())["probabilities"], (mode, expected))
            row = self.row(self.SHARED)
            share = (0.001 + float(row[ROAD])) / (0.021 + float(row["evidence"]))
            if mode == "none":
                self.assertAlmostEqual(share, float(row["probability"]), places=6)
            elif expected == "effective":
                self.assertNotAlmostEqual(share, float(row["probability"]), places=2)

    def refused_fuse(self, *words, saying):
        self.refused("fuse", *words, "--out", self.out, saying=saying)
        self.assertFalse(self.out.exists())

    def test_refuses_what_cannot_be_fused(self):
        coarse = self.make_map("coarse", [self.SHARED], [kitti.ROAD], "--resolution", "0.2")
        self.refused_fuse(self.a, coarse, saying=[coarse, "resolution 0.2", "0.1"])
        self.refused_fuse(self.a, saying=["at least two"])
        self.refused_fuse(self.a, self.a, saying=["named twice"])
        self.refused_fuse(self.a, self.folder / "none.tsm", saying=["none.tsm"])
        weighty = self.make_map("weighty", [self.SHARED], [kitti.ROAD], "--free-weight", "0.5")
        self.refused_fuse(self.a, weighty, saying=["free weight 0.5"])
        self.fuse(self.a, self.b)
        other = self.folder / "other.tsm"
        self.refused("fuse", self.a, self.out, "--out", other, saying=[self.out, "global map"])
        self.assertFalse(other.exists())

    def test_refuses_other_classes(self):
        folder = kitti.write_dataset(self.folder / "other", [kitti.Scan([self.SHARED], [1])])
        (folder / "classes.toml").write_text('[[class]]\nid = 1\nname = "grass"\ncolor = [0, 255, 0]\nraw = [1]\n')
        other = self.folder / "other.tsm"
        self.map_dataset(folder, other, *COUNTING)
        self.refused_fuse(self.a, other, saying=[other, "classes"])

    def test_refuses_bad_options(self):
        both = (self.a, self.b)
        for words, saying in (
                (("--alpha", "1"), "--alpha 1"), (("--alpha", "0"), "--alpha 0"), (("--omega", "0"), "--omega 0"),
                (("--iterations", "17"), "--iterations 17"), (("--iterations", "-1"), "--iterations -1"),
                (("--diffusion", "paper", "--iterations", "0"), "--iterations 0"),
                (("--diffusion-length", "nan"), "--diffusion-length"), (("--diffusion-length", "0"), "--diffusion-length"),
                (("--diffusion-length", "2"), "--diffusion-length"), (("--diffusion", "heat"), "heat"),
                (("--transform", "T.txt"), "T.txt"), (("--transform", "c.tsm=T.txt"), "c.tsm"),
                (("--transform", f"{self.a}=none.txt"), "none.txt")):
            with self.subTest(words):
                self.refused_fuse(*both, *words, saying=[saying])

    def test_refuses_more_maps_than_a_global_map_takes(self):
        self.refused_fuse(*(f"{i}.tsm" for i in range(4097)), saying=["4097 maps", "at most 4096"])
        copies = []
        for i in range(65):
            copies.append(self.folder / f"copy_{i}.tsm")
            copies[-1].write_bytes(self.a.read_bytes())
        self.refused_fuse(*copies, saying=["65 robots", "at most 64"])
        self.assertEqual(64, len(self.fuse(*copies[:-1], "--diffusion", "none")[1]["contributions"]))

    def test_the_largest_robot_number_has_no_next(self):
        last = str(2**32 - 1)
        maps = [self.make_map(name, [self.SHARED], [kitti.ROAD], "--robot", last) for name in ("c", "d")]
        _, report = self.fuse(*maps, "--diffusion", "none")
        self.assertEqual([0, 2**32 - 1], sorted(c["robot"] for c in report["contributions"]))

    def test_memory_that_suffices_changes_nothing(self):
        _, whole = self.fuse(self.a, self.b)
        before = self.out.read_bytes()
        result, report = self.fuse(self.a, self.b, "--memory", "128M")
        self.assert_warned(result, "T_global_map")
        self.assertEqual(1, result.stderr.count("warning: "))
        self.assertEqual(before, self.out.read_bytes())
        self.assertEqual(whole["digest"], report["digest"])
        memory = report["memory"]
        self.assertEqual((128 << 20, 0, 128 << 20), (memory["budget_bytes"], memory["refused"], report["config"]["memory"]))
        self.assertLess(memory["map_used_bytes"] + memory["replica_bytes"] + memory["sum_bytes"], memory["used_bytes"])
        self.assertLessEqual(memory["used_bytes"], memory["budget_bytes"])
        self.assertIsNone(whole["config"]["memory"])
        self.assertEqual(0, whole["memory"]["refused"])

    def test_memory_that_is_too_small_is_told(self):
        maps = []
        for robot in (0, 1):
            folder = kitti.write_dataset(self.folder / f"scattered_{robot}", [kitti.scattered_scan(robot + 1, 4000)])
            maps.append(self.folder / f"scattered_{robot}.tsm")
            self.map_dataset(folder, maps[-1], *COUNTING, "--robot", robot)
        _, whole = self.fuse(*maps)
        self.out.unlink()
        self.refused("fuse", *maps, "--out", self.out, "--memory", "1M", saying=["--memory 1M", "give at least"])
        for text in ("lots", "-1", "1T"):
            self.refused("fuse", *maps, "--out", self.out, f"--memory={text}", saying=["--memory", text])
        self.assertFalse(self.out.exists())
        message = self.run_command("fuse", *maps, "--out", self.out, "--memory", "1M").stderr
        enough = int(message.rstrip().rsplit(" ", 1)[1].removesuffix("M")) << 10
        self.assertLessEqual(self.fuse(*maps, "--memory", f"{enough}K")[1]["memory"]["used_bytes"], enough << 10)
        # The least that is taken holds next to nothing.
        least = 1 << 10
        while enough - least > 32:
            middle = (least + enough) // 2
            result = self.run_command("fuse", *maps, "--out", self.out, "--memory", f"{middle}K")
            least, enough = (least, middle) if result.returncode == 0 else (middle, enough)
        result, report = self.fuse(*maps, "--memory", f"{enough}K")
        self.assert_warned(result, "for lack of memory; give a larger --memory")
        self.assertGreater(report["memory"]["refused_blocks"], 0)
        self.assertLessEqual(report["memory"]["used_bytes"], enough << 10)
        self.assertLess(report["voxels"], whole["voxels"])
        self.done("info", self.out)

    def test_never_writes_over_a_map_that_it_reads(self):
        before = self.a.read_bytes()
        self.refused("fuse", self.a, self.b, "--out", self.a, saying=["--out"])
        self.assertEqual(before, self.a.read_bytes())
        transform = self.folder / "T.txt"
        transform.write_text("\n".join(" ".join(map(str, row)) for row in turned(0.0)))
        words = (self.a, self.b, "--transform", f"{self.b}={transform}")
        self.refused("fuse", *words, "--out", transform, saying=["--transform"])


if __name__ == "__main__":
    unittest.main()
