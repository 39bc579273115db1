# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Depth images with label images, a camera and poses: a scene whose map follows from geometry; what does not fit is refused."""
import json
import struct
import unittest
import zlib

import kitti_folder as kitti
from command_case import MEMORY, CommandCase

WIDTH, HEIGHT, FOCAL, CENTRE = 64, 48, 60.0, (31.5, 23.5)
WALL_M, BOX_M, SCALE_M = 4.03, 2.03, 0.0005
CAMERA = (f'model = "pinhole"\nwidth = {WIDTH}\nheight = {HEIGHT}\nfocal = [{FOCAL}, {FOCAL}]\n'
          f"centre = [{CENTRE[0]}, {CENTRE[1]}]\ndepth_scale = {SCALE_M}\n")
# The camera looks along the map's x: its x is the map's -y, its y the map's -z.
POSE = "0 0 1 {x} -1 0 0 0 0 -1 0 0"


def png(rows, bits, color=0):
    """rows: of values."""
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
    packed = b"".join(b"\0" + struct.pack(f">{len(row)}{'H' if bits == 16 else 'B'}", *row) for row in rows)
    width = len(rows[0]) // (3 if color == 2 else 1)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, len(rows), bits, color, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(packed)) + chunk(b"IEND", b""))


def is_box(column, row):
    return 20 <= column < 40 and 10 <= row < 30


def depth_m(column, row, moved_m):
    """A wall across the axis, a box before it, and a corner without depth."""
    if column < 4 and row < 4:
        return 0.0
    return (BOX_M if is_box(column, row) else WALL_M) - moved_m


class DepthCase(CommandCase):
    def setUp(self):
        super().setUp()
        for name in ("depth", "labels"):
            (self.folder / name).mkdir()
        (self.folder / "camera.toml").write_text(CAMERA)
        self.moved = (0.0, 0.5)
        for i, moved_m in enumerate(self.moved):
            self.write_images(i, moved_m)
        self.write_poses(POSE.format(x=x) for x in self.moved)

    def write_poses(self, rows):
        (self.folder / "poses.txt").write_text("".join(row + "\n" for row in rows))

    def write_images(self, number, moved_m, label_bits=8, box=kitti.CAR, wall=kitti.BUILDING):
        pixels = [[(column, row) for column in range(WIDTH)] for row in range(HEIGHT)]
        # The image of what the first one sees, from nearer: by the same pixels only for what fills the view.
        depths = [[round(depth_m(*pixel, moved_m) / SCALE_M) if depth_m(*pixel, 0) else 0 for pixel in row] for row in pixels]
        labels = [[box if is_box(*pixel) else wall for pixel in row] for row in pixels]
        (self.folder / "depth" / f"{number}.png").write_bytes(png(depths, 16))
        (self.folder / "labels" / f"{number}.png").write_bytes(png(labels, label_bits))

    def map_depth(self, *options, labels=True):
        given = ("--label-images", "labels") if labels else ()
        result = self.done("map", "--depth", "depth", *given, "--intrinsics", "camera.toml", "--poses", "poses.txt", "--out",
                           "map.tsm", "--report", "map.json", "--inference", "counting", *MEMORY, *options)
        return result, json.loads((self.folder / "map.json").read_text())

    def depth_refused(self, *saying, options=()):
        given = ("--depth", "depth", "--label-images", "labels", "--intrinsics", "camera.toml", "--poses", "poses.txt")
        self.refused("map", *given, "--out", "no.tsm", *MEMORY, *options, saying=saying)
        self.assertFalse((self.folder / "no.tsm").exists())

    def states_at(self, pixels):
        """Of what the first image has in these pixels."""
        text = "x,y,z\n"
        for column, row in pixels:
            depth = depth_m(column, row, 0.0)
            text += f"{depth},{-(column - CENTRE[0]) / FOCAL * depth},{-(row - CENTRE[1]) / FOCAL * depth}\n"
        return self.query_rows("map.tsm", text)[1]


class Mapped(DepthCase):
    def test_a_wall_and_a_box_are_where_they_are(self):
        result, report = self.map_depth("--last", "0")
        self.assert_not_warned(result)
        boxes = [(column, row) for column in range(22, 38) for row in range(12, 28)]
        walls = [(column, row) for column in range(44, 62) for row in range(34, 46)]
        for pixels, label in ((boxes, kitti.CAR_LABEL), (walls, kitti.BUILDING_LABEL)):
            for state in self.states_at(pixels):
                self.assertEqual(("occupied", str(label)), (state["state"], state["label"]))
        self.assertEqual(16, report["scans"][0]["depth"]["no_depth"])
        self.assertEqual(WIDTH * HEIGHT - 16, report["scans"][0]["depth"]["points"])
        self.assertEqual({"images": 1, "points": WIDTH * HEIGHT - 16, "no_depth": 16, "refused": 0},
                         report["totals"]["depth"])
        self.assertEqual("images", report["config"]["labels"])
        # Nothing but the wall and the box is occupied.
        self.done("export", "--map", "map.tsm", "--format", "csv", "--out", "map.csv")
        for line in (self.folder / "map.csv").read_text().splitlines()[1:]:
            self.assertIn(line.split(",")[0], ("2.05", "4.05"))
        # Before the box is free, behind it unknown.
        _, rows = self.query_rows("map.tsm", "x,y,z\n1.05,0.05,0.05\n3.05,0.05,0.05\n")
        self.assertEqual(["free", "unknown"], [row["state"] for row in rows])

    def test_poses_place_the_camera(self):
        _, both = self.map_depth()
        self.assertEqual([0, 1], [scan["index"] for scan in both["scans"]])
        for state in self.states_at([(44, 34), (60, 44)]):
            self.assertEqual("occupied", state["state"])
        turned = "0.5 -0.5 0.5 -0.5"  # qx qy qz qw of the same rotation.
        self.write_poses(f"{i} {x} 0 0 {turned}" for i, x in enumerate(self.moved))
        self.assertEqual(both["digest"], self.map_depth()[1]["digest"])

    def test_labels_of_16_bits_and_unknown_ones(self):
        _, expected = self.map_depth("--last", "0")
        self.write_images(0, 0.0, label_bits=16)
        self.assertEqual(expected["digest"], self.map_depth("--last", "0")[1]["digest"])
        self.write_images(0, 0.0, label_bits=16, box=777)
        result, report = self.map_depth("--last", "0")
        self.assertEqual(400, report["totals"]["unknown_ids"])
        self.assert_warned(result, "777")

    def test_without_label_images_all_is_unlabelled(self):
        result, report = self.map_depth("--last", "0", labels=False)
        self.assert_not_warned(result)
        self.assertEqual("none", report["config"]["labels"])
        self.assertEqual({"0"}, {state["label"] for state in self.states_at([(30, 20), (50, 40)])})

    def test_limits_steps_and_depth_along_rays(self):
        (self.folder / "camera.toml").write_text(CAMERA + "step = 2\nmax_depth = 3.0\n")
        _, report = self.map_depth("--last", "0")
        depth = report["scans"][0]["depth"]
        self.assertEqual((WIDTH * HEIGHT // 4, 100, 4), (sum(depth[key] for key in (
            "points", "no_depth", "too_near", "too_far", "flying", "no_ray")), depth["points"], depth["no_depth"]))
        (self.folder / "camera.toml").write_text(CAMERA + 'depth_along = "ray"\n')
        self.map_depth("--last", "0")
        corner = self.states_at([(60, 44)])[0]
        self.assertNotEqual("occupied", corner["state"])


class Refused(DepthCase):
    def test_images_that_do_not_fit(self):
        for name, content, says in (("depth", png([[40] * WIDTH] * HEIGHT, 8), "not a 16-bit grey PNG"),
                                    ("depth", png([[40] * 60] * HEIGHT, 16), "60 x 48 pixels, but its camera 64 x 48"),
                                    ("labels", png([[40] * WIDTH] * 40, 8), "64 x 40 pixels"),
                                    ("labels", png([[40] * 3 * WIDTH] * HEIGHT, 8, color=2), "8- or 16-bit grey"),
                                    ("depth", b"P5", "not an intact PNG")):
            with self.subTest(says):
                path = self.folder / name / "0.png"
                good = path.read_bytes()
                path.write_bytes(content)
                self.depth_refused(f"{name}/0.png", says)
                path.write_bytes(good[:-20])
                self.depth_refused(f"{name}/0.png", "not an intact PNG")
                path.write_bytes(good)

    def test_files_that_are_missing(self):
        (self.folder / "labels" / "1.png").unlink()
        self.depth_refused("labels/1.png is missing")
        self.write_poses([POSE.format(x=0)])
        self.depth_refused("depth has 2 .png files", "has 1 poses")
        for path in (self.folder / "depth").iterdir():
            path.unlink()
        self.depth_refused("there are no .png files in depth")

    def test_cameras_that_are_none(self):
        for text, says in ((CAMERA.replace("depth_scale", "scale"), "unknown key 'scale'"),
                           ("".join(CAMERA.splitlines(keepends=True)[:-1]), "no 'depth_scale'"),
                           (CAMERA.replace("0.0005", "0"), "depth_scale is not a number in its range"),
                           (CAMERA.replace("= 64", "= 0"), "width"), (CAMERA.replace("[60.0", "[-60.0"), "focal"),
                           (CAMERA + "step = 100\n", "step"), (CAMERA + "step = 1.7\n", "step is not a whole number of pixels"), (CAMERA + 'depth_along = "z"\n', "depth_along is 'z'"),
                           (CAMERA + "min_depth = 20\n", "max_depth is less"), (CAMERA + "x =\n", "not valid TOML"),
                           (CAMERA.replace("= 64", "= 16384").replace("= 48", "= 16384").replace("60.0", "16000.0"),
                            "the limit is")):
            with self.subTest(says):
                (self.folder / "camera.toml").write_text(text)
                self.depth_refused("camera.toml", says)

    def test_options_that_do_not_go_together(self):
        self.depth_refused("mutually exclusive; give one", options=("--pcd", "depth"))
        self.depth_refused("--label-images", options=("--labels", "predictions"))
        self.depth_refused("leave --label-images out", options=("--labels", "none"))
        self.depth_refused("--deskew", options=("--deskew", "on"))
        given = ("map", "--out", "no.tsm", "--depth", "depth")
        self.refused(*given, "--poses", "poses.txt", saying=("--intrinsics",))
        self.refused(*given, "--intrinsics", "camera.toml", saying=("--depth needs a pose",))
        self.refused("map", "--out", "no.tsm", "--pcd", "depth", "--poses", "poses.txt", "--intrinsics", "camera.toml",
                     saying=("are for --depth",))
        self.refused(*given, "--poses", "poses.txt", "--intrinsics", "camera.toml", "--report", "depth/0.png",
                     saying=("depth/0.png",))


if __name__ == "__main__":
    unittest.main()
