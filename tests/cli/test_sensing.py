# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera node with sensors over LCM: it maps what they send, and a planner in another process asks what it has."""
import json
import os
import subprocess
import unittest

import own_network
from command_case import TIME_LIMIT_S
from node_case import PlayedCase

own_network.enter_or_skip()

SCANS = PlayedCase.SCANS
# Good poses that it takes until the first is used.
RECOVER_AFTER = 5


class Sensing(PlayedCase):
    def test_it_maps_what_sensors_send(self):
        report, error = self.run_with_player(self.sensing(output={"local_map": "local.tsm"}, map={"memory": "96M"}))
        sensors = report["sensors"]
        self.assertEqual(SCANS - (RECOVER_AFTER - 1), report["scans"]["integrated"], sensors)
        self.assertEqual((RECOVER_AFTER - 1, RECOVER_AFTER - 1), (sensors["poses_refused"], sensors["match"]["without_pose"]))
        self.assertEqual((0, 0, 0), (sensors["malformed"], sensors["kernel_dropped"], report["mapping"]["lost"]))
        if not os.environ.get("TESSERA_SANITIZE"):
            self.assertEqual(0, report["heap_allocations_after_start"])
        self.assertIn("poses are good", error)
        # The same scans, mapped from their files: poses went by way of quaternions, so not to the last bit.
        self.done("map", "--dataset", f"{self.street}/robot_0", "--first", RECOVER_AFTER - 1, "--resolution", 0.4, "--max-range", 60,
                  "--out", "files.tsm")
        voxels = [self.label_voxels(name) for name in ("local.tsm", "files.tsm")]
        self.assertLess(abs(voxels[0] - voxels[1]), 0.01 * voxels[1])

    def test_directions_without_a_return_clear_as_far_as_it_is_told(self):
        wall = [(5, 0.2 * y, 0.2 * z, 0) for y in range(-10, 11) for z in range(-5, 6)]
        away = [(-1, 0.01 * y, 0.01 * z, 1) for y in range(-20, 21) for z in range(-5, 6)]
        header = ("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
                  "property uchar no_return\nproperty uchar label\nend_header\n").format(len(wall + away))
        (self.folder / "clouds").mkdir()
        for i in range(SCANS):
            (self.folder / "clouds" / f"{i}.ply").write_text(header + "".join("{} {} {} {} 50\n".format(*p) for p in wall + away))
        (self.folder / "poses.txt").write_text("1 0 0 0.05 0 1 0 0.05 0 0 1 0.05\n" * SCANS)
        for range_m, states in ((0, ["unknown", "unknown"]), (6, ["free", "unknown"])):
            config = self.sensing(map={"no_return_range_m": range_m, "memory": "96M", "resolution_m": 0.1}, output={"local_map": "local.tsm"})
            report, _ = self.run_with_player(config, source=("--ply", "clouds", "--poses", "poses.txt"))
            scans = report["scans"]
            self.assertGreater(scans["integrated"], 0)
            self.assertEqual(scans["integrated"] * len(away), scans["no_return"])
            _, found = self.query_rows("local.tsm", "x,y,z\n-3.95,0.05,0.05\n-7.95,0.05,0.05\n")
            self.assertEqual(states, [row["state"] for row in found])

    def label_voxels(self, map_file):
        self.done("info", map_file, "--report", "info.json")
        return json.loads((self.folder / "info.json").read_text())["label_voxels"]

    def test_a_planner_asks_while_it_maps(self):
        planner = os.environ["TESSERA_PLANNER"]
        answers = []

        def ask():
            result = subprocess.run([planner, "udpm://239.255.76.69:7669?ttl=0", "0", "0", "0"], cwd=self.folder, text=True,
                                    capture_output=True, timeout=TIME_LIMIT_S)
            answers.append(result)
        report, _ = self.run_with_player(self.sensing(), meanwhile=ask)
        self.assertEqual(0, answers[0].returncode, answers[0].stderr)
        self.assertGreater(report["queries"]["answered"], 0)
        self.assertEqual(0, report["queries"]["malformed"])

    def test_a_budget_that_is_too_small_sheds_work_and_loses_no_scan(self):
        report, error = self.run_with_player(self.sensing(map={"deadline_ms": 1, "memory": "96M"}))
        mapping = report["mapping"]
        self.assertEqual((SCANS - (RECOVER_AFTER - 1), 0), (mapping["cycles"], mapping["lost"]))
        self.assertGreater(mapping["shed"], 0)
        self.assertIn("points and rays left out, to be in time", error)
        # The one limit that held is the one that is named.
        self.assertEqual((0, 0), (mapping["refused_memory"], mapping["refused_work"]))
        self.assertGreater(mapping["refused_time"], 0)
        self.assertIn("as the time was up; give a longer [map] deadline_ms", error)
        self.assertNotIn("give a larger [map] memory", error)
        self.assertIn("scans mapped: ", error)

    def test_without_poses_nothing_is_mapped_and_it_says_so(self):
        report, error = self.run_with_player(self.sensing(), "--poses", "none")
        self.assertEqual(0, report["scans"]["integrated"])
        self.assertEqual(SCANS, report["sensors"]["match"]["without_pose"])
        self.assertIn("there are no poses", error)

    def test_settings_that_contradict_each_other(self):
        for changes, words in (({"replay": {"dataset": "street/robot_0"}}, "excludes [replay] dataset"),
                               ({"sensors": {"poses": "can"}}, "name [vehicle] can"),
                               ({"sensors": {"clouds": "none"}}, "depth_camera"),
                               ({"sensors": {"clouds": "raw"}}, "needs cameras"),
                               ({"vehicle": {"sectors": 20}}, "neither 16 nor 32"),
                               ({"vehicle": {"base_id": 100}}, "multiple of 32")):
            with self.subTest(words):
                self.refused("node", "--check", "--config", self.sensing(**changes), saying=(words,))


if __name__ == "__main__":
    unittest.main()
