# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What the README says the mapping reaches, on recorded scans: a network's labels get better by mapping them. Skipped
where the scans are not at hand; a $TESSERA_DATA that does not hold them is an error."""
import json
import os
import pathlib
import sys
import unittest
from unittest import mock

import command_case
from command_case import CommandCase

BESIDE_SOURCES = pathlib.Path(__file__).resolve().parents[3] / "shared" / "data"
ROOT = pathlib.Path(os.environ.get("TESSERA_DATA", BESIDE_SOURCES))
SEQUENCE = ROOT / "semantickitti_08"
SCANS = ("--first", 0, "--last", 5)
SETTINGS = ("--resolution", 0.1)
LARGE = ("--memory", "2G")
STANDS = ("--without", "252,253,254,255,256,257,258,259")
SLOW_BUILD_LIMIT_S = 500


def setUpModule():
    if SEQUENCE.is_dir():
        return
    if "TESSERA_DATA" in os.environ:
        raise RuntimeError(f"TESSERA_DATA is {ROOT}, which does not hold semantickitti_08")
    # ctest looks for this sentence.
    print(f"skipped: no given data: {SEQUENCE} is not there; set TESSERA_DATA", file=sys.stderr)
    raise unittest.SkipTest("no given data")


@mock.patch.object(command_case, "TIME_LIMIT_S", SLOW_BUILD_LIMIT_S)
class Reach(CommandCase):
    def map_and_score(self, *options, reach_m=40, points=()):
        """Both reports, and the gain: mean IoU of the map less that of its input on the same points, in points. points: options of eval
        that choose them."""
        map_file, mapped, scored = (self.folder / name for name in ("map.tsm", "map.json", "eval.json"))
        self.done("map", "--dataset", SEQUENCE, *SCANS, *SETTINGS, "--max-range", reach_m, *options, "--out", map_file, "--report", mapped)
        self.done("eval", "--map", map_file, "--dataset", SEQUENCE, *SCANS, *points, "--report", scored)
        mapping, score = json.loads(mapped.read_text()), json.loads(scored.read_text())
        self.assertEqual(0, mapping["memory"]["refused"])
        self.assertEqual(0, mapping["heap_allocations_after_init"] or 0)  # null where they cannot be counted
        self.assertGreater(score["coverage"], 0.997 if points else 0.999)
        self.assertGreater(score["points"], 100000)
        return mapping, score, 100 * (score["mean_iou"] - score["input_mean_iou"])

    def test_kernel(self):
        _, _, gain = self.map_and_score("--inference", "kernel", "--kernel-length", 0.3, "--free-space", "off", *LARGE)
        self.assertGreaterEqual(gain, 1.4)

    @unittest.skipIf(os.environ.get("TESSERA_SANITIZE"), "takes minutes with sanitizers")
    def test_kernel_of_a_metre(self):
        _, _, gain = self.map_and_score("--inference", "kernel", "--kernel-length", 1.0, "--free-space", "off", *LARGE)
        self.assertGreaterEqual(gain, 2.1)

    def labels_of_occupied_voxels(self):
        """By the bytes of the voxel's centre."""
        self.done("export", "--map", self.folder / "map.tsm", "--format", "ply", "--out", "map.ply")
        body = (self.folder / "map.ply").read_bytes().partition(b"end_header\n")[2]
        return {body[i:i + 12]: body[i + 15] for i in range(0, len(body), 28)}

    def test_compact_counts_are_as_good_as_dense_ones(self):
        labels, gains = [], []
        for counts in ("dense", "compact"):
            mapping, _, gain = self.map_and_score("--free-space", "off", "--counts", counts, "--memory", "512M" if counts == "dense" else "128M",
                                                 reach_m=0)
            labels.append(self.labels_of_occupied_voxels())
            gains.append(gain)
        self.assertLess(mapping["memory"]["bytes_per_label_voxel"], 28)
        self.assertEqual(labels[0].keys(), labels[1].keys())
        same = sum(labels[1][voxel] == label for voxel, label in labels[0].items())
        self.assertGreater(same / len(labels[0]), 0.9999)
        self.assertLess(abs(gains[0] - gains[1]), 0.02)

    def test_the_default_mode(self):
        _, _, gain = self.map_and_score(points=STANDS)
        self.assertGreaterEqual(gain, 5.0)

    def test_multi_entropy_and_what_free_space_costs(self):
        mode = ("--inference", "multi-entropy")
        _, _, gain = self.map_and_score(*mode, "--free-space", "off")
        self.assertGreaterEqual(gain, 1.1)
        # What drove away is cleared, and is no longer in the map.
        _, _, without = self.map_and_score(*mode, "--free-space", "off", points=STANDS)
        _, _, gain = self.map_and_score(*mode, points=STANDS)
        self.assertGreaterEqual(gain, without + 0.2)

    @unittest.skipUnless((ROOT / "kitti_raw_0013").is_dir(), "no kitti_raw_0013")
    def test_a_window_of_64_mib_makes_the_map_of_a_long_drive(self):
        reports = []
        for options in (("--memory", "512M"), ("--memory", "64M", "--window", 45, "--archive", "spill")):
            self.done("map", "--dataset", ROOT / "kitti_raw_0013", "--labels", "none", "--resolution", 0.2, *options,
                      "--out", "drive.tsm", "--report", "drive.json")
            reports.append(json.loads((self.folder / "drive.json").read_text()))
        self.assertEqual([0, 0], [report["totals"]["left_out"] for report in reports])
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])
        self.assertEqual(0, reports[1]["window"]["lost_blocks"] + reports[1]["window"]["merged"])
        self.assertEqual(0, reports[1]["heap_allocations_after_init"] or 0)
        self.assertLess(reports[1]["memory"]["peak_bytes"], reports[0]["memory"]["peak_bytes"] / 2.5)


if __name__ == "__main__":
    unittest.main()
