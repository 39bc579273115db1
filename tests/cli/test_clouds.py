# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Folders of PCD and PLY files: the same points in any of them make the same map; what is damaged is refused."""
import json
import struct
import unittest

import kitti_folder as kitti
from command_case import MEMORY, CommandCase

IDENTITY_ROW = " ".join(map(str, kitti.IDENTITY))


def single(value):
    """As a float32, printed so that it comes back as that."""
    return repr(struct.unpack("<f", struct.pack("<f", value))[0])


def pcd_head(count, data):
    return (f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z label\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {count}\n"
            f"HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {data}\n").encode()


def ply_head(count, form):
    return (f"ply\nformat {form} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
            f"property uint label\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n").encode()


def rows(scan):
    return "".join(f"{single(x)} {single(y)} {single(z)} {label}\n"
                   for (x, y, z), label in zip(scan.points, scan.predicted, strict=True)).encode()


def records(scan, order="<"):
    return b"".join(struct.pack(order + "3fI", *point, label)
                    for point, label in zip(scan.points, scan.predicted, strict=True))


def stored_as_lzf(payload):
    """Valid LZF without any reference: runs of up to 32 bytes."""
    runs = [payload[i:i + 32] for i in range(0, len(payload), 32)]
    return b"".join(bytes([len(run) - 1]) + run for run in runs)


def pcd_ascii(scan):
    return pcd_head(len(scan.points), "ascii") + rows(scan)


def pcd_binary(scan):
    return pcd_head(len(scan.points), "binary") + records(scan)


def pcd_compressed(scan):
    columns = [struct.pack(f"<{len(scan.points)}f", *column) for column in zip(*scan.points, strict=True)]
    payload = b"".join(columns) + kitti.labels_bytes(scan.predicted)
    packed = stored_as_lzf(payload)
    return pcd_head(len(scan.points), "binary_compressed") + struct.pack("<2I", len(packed), len(payload)) + packed


def ply_ascii(scan):
    return ply_head(len(scan.points), "ascii") + rows(scan)


def ply_little(scan):
    return ply_head(len(scan.points), "binary_little_endian") + records(scan)


def ply_big(scan):
    return ply_head(len(scan.points), "binary_big_endian") + records(scan, ">")


class CloudCase(CommandCase):
    def setUp(self):
        super().setUp()
        # Under an order by letters scan_10 would come before scan_8.
        self.numbers = (8, 9, 10)
        self.scans = [kitti.corner_scan(i + 1, pose=kitti.moved(0.5 * i)) for i in range(3)]
        self.poses = self.folder / "poses.txt"
        self.write_poses(" ".join(map(str, scan.pose)) for scan in self.scans)
        self.report = self.folder / "map.json"

    def write_poses(self, lines):
        self.poses.write_text("".join(line + "\n" for line in lines))

    def write_clouds(self, name, extension, write):
        root = self.folder / name
        root.mkdir()
        for number, scan in zip(self.numbers, self.scans, strict=True):
            (root / f"scan_{number}.{extension}").write_bytes(write(scan))
        return root

    def map_clouds(self, option, root, *options):
        out = self.folder / "map.tsm"
        result = self.done("map", option, root, "--poses", self.poses, "--out", out, "--report", self.report, *MEMORY,
                           *options)
        return result, json.loads(self.report.read_text())

    def clouds_refused(self, *arguments, saying, exit_status=1):
        out = self.folder / "refused.tsm"
        message = self.refused("map", *arguments, "--out", out, *MEMORY, saying=saying, exit_status=exit_status)
        self.assertFalse(out.exists())
        return message


class Mapped(CloudCase):
    def test_every_format_makes_the_map_of_the_dataset(self):
        data = kitti.write_dataset(self.folder / "data", self.scans)
        _, expected = self.map_dataset(data, self.folder / "dataset.tsm")
        for write in (pcd_ascii, pcd_binary, pcd_compressed, ply_ascii, ply_little, ply_big):
            with self.subTest(write.__name__):
                extension = write.__name__[:3]
                root = self.write_clouds(write.__name__, extension, write)
                result, report = self.map_clouds(f"--{extension}", root)
                self.assert_not_warned(result)
                self.assertEqual(expected["digest"], report["digest"])
                self.assertEqual("field", report["config"]["labels"])
                self.assertIn(report["heap_allocations_after_init"], (0, None))

    def test_every_form_of_poses_makes_the_same_map(self):
        root = self.write_clouds("clouds", "pcd", pcd_binary)
        _, expected = self.map_clouds("--pcd", root)
        self.write_poses(" ".join(map(str, scan.pose)) + " 0 0 0 1" for scan in self.scans)
        self.assertEqual(expected["digest"], self.map_clouds("--pcd", root)[1]["digest"])
        self.write_poses(f"{100.5 + i} {0.5 * i} 0 0 0 0 0 1" for i in range(3))
        self.assertEqual(expected["digest"], self.map_clouds("--pcd", root)[1]["digest"])

    def test_stamps_of_poses_find_corrected_poses(self):
        root = self.write_clouds("clouds", "pcd", pcd_binary)
        count = len(list(root.glob("*.pcd")))
        stamped = "".join(f"{100.0 + i} {i} 0 0 0 0 0 1\n" for i in range(count))
        self.write_poses(stamped.splitlines())
        (self.folder / "corrected.txt").write_text("".join(f"{100.0 + i} {i + 3.0} 0 0 0 0 0 1\n" for i in range(count)))
        result, report = self.map_clouds("--pcd", root, "--submap-length", 0.5, "--corrections", self.folder / "corrected.txt")
        self.assertLess(report["corrections"][0]["residual_m"], 1e-3)
        for submap in report["submaps"]:
            self.assertAlmostEqual(3.0, submap["T_map_submap"][3], 3)
        self.assertRegex(result.stdout, r"voxels +[1-9]\d* labelled or occupied, [1-9]\d* free, in the largest submap")
        self.assertRegex(result.stdout, r"file +[1-9]\d* voxels labelled or occupied, [1-9]\d* free")

    def test_a_range_of_scans_and_going_on_from_it(self):
        root = self.write_clouds("clouds", "ply", ply_little)
        _, whole = self.map_clouds("--ply", root)
        _, part = self.map_clouds("--ply", root, "--last", 1)
        self.assertEqual([0, 1], [scan["index"] for scan in part["scans"]])
        result, rest = self.map_clouds("--ply", root, "--first", 2, "--last", 4, "--continue", self.folder / "map.tsm")
        self.assert_warned(result, "there are no scans 3-4")
        self.assertEqual(whole["digest"], rest["digest"])

    def test_without_labels_points_are_unlabelled(self):
        root = self.write_clouds("clouds", "pcd", pcd_binary)
        result, report = self.map_clouds("--pcd", root, "--labels", "none")
        self.assert_not_warned(result)
        self.assertEqual("none", report["config"]["labels"])
        self.assertGreater(report["totals"]["unlabelled"], 0)
        for cloud in root.iterdir():
            cloud.write_bytes(cloud.read_bytes().replace(b" label", b" blabel"))
        result, unnamed = self.map_clouds("--pcd", root)
        self.assert_warned(result, "3 of 3 clouds have no field label")
        self.assertEqual(report["digest"], unnamed["digest"])

    def test_a_viewpoint_is_warned_about(self):
        root = self.write_clouds("clouds", "pcd", pcd_binary)
        _, expected = self.map_clouds("--pcd", root)
        cloud = root / "scan_9.pcd"
        cloud.write_bytes(cloud.read_bytes().replace(b"VIEWPOINT 0 0 0", b"VIEWPOINT 0 0 2"))
        result, report = self.map_clouds("--pcd", root)
        self.assert_warned(result, "1 cloud with a VIEWPOINT")
        self.assertEqual(expected["digest"], report["digest"])

    def test_points_where_nothing_came_back(self):
        root = self.write_clouds("clouds", "pcd", pcd_ascii)
        _, expected = self.map_clouds("--pcd", root)
        cloud = root / "scan_9.pcd"
        text = cloud.read_bytes().replace(b"WIDTH 300\nHEIGHT 1\n", b"WIDTH 151\nHEIGHT 2\n")
        cloud.write_bytes(text.replace(b"POINTS 300", b"POINTS 302") + b"nan nan nan 0\n" * 2)
        result, report = self.map_clouds("--pcd", root)
        self.assert_not_warned(result)
        self.assertEqual(expected["digest"], report["digest"])

    def test_ids_and_points_that_cannot_be_used_are_counted(self):
        root = self.write_clouds("clouds", "pcd", pcd_ascii)
        (root / "scan_9.pcd").write_bytes(pcd_head(2, "ascii") + b"nan 1 2 40\n3 1 0 777\n")
        result, report = self.map_clouds("--pcd", root)
        self.assertEqual(1, report["totals"]["non_finite"])
        self.assertEqual(1, report["totals"]["unknown_ids"])
        self.assert_warned(result, "777")

    def test_classes_and_place_of_the_folder(self):
        root = self.write_clouds("clouds", "pcd", pcd_binary)
        (root / "classes.toml").write_text('[[class]]\nid = 1\nname = "all"\ncolor = "#ff0000"\nraw = [40, 50]\n')
        (root / "T_global_map.txt").write_text("1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        self.map_clouds("--pcd", root)
        _, states = self.query_rows(self.folder / "map.tsm", "x,y,z\n6.05,0,0\n")
        self.assertEqual(1, len(states))
        self.assertIn("all", self.done("info", self.folder / "map.tsm").stdout)


class Refused(CloudCase):
    def setUp(self):
        super().setUp()
        self.root = self.write_clouds("clouds", "pcd", pcd_binary)
        self.given = ("--pcd", self.root, "--poses", self.poses)

    def test_sources_that_do_not_go_together(self):
        self.clouds_refused(saying=("--dataset", "--pcd", "--ply"))
        self.clouds_refused(*self.given, "--dataset", self.root, saying=("mutually exclusive; give one",))
        self.clouds_refused("--pcd", self.root, saying=("--pcd needs a pose", "--poses"))
        self.clouds_refused("--dataset", self.root, "--poses", self.poses, saying=("--poses is for",))
        self.clouds_refused(*self.given, "--labels", "predictions", saying=("--labels",))
        self.clouds_refused(*self.given, "--deskew", "on", saying=("--deskew",))

    def test_what_is_not_there(self):
        self.clouds_refused("--pcd", self.folder / "absent", "--poses", self.poses, saying=("absent",))
        self.clouds_refused("--ply", self.root, "--poses", self.poses, saying=("no .ply files",))
        self.clouds_refused("--pcd", self.root, "--poses", self.folder / "absent", saying=("absent",))
        self.clouds_refused(*self.given, "--first", 3, saying=("from 0 to 2",))

    def test_another_number_of_poses(self):
        """Row i is of file i: what matters is that each chosen file has its row."""
        self.write_poses([IDENTITY_ROW] * 2)
        self.clouds_refused(*self.given, saying=("clouds has 3 .pcd files", "poses.txt has 2 poses", "--last"))
        for count, options in ((2, ("--last", 1)), (1, ("--last", 0)), (4, ())):
            with self.subTest(rows=count):
                self.write_poses([IDENTITY_ROW] * count)
                result = self.done("map", *self.given, *options, "--out", self.folder / "some.tsm", *MEMORY)
                self.assertIn(f"warning: there are {count} poses for 3 files", result.stderr)

    def test_poses_that_are_none(self):
        self.write_poses([IDENTITY_ROW, "1 2 3", IDENTITY_ROW])
        self.clouds_refused(*self.given, saying=("poses.txt, line 2", "3 numbers"))

    def test_an_output_that_is_a_cloud(self):
        before = (self.root / "scan_9.pcd").read_bytes()
        for taken in (self.root / "scan_9.pcd", self.poses):
            self.refused("map", *self.given, "--out", taken, saying=(taken.name,))
        self.assertEqual(before, (self.root / "scan_9.pcd").read_bytes())

    def test_damaged_clouds(self):
        # The first, so that there is no progress yet.
        cloud = self.root / "scan_8.pcd"
        good = cloud.read_bytes()
        ascii_cloud = pcd_ascii(self.scans[0])
        cases = {"empty": (b"", "no DATA line"), "no cloud": (b"\x00\xff" * 50, "does not begin as a PCD file does"),
                 "truncated": (good[:-5], "truncated"), "header only": (good[:24], "no DATA line"),
                 "too many": (good + good[-32:], "its header says 300"),
                 "huge": (good.replace(b" 300\n", b" 16000000\n"), "truncated"),
                 "over the limit": (good.replace(b" 300\n", b" 99999999999999\n"), "the limit is"),
                 "row": (ascii_cloud[:-20] + b"\n", "line "), "word": (ascii_cloud[:-3] + b"x\n", "whole number")}
        for name, (content, says) in cases.items():
            with self.subTest(name):
                cloud.write_bytes(content)
                self.clouds_refused(*self.given, saying=("scan_8.pcd", says))

    def test_damaged_compressed_clouds(self):
        for path in self.root.iterdir():
            path.unlink()
        for number, scan in zip(self.numbers, self.scans, strict=True):
            (self.root / f"scan_{number}.pcd").write_bytes(pcd_compressed(scan))
        cloud = self.root / "scan_8.pcd"
        good = cloud.read_bytes()
        start = good.index(b"DATA binary_compressed\n") + len(b"DATA binary_compressed\n")
        bomb = good[:start].replace(b" 300\n", b" 16777216\n") + struct.pack("<2I", 64, 1 << 28) + b"\xff" * 64
        for content in (good[:-1], good[:start + 7], bomb, good[:start + 8] + b"\xff" * (len(good) - start - 8)):
            cloud.write_bytes(content)
            self.clouds_refused(*self.given, saying=("scan_8.pcd",))


if __name__ == "__main__":
    unittest.main()
