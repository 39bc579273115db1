# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""export: files that other tools open, and what it says when there is nothing to show."""
import json
import re
import struct
import unittest
import zlib

import kitti_folder as kitti
from command_case import CommandCase

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"


def png_chunks(data):
    at = len(PNG_MAGIC)
    while at < len(data):
        length, = struct.unpack_from(">I", data, at)
        body = data[at + 4:at + 8 + length]
        crc, = struct.unpack_from(">I", data, at + 8 + length)
        yield body[:4], body[4:], crc == zlib.crc32(body)
        at += 12 + length


class Export(CommandCase):
    def setUp(self):
        super().setUp()
        self.data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(1)])
        self.map_dataset(self.data, self.folder / "map.tsm")

    def empty_map(self):
        """Every point is refused, as it is nearer than a return can be."""
        scan = kitti.Scan([(0.01, 0.0, 0.0)] * 5, [kitti.ROAD] * 5)
        data = kitti.write_dataset(self.folder / "empty", [scan])
        _, report = self.map_dataset(data, self.folder / "empty.tsm")
        self.assertEqual(0, report["memory"]["label_voxels"])
        return self.folder / "empty.tsm"

    def test_ply(self):
        for form in ("points", "cubes"):
            with self.subTest(form):
                self.done("export", "--map", "map.tsm", "--format", "ply", "--ply-form", form, "--out", "map.ply")
                data = (self.folder / "map.ply").read_bytes()
                head, _, body = data.partition(b"end_header\n")
                self.assertTrue(head.startswith(b"ply\nformat binary_little_endian 1.0\n"), head[:60])
                self.assertRegex(head, rb"element vertex [1-9][0-9]*\n")
                if form == "points":
                    for name in (b"label 9 road", b"label 13 building"):
                        self.assertIn(b"comment " + name + b"\n", head)
                    count = int(re.search(rb"element vertex (\d+)", head).group(1))
                    self.assertEqual(28 * count, len(body))

    def test_png(self):
        for view in ("both", "top", "oblique"):
            with self.subTest(view):
                self.done("export", "--map", "map.tsm", "--format", "png", "--view", view, "--width", 600,
                          "--out", "map.png")
                data = (self.folder / "map.png").read_bytes()
                self.assertTrue(data.startswith(PNG_MAGIC))
                chunks = list(png_chunks(data))
                self.assertEqual((b"IHDR", b"IEND"), (chunks[0][0], chunks[-1][0]))
                self.assertTrue(all(sound for _, _, sound in chunks))
                pixels = zlib.decompress(b"".join(body for kind, body, _ in chunks if kind == b"IDAT"))
                self.assertGreater(len(set(pixels)), 10, "the picture is blank")

    def test_the_same_map_gives_the_same_bytes(self):
        for kind in ("ply", "png"):
            for name in ("a", "b"):
                self.done("export", "--map", "map.tsm", "--format", kind, *(("--title", "t") if kind == "png" else ()), "--out", f"{name}.{kind}")
            self.assertEqual((self.folder / f"a.{kind}").read_bytes(), (self.folder / f"b.{kind}").read_bytes())

    def test_an_empty_map_is_exported_with_a_warning(self):
        empty = self.empty_map()
        for kind in ("ply", "png"):
            with self.subTest(kind):
                result = self.done("export", "--map", empty, "--format", kind, "--out", f"empty.{kind}")
                self.assert_warned(result, "no occupied voxel")
                self.assertGreater((self.folder / f"empty.{kind}").stat().st_size, 0)

    def test_an_empty_map_can_be_asked_and_judged(self):
        empty = self.empty_map()
        _, rows = self.query_rows(empty, "x,y,z\n0,0,0\n")
        self.assertEqual("unknown", rows[0]["state"])
        self.done("info", empty)
        self.done("eval", "--map", empty, "--dataset", self.data)

    def test_limits(self):
        base = ("export", "--map", "map.tsm", "--format", "ply", "--out", "out.ply")
        self.assert_warned(self.done(*base, "--min-evidence", "1e6"), "no occupied voxel passes --min-evidence 1e+06")
        self.assert_not_warned(self.done(*base, "--min-probability", "0.5"))
        for option, value in (("--min-probability", "0.9"), ("--max-variance", "0.02"), ("--min-evidence", "1.5")):
            counts = []
            for report, options in (("all.json", ()), ("some.json", (option, value))):
                self.done(*base, *options, "--report", report)
                counts.append(json.loads((self.folder / report).read_text())["voxels"])
            self.assertTrue(0 < counts[1] < counts[0], (option, counts))
        for option, value in (("--min-evidence", "-1"), ("--min-evidence", "nan"), ("--min-evidence", "1e7"),
                              ("--min-probability", "-0.1"), ("--min-probability", "2"), ("--min-probability", "nan"),
                              ("--max-variance", "-1"), ("--max-variance", "0.26"), ("--max-variance", "nan")):
            with self.subTest(option=option, value=value):
                self.refused(*base, f"{option}={value}", saying=(option, "a number from 0 to"))

    def test_voxels_that_the_picture_does_not_show_are_told(self):
        far = kitti.Scan([(2 + 0.1 * (i % 40), 0.1 * (i // 40), 0.05) for i in range(2000)],
                         [kitti.ROAD] * 2000)
        data = kitti.write_dataset(self.folder / "far", [far, kitti.Scan([(2, 0, 0)], [kitti.ROAD], pose=kitti.moved(9000.0))])
        self.map_dataset(data, self.folder / "far.tsm", "--inference", "counting", "--free-space", "off")
        result = self.done("export", "--map", "far.tsm", "--format", "png", "--out", "far.png", "--report", "far.json")
        self.assert_warned(result, "1 voxel not shown in each view")
        report = json.loads((self.folder / "far.json").read_text())
        self.assertEqual(1, report["left_out"])

    def test_a_long_title_and_letters_that_the_face_lacks(self):
        for title in ("a" * 500, "Stra\u00dfe", "\n"):
            self.done("export", "--map", "map.tsm", "--format", "png", "--title", title, "--out", "map.png")

    def test_the_title_is_the_name_of_the_file(self):
        (self.folder / "deep").mkdir()
        (self.folder / "deep" / "map.tsm").write_bytes((self.folder / "map.tsm").read_bytes())
        for name in ("map.tsm", "deep/map.tsm"):
            self.done("export", "--map", name, "--format", "png", "--out", name.replace("/", "-") + ".png")
        self.assertEqual((self.folder / "map.tsm.png").read_bytes(), (self.folder / "deep-map.tsm.png").read_bytes())

    def test_the_format_is_that_of_the_ending(self):
        """By itself; and none is written under the ending of another one."""
        for kind, start in (("png", PNG_MAGIC), ("ply", b"ply\n"), ("pcd", b"# .PCD"), ("npy", b"\x93NUMPY"), ("csv", b"x,y,z,")):
            self.done("export", "--map", "map.tsm", "--out", f"m.{kind}", "--report", "m.json")
            self.assertTrue((self.folder / f"m.{kind}").read_bytes().startswith(start), kind)
            self.assertEqual(kind, json.loads((self.folder / "m.json").read_text())["config"]["format"])
        self.refused("export", "--map", "map.tsm", "--out", "no.png", "--format", "ply", saying=("no.png", "--format is ply"))
        self.refused("export", "--map", "map.tsm", "--out", "no.jpg", saying=("no.jpg", "give --format png"))
        self.assertFalse((self.folder / "no.png").exists())
        self.done("export", "--map", "map.tsm", "--out", "m.points", "--format", "ply")

    def test_bad_usage(self):
        base = ("export", "--map", "map.tsm", "--out", "out.bin")
        self.refused(*base, "--format", "bmp", saying=("--format", "bmp"))
        self.refused(*base, "--format", "png", "--view", "side", saying=("--view", "side"))
        self.refused(*base, "--format", "ply", "--ply-form", "balls", saying=("--ply-form", "balls"))
        for width in ("0", "-5", "599", "100000", "wide"):
            self.refused(*base, "--format", "png", f"--width={width}", saying=("--width",))
        self.assertFalse((self.folder / "out.bin").exists())

    def test_unwritable_report_is_told_before_the_work(self):
        (self.folder / "points.csv").write_text("x,y,z\n1,2,3\n")
        out = self.folder / "out"
        for command in (("export", "--map", "map.tsm", "--format", "png", "--out", out),
                        ("query", "--map", "map.tsm", "--points", self.folder / "points.csv", "--out", out),
                        ("info", "map.tsm")):
            with self.subTest(command[0]):
                arguments = (*command, "--report", self.folder / "absent" / "r.json")
                self.refused(*arguments, saying=("absent",))
                self.assertEqual("", self.run_command(*arguments).stdout)
                self.assertFalse(out.exists())

    def test_unwritable_output(self):
        for kind in ("ply", "png"):
            base = ("export", "--map", "map.tsm", "--format", kind, "--out")
            self.refused(*base, f"absent/map.{kind}", saying=("absent",))
            self.refused(*base, self.folder, saying=("folder",))
            self.assertFalse((self.folder / "absent").exists())


if __name__ == "__main__":
    unittest.main()
