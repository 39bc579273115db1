# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera node in submaps: cut by the way, cut where poses jump, moved by corrections of a pose graph."""
import csv
import json
import math
import time
import unittest

import own_network
from fault_case import Faults
from node_case import PlayedCase
from sensor_sender import WALL_CLASS

own_network.enter_or_skip()

SUBMAP_M = 2


def rows_of(path):
    return [[float(word) for word in line.split()] for line in path.read_text().splitlines()]


class Drive(PlayedCase):
    SCANS = 16

    def run_node(self, *options, **output):
        return self.run_with_player(self.in_submaps(output=output), *options)

    def in_submaps(self, **changes):
        tables = {"robot": {"restart": "empty"}, "run": {"silence_s": 2, "duration_s": None}, "map": {"submap_m": SUBMAP_M, "memory": "96M"}}
        for table, keys in changes.items():
            tables[table] = {**tables.get(table, {}), **keys}
        tables["output"] = {"local_map": "local.tsm", **tables.get("output", {})}
        tables["map"]["deadline_ms"] = 1000
        tables["run"]["wait_for_peers"] = 0
        return self.sensing(**tables)

    def info(self, map_file):
        self.done("info", map_file, "--verify", "--report", "info.json")
        return json.loads((self.folder / "info.json").read_text())

    def voxels(self, map_file):
        """Indices of the voxels with a label, or occupied."""
        self.done("export", "--map", map_file, "--format", "csv", "--out", "voxels.csv")
        with open(self.folder / "voxels.csv") as file:
            return {(row["x"], row["y"], row["z"]) for row in csv.DictReader(file)}

    @staticmethod
    def middle(voxels):
        return [sum(float(place[axis]) for place in voxels) / len(voxels) for axis in range(3)]

    def write_moved(self, name, rows, x_m):
        """Poses of the dataset, of its camera, moved by so much to the robot's front at the begin: z of the camera."""
        lines = [row[:11] + [row[11] + x_m] for row in rows]
        (self.folder / name).write_text("".join(" ".join(map(repr, row)) + "\n" for row in lines))
        return name

    def test_a_drive_in_submaps_and_what_corrections_move(self):
        """One drive three times: in submaps, in one piece, and with the corrections of a pose graph."""
        report, _ = self.run_node(global_map="plain.tsm")
        submaps = report["submaps"]
        self.assertGreaterEqual(submaps["by_length"], 3)
        self.assertEqual((0, 0, 0), (submaps["left_out"], submaps["lost_blocks"], submaps["cut_short"]))
        info = self.info("local.tsm")
        self.assertEqual(("submaps", report["local_digest"]), (info["kind"], info["digest"]))
        self.assertEqual(list(range(submaps["number"] + 1)), [s["number"] for s in info["submaps"]])
        scans = [n for s in info["submaps"] for n in range(s["first_scan"], s["last_scan"] + 1)]
        self.assertEqual(list(range(report["scans"]["integrated"])), scans)
        # What others hear of it is all of them.
        own = [c["submap"] for c in report["contributions"] if c["own"] and "objections" not in c]
        self.assertEqual(list(range(submaps["number"] + 1)), own)
        # Nothing is left of their files.
        self.assertEqual([], list((self.folder / "state").glob("*.tsm")))

        whole, _ = self.run_with_player(self.in_submaps(map={"submap_m": 0}, output={"local_map": "whole.tsm"}))
        self.assertEqual(whole["scans"]["integrated"], report["scans"]["integrated"])
        together, one = (self.voxels(name) for name in ("local.tsm", "whole.tsm"))
        self.assertGreater(len(together & one), 0.95 * len(together | one))

        rows = rows_of(self.folder / self.street / "robot_0/poses.txt")
        first = self.write_moved("first.txt", rows[: self.SCANS // 2], 1.0)
        last = self.write_moved("last.txt", rows, 3.2)
        report, error = self.run_node("--corrections", first, "--corrections", last, global_map="moved.tsm")
        submaps = report["submaps"]
        self.assertEqual((2, 0, 2), (submaps["corrections"], submaps["refused_corrections"], submaps["revision"]))
        self.assertAlmostEqual(2.2, submaps["corrected_most_m"], 2)
        self.assertIn("correction 1: ", error)
        self.assertIn("correction 2: ", error)
        for submap in self.info("local.tsm")["submaps"]:
            T = submap["T_map_submap"]
            self.assertAlmostEqual(3.2, math.hypot(T[3], T[7], T[11]), 2)
            self.assertGreaterEqual(submap["revision"], 2)
        # The global map is there, too.
        there, plain = (self.middle(self.voxels(name)) for name in ("moved.tsm", "plain.tsm"))
        self.assertAlmostEqual(3.2, math.dist(there, plain), delta=0.05)

    def test_what_does_not_go_together(self):
        config = self.config(0, map={"submap_m": 20, "window_m": 30, "archive": "blocks"})
        self.refused("node", "--config", config, saying=("submap_m", "window_m"))


class Jump(Faults):
    def test_poses_that_jump_begin_a_submap_and_mapping_goes_on(self):
        node, sensors = self.mapping(map={"submap_m": 1000})
        time.sleep(0.5)
        sensors.position = [50.0, 0.0, 0.0]
        node.says("poses are of another frame than before: submap 1 begins")
        time.sleep(0.5)
        report = node.end()
        self.assertEqual((1, 0, 1), (report["sensors"]["relocations"], report["mapping"]["clears"], report["submaps"]["by_jump"]))
        self.assertEqual(0, report["submaps"]["left_out"])
        self.assertEqual([], report["mapping"]["kept_maps"])
        self.assertEqual([("occupied", WALL_CLASS), ("occupied", WALL_CLASS)], self.states_at((5.1, 0.1, 0.1), (55.1, 0.1, 0.1)))


if __name__ == "__main__":
    unittest.main()
