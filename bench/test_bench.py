# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmarks still run, find what they found before, and fill the pages; on a small scene, and never about time."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import scan_instructions
import write_docs

HERE = pathlib.Path(__file__).resolve().parent
BUILD = pathlib.Path(os.environ["TESSERA_BUILD"])
MODES = {"kernel", "multi_entropy", "multi_entropy_free_space", "counting"}


class Smoke(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.out = pathlib.Path(cls.folder.name)
        cls.done = subprocess.run([sys.executable, "-B", HERE / "run.py", "--build", BUILD, "--out", cls.out, "--smoke"],
                                  capture_output=True, text=True)
        assert cls.done.returncode == 0, cls.done.stdout + cls.done.stderr
        cls.found = json.loads((cls.out / "bench.json").read_text())

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_every_result_is_the_one_on_record(self):
        names = set()
        for part in self.found.values():
            digests = part.get("digests") or {}
            results, recorded = digests.get("results") or {}, digests.get("recorded") or {}
            # The street is simulated with the machine's sine and cosine: another input than the one on record has none.
            self.assertEqual({name: results[name] for name, value in recorded.items() if value is not None},
                             {name: value for name, value in recorded.items() if value is not None})
            names |= set(results)
        self.assertLessEqual(MODES | {"query_along_rays", "file_multi_entropy", "fusion", "fusion_turned"}, names)

    def test_times_are_whole(self):
        integrate = self.found["integrate"]
        self.assertEqual(MODES, set(integrate["modes"]))
        for mode in integrate["modes"].values():
            self.assertEqual(integrate["scans"] * integrate["repetitions"], mode["ms"]["count"])
            self.assertEqual(mode["ms"]["count"], sum(mode["ms"]["histogram"]["counts"]))
            ordered = [mode["ms"][key] for key in ("min", "median", "p99", "p999", "max")]
            self.assertEqual(sorted(ordered), ordered)
            self.assertGreater(ordered[0], 0)
        self.assertGreater(integrate["naive"]["same_labels"], 0.999)
        self.assertGreater(integrate["naive"]["updates"], sum(s["voxel_updates"] for s in integrate["modes"]["kernel"]["scans"]))
        self.assertEqual({"scan_order", "scan_order_alone", "scan_order_batch", "random_observed", "random_observed_batch", "random_anywhere", "along_rays"}, set(self.found["query"]["questions"]))

    def test_memory_and_agreement(self):
        for setting in self.found["memory"]["settings"].values():
            for run in setting["budgets"].values():
                self.assertEqual(0, run["refused"])
                self.assertEqual(0, run["heap_allocations"] or 0)
                self.assertLess(run["used_bytes"] + run["scratch_bytes"], run["budget_bytes"])
        for mode in self.found["agreement"]["modes"].values():
            self.assertGreater(mode["same_label"], 0.999)
        self.assertEqual(0, self.found["example"]["left_out"])

    def test_yardsticks(self):
        integrate = self.found["integrate"]
        for name in "clock_ghz", "cpu_clock_ghz", "cpu_additions_per_ns":
            self.assertGreater(integrate[name]["min"], 0)
        for latency in self.found["query"]["load_latency_ns"], self.found["query"]["cpu_load_latency_ns"]:
            self.assertEqual({"memory", "l2"}, set(latency))
            self.assertGreater(latency["l2"]["min"], 0)

    @unittest.skipUnless(os.environ.get("TESSERA_CALLGRIND") == "ON" and shutil.which("valgrind"), "needs valgrind")
    def test_instructions_of_each_scan(self):
        robot = self.out / "street" / "robot_1"
        found = scan_instructions.measure(BUILD, robot, 1, robot)
        runs = found["runs"]
        self.assertEqual({"kernel", "multi_entropy", "multi_entropy_free_space", "lattice", "lattice_free_space", "drive"}, set(runs))
        scans = self.found["integrate"]["modes"]
        for name, run in runs.items():
            self.assertEqual(2, len(run["instructions"]))
            self.assertEqual(max(run["instructions"]), run["worst"])
            # Of the others nothing has to leave memory.
            share = max(run["of_these_window"]) / run["worst"]
            self.assertTrue(share > 0.001 if name == "drive" else share < 0.001, (name, share))
            if name in scans:  # a voxel cannot be updated by less than an instruction, nor by thousands
                for scan, count in zip(scans[name]["scans"], run["instructions"]):
                    self.assertGreater(count, scan["voxel_updates"])
                    self.assertLess(count, 5000 * (scan["voxel_updates"] + scan["ray_steps"]))
        self.assertLess(runs["multi_entropy"]["worst"], min(runs["multi_entropy_free_space"]["instructions"]))
        table = write_docs.scan_instructions({"scan_instructions": found})
        self.assertIn(f"{runs['kernel']['worst'] / 1e6:.1f}", table)

    def test_fusion(self):
        part = self.found["fusion"]
        digests = part["digests"]["results"]
        self.assertEqual(digests["fusion_turned"], digests["fusion_moved"])
        self.assertNotEqual(digests["fusion_turned"], digests["fusion"])
        self.assertGreater(part["nodes"], 1000)
        self.assertEqual(part["nodes"], part["plain"]["nodes"])
        self.assertLess(part["replica_bytes_per_label_voxel"], 12)
        # A slice is over its work by a quantum at most, and here a brick's edges are the largest.
        self.assertLess(part["moved"]["most_work_of_a_slice"], 12 * part["moved"]["slice_work"])

    def test_a_wrong_result_fails(self):
        part = self.found["map_file"]
        wrong = self.out / "wrong.json"
        wrong.write_text(json.dumps({part["digests"]["input"]: {"digests": {"file_multi_entropy": "0" * 16}}}))
        done = subprocess.run([BUILD / "bench" / "bench_map_file", "--dataset", self.out / "street" / "robot_1", "--last", "1",
                               "--repetitions", "1", "--digests", wrong, "--out", self.out / "again.json"],
                              capture_output=True, text=True)
        self.assertEqual(3, done.returncode)
        self.assertIn("file_multi_entropy is not the one on record", done.stderr)

    def test_pages_are_filled_and_their_text_is_kept(self):
        pages = self.out / "docs"
        pages.mkdir()
        for name in write_docs.PAGES:
            shutil.copy(HERE.parent / "docs/measured" / name, pages)
        subprocess.run([sys.executable, "-B", HERE / "write_docs.py", self.out / "bench.json", pages], check=True)
        for name in write_docs.PAGES:
            before, after = (HERE.parent / "docs/measured" / name).read_text(), (pages / name).read_text()
            self.assertEqual(write_docs.PART.sub("", before), write_docs.PART.sub("", after))
            if "circumstances" in after:
                self.assertIn("simulated street, 16 beams", after)
            for part in re.findall(r"<!-- measured: \w+ -->(.*?)<!-- end measured -->", after, re.S):
                self.assertGreater(len(part.strip()), 40)


if __name__ == "__main__":
    unittest.main()
