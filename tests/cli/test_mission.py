# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The demo's mission, shorter: two nodes hear LiDAR, cameras and poses of players, share one map, and end by themselves."""
import json
import pathlib
import subprocess
import sys
import unittest

import own_network
from command_case import CommandCase, command_path

SCANS = 2
MISSION = pathlib.Path(__file__).resolve().parents[2] / "examples" / "mission.py"

own_network.enter_or_skip()


class Mission(CommandCase):
    def test_two_nodes_with_eyes_make_one_map(self):
        self.done("simulate", "--robots", 2, "--scans", SCANS, "--cameras", "on", "--sweep", "on", "--out", "street")
        out = self.folder / "out"
        out.mkdir()
        self.done("key", "new", "--robots", 2, "--dir", out)
        # Slowly, for busy machines: a sweep is stretched to 0.4 s.
        done = subprocess.run([sys.executable, "-B", MISSION, command_path(), self.folder / "street", out, "2.5"], capture_output=True, text=True,
                              check=False, timeout=240)
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        reports = [json.loads((out / f"robot_{robot}.json").read_text()) for robot in (0, 1)]
        for report in reports:
            self.assertEqual("quiet", report["ended_by"])
            sensors = report["sensors"]
            self.assertEqual((0, 0), (sensors["malformed"], sensors["kernel_dropped"]))
            self.assertEqual(3 * SCANS, sensors["match"]["images"])
            # A machine that has no time for one of them loses it.
            self.assertGreaterEqual(report["scans"]["integrated"], 1)
            self.assertEqual(report["scans"]["integrated"], sensors["registration"]["deskewed"])
            self.assertEqual(report["scans"]["integrated"], sensors["registration"]["projected"])
            self.assertGreater(sensors["registration"]["labelled"], 1000)
            self.assertEqual((2, True), (len(report["contributions"]), all(c["complete"] for c in report["contributions"])))
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])
        self.assertEqual((out / "global_of_0.tsm").stat().st_size, (out / "global_of_1.tsm").stat().st_size)
        self.assertGreater(reports[0]["global_map"]["label_voxels"], 10000)


if __name__ == "__main__":
    unittest.main()
