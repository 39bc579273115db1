# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""export --show: who contributed a global map's voxels, where robots disagree, how sure labels are."""
import json
import os
import re
import struct
import unittest

import kitti_folder as kitti
from command_case import CommandCase
from counting import COUNTING
from test_fuse import turned

ROBOTS = ("contributors", "disagreement")


class Layers(CommandCase):
    """Two robots: one voxel where they agree, two where they do not, and one (A) or two (B) of their own."""
    AGREED, CONTRARY, CONTRARY_TOO = (2.05, 0.05, 0.05), (2.05, 4.05, 0.05), (2.05, 5.05, 0.05)
    OF_A, OF_B, OF_B_TOO = (20.05, 0.05, 0.05), (30.05, 0.05, 0.05), (31.05, 0.05, 0.05)

    def make_map(self, name, points, ids, *options):
        folder = kitti.write_dataset(self.folder / f"data_{name}", [kitti.Scan(points, ids)])
        self.map_dataset(folder, self.folder / f"{name}.tsm", *COUNTING, *options)
        return f"{name}.tsm"

    def setUp(self):
        super().setUp()
        shared = [self.AGREED, self.CONTRARY, self.CONTRARY_TOO]
        self.a = self.make_map("a", [*shared, self.OF_A], [kitti.ROAD, kitti.CAR, kitti.CAR, kitti.BUILDING])
        self.b = self.make_map("b", [*shared, self.OF_B, self.OF_B_TOO],
                               [kitti.ROAD, kitti.BUILDING, kitti.ROAD, kitti.CAR, kitti.CAR], "--robot", "1")

    def fuse(self, *words):
        self.done("fuse", *words, "--out", "g.tsm", "--diffusion", "none")

    def show(self, layer, *words, form="ply"):
        result = self.done("export", "--map", "g.tsm", "--format", form, "--out", f"g.{form}", "--report", "g.json",
                           "--show", layer, *words)
        return result, json.loads((self.folder / "g.json").read_text())

    def points(self):
        """By place: colour, and the number of robots."""
        head, _, body = (self.folder / "g.ply").read_bytes().partition(b"end_header\n")
        self.assertIn(b"property uchar robots\n", head)
        row = struct.Struct("<3f3BB3fB")
        self.assertEqual(row.size * int(re.search(rb"element vertex (\d+)", head).group(1)), len(body))
        return {tuple(round(v, 2) for v in p[:3]): (p[3:6], p[10]) for p in row.iter_unpack(body)}

    def test_sessions_are_contributors_by_their_date(self):
        os.utime(self.folder / self.b, (1764115200, 1764115200))
        session = ("--session", f"{self.b}:0.25")
        self.fuse(self.a, *session)
        result, report = self.show("contributors", "--of", self.a, *session)
        self.assert_not_warned(result)
        of_map, of_session = report["contributors"]
        self.assertEqual(("a.tsm", 0, 4), (of_map["map"], of_map["robot"], of_map["voxels"]))
        self.assertEqual(("b.tsm", 5), (of_session["map"], of_session["voxels"]))
        self.assertNotIn("robot", of_session)
        self.assertEqual(("2025-11-26T00:00:00Z", 0.25), (of_session["session"]["date"], of_session["session"]["weight"]))
        self.assertEqual((3, 2, 0), tuple(report[key] for key in ("shared_voxels", "disagreeing_voxels", "no_robot_voxels")))
        self.assertEqual([f"{self.b}:0.25"], report["config"]["session"])
        self.assertEqual({1, 2}, {number for _, number in self.points().values()})
        # Without it what only the session has is of nobody.
        result, report = self.show("contributors", "--of", self.a)
        self.assert_warned(result, "2 voxels", "sessions")
        self.refused_show("contributors", "--of", self.a, "--session", "none.tsm", saying=["none.tsm"])
        self.refused_show("contributors", "--of", self.a, "--session", f"{self.b}:2", saying=["--session", "from 0.0001 to 1"])
        self.refused_show("class", "--session", self.b, saying=["--session goes with --show contributors or disagreement only"])
        self.refused("export", "--map", "g.tsm", "--out", self.b, "--format", "ply", "--show", "contributors", "--of", self.a, *session,
                     saying=[self.b])
        # A picture names it.
        self.show("contributors", "--of", self.a, *session, form="png")

    def test_counts_by_hand(self):
        self.fuse(self.a, self.b)
        for layer in ROBOTS:
            with self.subTest(layer):
                result, report = self.show(layer, "--of", self.b, self.a)
                self.assert_not_warned(result)
                self.assertEqual([("a.tsm", 0, 4), ("b.tsm", 1, 5)],
                                 [(c["map"], c["robot"], c["voxels"]) for c in report["contributors"]])
                self.assertEqual((6, 3, 2, 0), tuple(report[key] for key in (
                    "voxels", "shared_voxels", "disagreeing_voxels", "no_robot_voxels")))
                self.assertEqual((layer, ["b.tsm", "a.tsm"]), (report["config"]["show"], report["config"]["of"]))

    def test_colours_tell_who_and_where(self):
        self.fuse(self.a, self.b)
        self.show("contributors", "--of", self.a, self.b)
        points = self.points()
        shared = {points[p] for p in (self.AGREED, self.CONTRARY, self.CONTRARY_TOO)}
        self.assertEqual({2}, {robots for _, robots in shared})
        self.assertEqual(points[self.OF_B], points[self.OF_B_TOO])
        self.assertEqual(1, points[self.OF_A][1])
        self.assertEqual(3, len({color for color, _ in points.values()}))
        self.show("disagreement", "--of", self.a, self.b)
        points = self.points()
        self.assertEqual(points[self.OF_A], points[self.OF_B])
        self.assertEqual(points[self.CONTRARY], points[self.CONTRARY_TOO])
        self.assertEqual(3, len({color for color, _ in points.values()}))

    def test_three_robots(self):
        c = self.make_map("c", [self.AGREED, self.OF_A], [kitti.ROAD, kitti.ROAD], "--robot", "2")
        self.fuse(self.a, self.b, c)
        _, report = self.show("contributors", "--of", self.a, self.b, c)
        self.assertEqual((4, 3), (report["shared_voxels"], report["disagreeing_voxels"]))
        points = self.points()
        self.assertEqual((3, 2), (points[self.AGREED][1], points[self.OF_A][1]))
        self.assertNotEqual(points[self.AGREED][0], points[self.OF_A][0])

    def test_more_robots_than_colours(self):
        maps = [self.make_map(f"r{i}", [(2.05 + i, 0.05, 0.05)], [kitti.ROAD], "--robot", i) for i in range(10)]
        self.fuse(*maps)
        self.show("contributors", "--of", *maps)
        self.assertEqual(9, len({color for color, _ in self.points().values()}))
        self.show("contributors", "--of", *maps, form="png")

    def test_evidence_goes_where_fusing_takes_it(self):
        wall = self.folder / "wall"
        kitti.write_dataset(wall, [kitti.corner_scan(seed=5, count=4000)])
        self.map_dataset(wall, self.folder / "wall.tsm", *COUNTING, "--robot", "1")
        for name, degrees in (("T.txt", 30.0), ("U.txt", -70.0)):
            (self.folder / name).write_text("\n".join(" ".join(map(str, row)) for row in turned(degrees, x=0.33, z=0.1)))
        transforms = ("--transform", "wall.tsm=T.txt", "--transform", "a.tsm=U.txt")
        self.fuse("wall.tsm", self.a, *transforms)
        result, report = self.show("contributors", "--of", "wall.tsm", self.a, *transforms)
        self.assert_not_warned(result)
        self.assertEqual(0, report["no_robot_voxels"])
        self.assertEqual(report["voxels"] + report["shared_voxels"], sum(c["voxels"] for c in report["contributors"]))
        result, report = self.show("contributors", "--of", "wall.tsm", self.a)
        self.assert_warned(result, "none of the maps of --of has there")
        self.assertGreater(report["no_robot_voxels"], 0)

    def test_voxels_without_a_label_are_nobodys(self):
        c = self.make_map("c", [self.AGREED, self.OF_B], [kitti.ROAD, kitti.UNLABELLED], "--robot", "2")
        self.fuse(self.a, c)
        result, report = self.show("disagreement", "--of", self.a, c)
        self.assert_not_warned(result)
        self.assertEqual((5, 1, 1, 0), tuple(report[key] for key in (
            "voxels", "no_robot_voxels", "shared_voxels", "disagreeing_voxels")))

    def test_maps_that_are_left_out_are_missed(self):
        self.fuse(self.a, self.b)
        result, report = self.show("contributors", "--of", self.a)
        self.assert_warned(result, "2 voxels with a label that none of the maps")
        self.assertEqual((2, 0), (report["no_robot_voxels"], report["shared_voxels"]))

    def test_pictures_differ_by_layer(self):
        self.fuse(self.a, self.b)
        pictures = set()
        for layer in ("class", "contributors", "disagreement", "variance", "probability", "height"):
            of = ("--of", self.a, self.b) if layer in ROBOTS else ()
            _, report = self.show(layer, *of, "--title", "t", form="png")
            self.assertEqual(layer in ROBOTS, "contributors" in report)
            pictures.add((self.folder / "g.png").read_bytes())
        self.assertEqual(6, len(pictures))

    def test_what_moved(self):
        """A car 8 m ahead, then the wall 12 m ahead that it hid: the car's voxels are free, and known to have been a car's."""
        rays = [(1.0, 0.004 * i + 0.002, 0.004 * j + 0.002) for i in range(-25, 25) for j in range(-25, 25)]
        car, wall = ([tuple(x * c for c in ray) for ray in rays] for x in (8.05, 12.05))
        folder = kitti.write_dataset(self.folder / "street", [kitti.Scan(car, [kitti.CAR] * len(rays)),
                                                              kitti.Scan(wall, [kitti.BUILDING] * len(rays))])
        self.map_dataset(folder, self.folder / "street.tsm", "--inference", "counting", "--downsample", "off", "--carving", "image", "--max-range", 30)
        shown = ("export", "--map", "street.tsm", "--show", "moved", "--report", "m.json")
        result = self.done(*shown, "--format", "ply", "--out", "m.ply")
        report = json.loads((self.folder / "m.json").read_text())
        self.assertGreater(report["moved_voxels"], 50)
        self.assertEqual({"car": report["moved_voxels"]}, report["moved"])
        self.assertIn(f"{report['voxels']:,} voxels into m.ply".replace(",", ""), result.stdout.replace(",", ""))
        _, _, body = (self.folder / "m.ply").read_bytes().partition(b"end_header\n")
        colours = {}
        for row in struct.Struct("<3f3BB3f").iter_unpack(body):
            colours.setdefault(row[0] > 10, set()).add(row[3:6])
        self.assertEqual([1, 1], [len(colours[far]) for far in (False, True)])
        self.assertNotEqual(colours[False], colours[True])
        for form in ("npy", "pcd", "png"):
            self.done(*shown, "--format", form, "--out", f"m.{form}")
            again = json.loads((self.folder / "m.json").read_text())
            self.assertEqual([report[key] for key in ("voxels", "moved")], [again[key] for key in ("voxels", "moved")])
        self.done("export", "--map", "street.tsm", "--format", "ply", "--report", "m.json", "--out", "m.ply")
        self.assertEqual(report["voxels"] - report["moved_voxels"], json.loads((self.folder / "m.json").read_text())["voxels"])

    def test_certainty_of_a_local_map(self):
        for layer in ("variance", "probability"):
            self.done("export", "--map", self.a, "--format", "png", "--show", layer, "--out", "a.png")
        self.done("export", "--map", self.a, "--format", "ply", "--show", "variance", "--out", "a.ply")
        self.assertNotIn(b"robots", (self.folder / "a.ply").read_bytes().partition(b"end_header")[0])

    def test_heights(self):
        """In eight steps between the heights that 2 % are below and above; by itself where no voxel has a label."""
        points = [(2.05, 0.05 + 0.2 * i, 0.05 + 0.1 * i) for i in range(16)]
        labelled = self.make_map("labelled", points, [kitti.ROAD] * len(points))
        bare = self.make_map("bare", points, [kitti.ROAD] * len(points), "--labels", "none")

        def colours(name, *words):
            self.done("export", "--map", name, "--format", "ply", "--out", "h.ply", *words)
            head, _, body = (self.folder / "h.ply").read_bytes().partition(b"end_header\n")
            rows = struct.Struct("<3f3BB3f").iter_unpack(body)
            return {round(row[2], 2): row[3:6] for row in rows}
        by_height = colours(labelled, "--show", "height")
        self.assertEqual(by_height, colours(bare))
        self.assertEqual({(128, 128, 128)}, set(colours(bare, "--show", "variance").values()))
        self.assertEqual(1, len(set(colours(labelled).values())))
        steps = [by_height[z] for z in sorted(by_height)]
        self.assertEqual(8, len(set(steps)))
        self.assertEqual(steps, sorted(steps, key=lambda colour: 0.3 * colour[0] + 0.6 * colour[1] + 0.1 * colour[2]))

    def test_one_scale_for_all_voxels_of_a_table(self):
        """More voxels than are coloured at once: one colour for one height, and class wherever some voxel has a label."""
        steps = range(1100)
        scans = [kitti.Scan([(2.05 + 0.1 * (i % 40), 0.05 + 0.1 * (i // 40), 0.05 + 0.1 * level) for i in steps], [kitti.UNLABELLED] * len(steps))
                 for level in range(62)]
        bare = kitti.write_dataset(self.folder / "bare", scans)
        scans.append(kitti.Scan([(2.05, 0.05, 10.05)], [kitti.ROAD]))
        labelled = kitti.write_dataset(self.folder / "labelled", scans)
        for data in (bare, labelled):
            self.map_dataset(data, f"{data}.tsm", *COUNTING)
            self.done("export", "--map", f"{data}.tsm", "--format", "npy", "--out", f"{data}.npy", "--report", "g.json")
            content = (self.folder / f"{data}.npy").read_bytes()
            start = 10 + struct.unpack("<H", content[8:10])[0]
            rows = list(struct.Struct("<3f5B3f21f").iter_unpack(content[start:]))
            self.assertGreater(len(rows), 1 << 16)
            colours = {(round(row[2], 2), row[3:6]) for row in rows}
            show = json.loads((self.folder / "g.json").read_text())["config"]["show"]
            if data == bare:
                self.assertEqual(("height", 62, 8), (show, len(colours), len({colour for _, colour in colours})))
            else:
                self.assertEqual(("class", 2), (show, len({colour for _, colour in colours})))

    def test_a_layer_that_is_given_stays(self):
        bare = self.make_map("bare", [(2.05, 0.05, 0.05), (2.05, 0.05, 3.05)], [kitti.UNLABELLED] * 2)
        pictures = {}
        for words in ((), ("--show", "class"), ("--show", "height")):
            self.done("export", "--map", bare, "--format", "png", "--out", "g.png", "--report", "g.json", *words)
            config = json.loads((self.folder / "g.json").read_text())["config"]
            pictures[words[-1:]] = (config["show"], config["title"], (self.folder / "g.png").read_bytes())
        self.assertEqual(pictures[()], pictures[("height",)])
        self.assertEqual(("height", "bare.tsm: height"), pictures[()][:2])
        self.assertEqual(("class", "bare.tsm"), pictures[("class",)][:2])
        self.assertNotEqual(pictures[()][2], pictures[("class",)][2])

    def refused_show(self, layer, *words, saying, of_map="g.tsm"):
        self.refused("export", "--map", of_map, "--format", "png", "--out", "no.png", "--show", layer, *words,
                     saying=saying)
        self.assertFalse((self.folder / "no.png").exists())

    def test_bad_usage(self):
        self.fuse(self.a, self.b)
        self.refused_show("robots", saying=["--show robots"])
        for layer in ROBOTS:
            self.refused_show(layer, saying=[f"--show {layer}", "--of"])
            self.refused_show(layer, "--of", self.a, "g.tsm", saying=["g.tsm", "global map"])
            self.refused_show(layer, "--of", self.a, self.b, saying=["a.tsm", "local map"], of_map="data_a/../a.tsm")
        for layer in ("class", "variance", "probability"):
            self.refused_show(layer, "--of", self.a, self.b, saying=["--of goes with"])
            self.refused_show(layer, "--transform", "a.tsm=T.txt", saying=["--transform goes with"])
        self.refused_show("contributors", "--of", self.a, "none.tsm", saying=["none.tsm"])
        self.refused_show("contributors", "--of", self.a, "--transform", "b.tsm=T.txt", saying=["b.tsm"])
        self.refused("export", "--map", "g.tsm", "--format", "png", "--show", "contributors", "--of", self.a, self.b,
                     "--out", self.a, saying=["--out", "--of"])

    def test_refuses_maps_that_do_not_go_with_it(self):
        self.fuse(self.a, self.b)
        coarse = self.make_map("coarse", [self.AGREED], [kitti.ROAD], "--resolution", "0.2")
        self.refused_show("contributors", "--of", coarse, saying=[coarse, "resolution 0.2", "0.1"])
        folder = kitti.write_dataset(self.folder / "other", [kitti.Scan([self.AGREED], [1])])
        (folder / "classes.toml").write_text('[[class]]\nid = 1\nname = "grass"\ncolor = [0, 255, 0]\nraw = [1]\n')
        self.map_dataset(folder, self.folder / "other.tsm", *COUNTING)
        self.refused_show("contributors", "--of", "other.tsm", saying=["other.tsm", "classes"])


if __name__ == "__main__":
    unittest.main()
