# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded scans of every format: what map makes of them, convert keeps and a node replays, to the same map."""
import json
import unittest

import kitti_folder as kitti
import own_network
from node_case import NodeCase
from test_clouds import pcd_binary, ply_little
from test_depth import CAMERA, HEIGHT, POSE, WIDTH, depth_m, is_box, png, SCALE_M

IN_OWN_NETWORK = own_network.enter()
MEMORY = ("--memory", "64M")
SWEPT_SCANS = 3
ROW = "1 0 0 {x} 0 1 0 0 0 0 1 0"


class Formats(NodeCase):
    """Each format: its name, and its options; the keys of [replay] are the same."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.swept = cls.class_folder() + "/street"
        cls.simulate(cls.swept, "--robots", 1, "--scans", SWEPT_SCANS, "--cameras", "on", "--sweep", "on", "--topk", 3)

    def setUp(self):
        super().setUp()
        self.scans = [kitti.corner_scan(i + 1, pose=kitti.moved(i / 3)) for i in range(3)]

    def write_poses(self, name, rows):
        path = self.folder / name
        path.write_text("".join(row + "\n" for row in rows))
        return str(path)

    def clouds(self, extension, write):
        root = self.folder / extension
        root.mkdir()
        for number, scan in enumerate(self.scans):
            (root / f"scan_{number + 8}.{extension}").write_bytes(write(scan))
        return str(root)

    def depth(self):
        for name in ("depth", "labels"):
            (self.folder / name).mkdir()
        for number, moved_m in enumerate((0.0, 1 / 3)):
            pixels = [[(column, row) for column in range(WIDTH)] for row in range(HEIGHT)]
            depths = [[round(depth_m(*pixel, moved_m) / SCALE_M) if depth_m(*pixel, 0) else 0 for pixel in row]
                      for row in pixels]
            labels = [[kitti.CAR if is_box(*pixel) else kitti.BUILDING for pixel in row] for row in pixels]
            (self.folder / "depth" / f"{number}.png").write_bytes(png(depths, 16))
            (self.folder / "labels" / f"{number}.png").write_bytes(png(labels, 8))
        (self.folder / "camera.toml").write_text(CAMERA)
        poses = self.write_poses("camera_poses.txt", [POSE.format(x=x) for x in (0.0, 1 / 3)])
        return {"depth": str(self.folder / "depth"), "label_images": str(self.folder / "labels"),
                "intrinsics": str(self.folder / "camera.toml"), "poses": poses}

    def formats(self):
        data = f"{self.swept}/robot_0"
        yield "labels", {"dataset": data}
        yield "labels with weights", {"dataset": data, "labels": "topk"}
        yield "cameras", {"dataset": data, "labels": "cameras"}
        yield "not deskewed", {"dataset": data, "deskew": "off", "first": 1}
        plain = kitti.write_dataset(self.folder / "plain", self.scans)
        yield "plain", {"dataset": str(plain)}
        rows = [f"{100 + i / 10} {i / 3} 0 0 0 0 0.6 0.8" for i in range(3)]
        yield "pcd, TUM", {"pcd": self.clouds("pcd", pcd_binary), "poses": self.write_poses("tum.txt", rows)}
        rows = [ROW.format(x=i / 3) + " 0 0 0 1" for i in range(3)]
        yield "ply, 4x4", {"ply": self.clouds("ply", ply_little), "poses": self.write_poses("square.txt", rows), "last": 1}
        yield "depth", self.depth()

    def mapped(self, name, keys):
        """The bytes of the map."""
        out = self.folder / name
        self.done("map", *self.options(keys), "--out", out, "--report", "map.json", *MEMORY)
        return out.read_bytes()

    @staticmethod
    def options(keys):
        return [word for key, value in keys.items() for word in ("--" + key.replace("_", "-"), value)]

    def info(self, name):
        report = self.folder / "info.json"
        self.done("info", name, "--report", report)
        return json.loads(report.read_text())

    def digest(self, name):
        return self.info(name)["digest"]


class Converted(Formats):
    def test_what_is_written_makes_the_same_map(self):
        for name, keys in self.formats():
            with self.subTest(name):
                expected = self.mapped("from.tsm", keys)
                out = self.folder / ("from " + name)
                result = self.done("convert", *self.options(keys), "--out", out, "--report", "convert.json")
                self.assertIn(f"in {out}", result.stdout)
                report, of_map = (json.loads((self.folder / f"{made}.json").read_text()) for made in ("convert", "map"))
                for key in ("labels", "deskew"):
                    self.assertEqual(of_map["config"][key], report["config"][key])
                self.assertEqual(report["scans"], len(list((out / "velodyne").iterdir())))
                # Points that are not corrected are written with what corrects them.
                again = {"dataset": str(out)} | ({"deskew": "off"} if "deskew" in keys else {})
                actual = self.mapped("to.tsm", again)
                self.assertEqual(self.digest("from.tsm"), self.digest("to.tsm"))
                # The file also records where labels came from, and what was deskewed.
                if "dataset" in keys and "labels" not in keys:
                    self.assertEqual(expected, actual)

    def test_without_deskewing_nothing_that_corrects_motion_is_lost(self):
        keys = {"dataset": f"{self.swept}/robot_0"}
        self.done("convert", *self.options(keys), "--deskew", "off", "--out", "raw")
        self.assertEqual(self.mapped("from.tsm", keys), self.mapped("to.tsm", {"dataset": "raw"}))
        source = self.swept + "/robot_0/times/000001.bin"
        with open(source, "rb") as times:
            self.assertEqual(times.read(), (self.folder / "raw/times/000001.bin").read_bytes())

    def test_times_and_frame_go_with_the_scans(self):
        rows = [f"{100 + i / 10} {i / 3} 0 0 0 0 0 1" for i in range(3)]
        clouds = self.clouds("pcd", pcd_binary)
        (self.folder / "pcd" / "T_global_map.txt").write_text("1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n")
        self.done("convert", "--pcd", clouds, "--poses", self.write_poses("tum.txt", rows), "--first", 1, "--out", "made")
        made = self.folder / "made"
        self.assertEqual("100.100000\n100.200000\n", (made / "times.txt").read_text())
        self.assertIn("1 0 0 5", (made / "T_global_map.txt").read_text())
        self.assertIn("0.33333333333333331", (made / "poses.txt").read_text())

    def test_what_is_refused(self):
        data = str(kitti.write_dataset(self.folder / "plain", self.scans))
        self.refused("convert", "--dataset", data, saying=("--out",))
        self.refused("convert", "--out", "made", saying=("--dataset has no folder",))
        self.refused("convert", "--dataset", data, "--out", data, saying=("has files", "new folder"))
        self.refused("convert", "--pcd", data, "--out", "made", saying=("--pcd needs a pose",))
        # Later commands would move the points and not the labels.
        self.refused("convert", "--dataset", f"{self.swept}/robot_0", "--labels", "cameras", "--deskew", "off", "--out", "made",
                     saying=("--labels cameras", "--deskew"))
        self.refused("convert", "--dataset", data, "--labels", "nowhere", "--out", "made", saying=("nowhere",))
        self.assertFalse((self.folder / "made").exists())


class Replayed(Formats):
    def replayed(self, keys, **tables):
        run = {"wait_for_peers": 0, "quiet_s": 0.2, "linger_s": 0}
        output = {"global_map": None, "contribution": None, "local_map": "node.tsm", "report": None}
        config = self.config(0, replay={"dataset": None, **keys}, map={"resolution_m": None, "max_range_m": None, "memory": "64M"},
                             run=run, output=output, **tables)
        return config

    def test_a_node_makes_the_map_of_map(self):
        if not IN_OWN_NETWORK:
            self.skipTest("skipped: no network namespaces are permitted here")
        for name, keys in self.formats():
            with self.subTest(name):
                self.mapped("from.tsm", keys)
                self.done("node", "--config", self.replayed(keys))
                self.assertEqual(self.digest("from.tsm"), self.digest("node.tsm"))
                recorded, of_map = (self.info(name)["settings"] for name in ("node.tsm", "from.tsm"))
                self.assertEqual([], [key for key in keys if key in recorded and key not in ("labels", "deskew")])
                self.assertEqual(of_map["labels"], recorded["labels"])

    def test_a_record_that_is_too_long_is_counted(self):
        if not IN_OWN_NETWORK:
            self.skipTest("skipped: no network namespaces are permitted here")
        data = str(kitti.write_dataset(self.folder / "plain", self.scans))
        config = self.replayed({"dataset": data, "labels": "./" * 1100 + "predictions"})
        result = self.done("node", "--config", config)
        self.assert_warned(result, "without the record of its settings, which is too long")
        self.assertEqual("", self.info("node.tsm")["settings"])

    def test_what_is_refused(self):
        data = f"{self.swept}/robot_0"
        for keys, *saying in (({"pcd": data}, "[replay]", "poses"), ({"dataset": data, "ply": data}, "mutually exclusive"),
                              ({"dataset": data, "poses": "p"}, "[replay]", "poses"),
                              ({"dataset": data, "deskew": "maybe"}, "[replay]", "deskew"),
                              ({}, "[replay] dataset", "is missing")):
            with self.subTest(keys):
                self.refused("node", "--check", "--config", self.replayed(keys), saying=saying)
        self.refused("node", "--check", "--config", self.replayed({"ply": data}, sensors={"cameras": "c.toml"}),
                     saying=("[sensors]", "excludes [replay] ply"))


class Played(Formats):
    def test_play_sends_every_format(self):
        if not IN_OWN_NETWORK:
            self.skipTest("skipped: no network namespaces are permitted here")
        for name, keys in self.formats():
            for messages in ("semantic", "raw"):
                with self.subTest(name, messages=messages):
                    chosen = {key: value for key, value in keys.items() if key != "labels" or messages == "semantic"}
                    self.done("play", *self.options(chosen), "--messages", messages, "--rate", 50, "--report", "play.json")
                    report = json.loads((self.folder / "play.json").read_text())
                    scans = report["scans"]
                    self.assertIn(scans, (2, 3))
                    self.assertGreaterEqual(report["poses"], scans)
                    # Of three cameras, or of the depth camera.
                    images = {"depth": scans}.get(name, 3 * scans if self.swept in keys.get("dataset", "") else 0)
                    self.assertEqual(images if messages == "raw" else 0, report["images"])
                    self.assertEqual("lcm", report["config"]["poses"])

    def test_what_is_refused(self):
        data = f"{self.swept}/robot_0"
        self.refused("play", "--pcd", data, saying=("--pcd needs a pose",))
        self.refused("play", "--pcd", data, "--poses", "none", saying=("--pcd needs a pose",))
        self.refused("play", "--pcd", data, "--poses", "p", "--send-poses", "bus", saying=("--send-poses bus",))
        self.refused("play", "--dataset", data, "--send-poses", "p", saying=("--send-poses p", "lcm, can or none"))
        self.refused("play", "--dataset", data, "--send-poses", "can", saying=("--send-poses can needs a bus",))
        self.refused("play", "--dataset", data, "--can", "can0", saying=("need --send-poses can",))
        self.refused("play", "--dataset", data, "--poses", "can", saying=("--poses can needs a bus",))
        self.refused("play", "--dataset", data, "--poses", "p", saying=("--poses p", "lcm, can or none"))
        self.refused("play", "--dataset", data, "--messages", "raw", "--deskew", "on", saying=("--messages raw",))


if __name__ == "__main__":
    unittest.main()
