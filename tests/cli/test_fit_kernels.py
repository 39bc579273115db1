# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""fit-kernels, and maps with the kernels that it writes."""
import json
import shutil
import tomllib
import unittest

import kitti_folder as kitti
from command_case import MEMORY, USAGE, CommandCase

SCANS = 4


class FitKernels(CommandCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.street = cls.class_folder() + "/street"
        cls.simulate(cls.street, "--robots", 2, "--scans", SCANS, "--seed", 3)
        cls.data = f"{cls.street}/robot_0"

    def fit(self, *options):
        result = self.done("fit-kernels", "--dataset", self.data, "--out", "kernels.toml", "--report", "fit.json", "--resolution", 0.2, *options)
        return result, json.loads((self.folder / "fit.json").read_text())

    def test_what_it_writes_is_what_it_says_and_what_map_takes(self):
        result, report = self.fit()
        written = {kernel["class"]: [kernel["reach_m"], kernel["height_m"]]
                   for kernel in tomllib.loads((self.folder / "kernels.toml").read_text())["kernel"]}
        self.assertEqual(report["kernels"], written)
        self.assertIn("car", written)
        iou = report["mean_iou"]
        self.assertGreater(iou["fitted"], iou["one_kernel"])
        self.assertGreater(iou["fitted"], iou["input"])
        self.assertGreater(report["mean_iou_left_out"]["fitted"], report["mean_iou_left_out"]["one_kernel"])
        self.assertIn("scans that were left out of the fit", result.stdout)
        self.assertIn("car", result.stdout)
        options = ("--resolution", 0.2, "--free-space", "off", "--inference", "lattice")
        _, fitted = self.map_dataset(self.data, "fitted.tsm", *options, "--kernels", "kernels.toml")
        _, one = self.map_dataset(self.data, "one.tsm", *options, "--kernel-length", 0.8)
        # The table is in the map's record, not the file's place.
        self.assertEqual(written, fitted["config"]["kernels"])
        self.assertNotIn("kernels", one["config"])
        self.done("info", "fitted.tsm", "--report", "info.json")
        self.assertEqual(written, json.loads((self.folder / "info.json").read_text())["settings"]["kernels"])
        gained = [self.mean_iou(name) for name in ("fitted.tsm", "one.tsm")]
        self.assertGreater(gained[0], gained[1])

    def mean_iou(self, map_file):
        self.done("eval", "--map", map_file, "--dataset", self.data, "--report", "eval.json")
        return json.loads((self.folder / "eval.json").read_text())["mean_iou"]

    def test_the_same_data_give_the_same_file(self):
        self.fit()
        first = (self.folder / "kernels.toml").read_bytes()
        self.fit()
        self.assertEqual(first, (self.folder / "kernels.toml").read_bytes())

    def test_several_data_sets_and_one_scan(self):
        _, both = self.fit("--dataset", f"{self.street}/robot_1")
        _, alone = self.fit()
        self.assertEqual([self.data, f"{self.street}/robot_1"], both["config"]["datasets"])
        self.assertNotEqual(alone["mean_iou"], both["mean_iou"])
        # Nothing can be left out of one scan.
        _, single = self.fit("--first", 0, "--last", 0)
        self.assertNotIn("mean_iou_left_out", single)

    def test_raw_ids_that_do_not_count(self):
        _, report = self.fit("--without", kitti.CAR)
        whole = self.fit()[1]
        self.assertNotEqual(whole["mean_iou"], report["mean_iou"])
        self.assertEqual([kitti.CAR], report["config"]["without"])

    def test_refusals_leave_no_file(self):
        copied = self.folder / "copied"
        shutil.copytree(self.data, copied)
        shutil.rmtree(copied / "labels")
        out = ("--out", "refused.toml")
        self.refused("fit-kernels", "--dataset", copied, *out, saying=("labels",))
        self.refused("fit-kernels", "--dataset", "nowhere", *out, saying=("nowhere",))
        self.refused("fit-kernels", "--dataset", self.data, saying=("--out",))
        self.refused("fit-kernels", "--dataset", self.data, *out, "--resolution", 0.25, saying=("--resolution", "under 0.25"))
        self.refused("fit-kernels", "--dataset", self.data, *out, "--truth", "none", saying=("--truth",))
        self.refused("fit-kernels", "--dataset", self.data, "--out", f"{self.data}/poses.txt", saying=("poses.txt",))
        # Too little for a map, for the points of a scan, and for all scans.
        for memory in ("1M", "3M", "6M"):
            self.refused("fit-kernels", "--dataset", self.data, *out, "--memory", memory, "--resolution", 0.05, saying=("--memory",))
        nothing = kitti.write_dataset(self.folder / "nothing", [kitti.Scan([(3.0, 0.0, 0.0)], [kitti.ROAD], [kitti.UNLABELLED])])
        refused = self.run_command("fit-kernels", "--dataset", nothing, *out)
        self.assertEqual(USAGE, refused.returncode)
        self.assertIn("no points with labels and a labelled truth", refused.stderr.splitlines()[-1])
        self.assertFalse((self.folder / "refused.toml").exists())

    def test_no_output_is_the_file_of_kernels(self):
        kernels = self.folder / "kernels.toml"
        text = '[[kernel]]\nclass = "car"\nreach_m = 0.3\n'
        kernels.write_text(text)
        lattice = (*MEMORY, "--inference", "lattice", "--kernels", kernels)
        for option in ("--out", "--report"):
            other = "--out" if option == "--report" else "--report"
            self.refused("map", "--dataset", self.data, *lattice, option, kernels, other, "other", saying=("kernels.toml",))
        self.assertEqual(text, kernels.read_text())

    def test_a_map_that_goes_on_with_other_kernels_says_so(self):
        kernels = self.folder / "kernels.toml"
        kernels.write_text('[[kernel]]\nclass = "car"\nreach_m = 0.3\n')
        lattice = ("--resolution", 0.2, "--memory", "128M")
        self.map_dataset(self.data, "first.tsm", "--last", 1, *lattice, "--kernels", kernels)
        same, _ = self.map_dataset(self.data, "same.tsm", "--first", 2, *lattice, "--kernels", kernels, "--continue", "first.tsm")
        self.assert_not_warned(same)
        names, _ = self.map_dataset(self.data, "names.tsm", "--first", 2, *lattice, "--continue", "first.tsm")
        self.assert_warned(names, "other kernels", "--kernels")
        one, _ = self.map_dataset(self.data, "one.tsm", "--first", 2, *lattice, "--kernel-length", 0.8, "--continue", "names.tsm")
        self.assert_warned(one, "other kernels", "--kernel-length")

    def test_more_kernels_than_a_record_has_room_for(self):
        kernels = self.folder / "kernels.toml"
        kernels.write_text("".join(f'[[kernel]]\nclass = "{name}"\n' for name in ("car", *(f"class with a long name {i}" for i in range(80)))))
        _, report = self.map_dataset(self.data, "map.tsm", "--last", 0, "--inference", "lattice", "--kernels", kernels, "--memory", "128M")
        self.assertEqual(81, len(report["config"]["kernels"]))
        self.done("info", "map.tsm", "--report", "info.json")
        self.assertEqual("lattice", json.loads((self.folder / "info.json").read_text())["settings"]["inference"])

    def test_maps_refuse_kernels_that_do_not_fit(self):
        kernels = self.folder / "kernels.toml"
        kernels.write_text('[[kernel]]\nclass = "tree"\n')
        lattice = (*MEMORY, "--inference", "lattice")
        self.map_refused(self.data, *lattice, "--kernels", kernels, saying=("kernels.toml", "no class of these scans"))
        kernels.write_text('[[kernel]]\nclass = "car"\nreach_m = -1\n')
        self.map_refused(self.data, *lattice, "--kernels", kernels, saying=("kernels.toml", "line 3"))
        self.map_refused(self.data, *lattice, "--kernels", "missing.toml", saying=("missing.toml",))
        kernels.write_text('[[kernel]]\nclass = "car"\n')
        for options in (("--inference", "counting"), ("--inference", "lattice", "--kernel-length", "0.5")):
            self.map_refused(self.data, *MEMORY, "--kernels", kernels, *options, saying=("--kernels", "lattice"))


if __name__ == "__main__":
    unittest.main()
