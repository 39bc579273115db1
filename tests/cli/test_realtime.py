# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera node: what its mapping thread asks of the system, and what becomes of memory and of maps while it runs."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time
import unittest

import own_network
from command_case import DONE, TIME_LIMIT_S, command_path
from node_case import NodeCase

own_network.enter_or_skip()

LOCKED = {"lock_memory": True}


class Realtime(NodeCase):
    def run_node(self, config, *before, during=lambda process: None):
        process = subprocess.Popen([*before, command_path(), "node", "--config", str(config)], cwd=self.folder, text=True,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            during(process)
            _, error = process.communicate(timeout=TIME_LIMIT_S)
        finally:
            if process.poll() is None:
                process.kill()
                process.communicate()
        self.assertEqual(DONE, process.returncode, error)
        return json.loads(config.with_suffix(".json").read_text()), error

    def alone(self, **changes):
        tables = {"run": {"wait_for_peers": 0, "duration_s": 4}, "replay": {"loop": True, "rate_hz": 20}}
        for table, keys in changes.items():
            tables[table] = {**tables.get(table, {}), **keys}
        return self.config(0, **tables)

    def started(self):
        counter = self.folder / "state/robot_0.state"
        for _ in range(500):
            if counter.exists():
                time.sleep(0.3)
                return
            time.sleep(0.02)
        self.fail("it does not start")

    @unittest.skipIf(os.environ.get("TESSERA_SANITIZE"), "sanitizers take memory as they like")
    def test_the_mapping_thread_gets_no_page_fault_and_memory_stays_as_it_is(self):
        report, _ = self.run_node(self.alone(realtime=LOCKED))
        mapping, realtime = report["mapping"], report["realtime"]
        self.assertGreater(mapping["cycles"], 20)
        self.assertEqual((0, 0), (mapping["minor_page_faults"], mapping["major_page_faults"]))
        self.assertEqual(0, report["heap_allocations_after_start"])
        self.assertGreater(realtime["start_resident_bytes"], report["memory"]["budget_bytes"])
        self.assertLess(abs(realtime["end_resident_bytes"] - realtime["start_resident_bytes"]), 4 << 20)

    @unittest.skipIf(os.environ.get("TESSERA_SANITIZE"), "sanitizers make calls of their own")
    def test_the_mapping_thread_asks_the_system_for_nothing_but_to_sleep_and_to_wake(self):
        if shutil.which("strace") is None:
            self.skipTest("strace is not installed")
        trace = self.folder / "calls"
        report, _ = self.run_node(self.alone(), "strace", "-f", "-qq", "-o", str(trace))
        calls = []
        for line in trace.read_text().splitlines():
            found = re.match(rf"{report['mapping']['thread']} +(\w+)\(", line)
            if found:
                calls.append(found[1])
        # Before and after: the system's own of a thread's begin and end, and how many pages were missing.
        first = calls.index("getrusage")
        last = len(calls) - 1 - calls[::-1].index("getrusage")
        self.assertGreater(last - first, report["mapping"]["cycles"])
        self.assertEqual({"futex"}, set(calls[first + 1:last]))

    def test_without_the_rights_it_runs_and_says_so(self):
        report, error = self.run_node(self.alone(realtime={"priority": 10, **LOCKED}),
                                      "prlimit", "--rtprio=0", "--memlock=65536", "setpriv", "--bounding-set=-all",
                                      "--inh-caps=-all", "--")
        realtime = report["realtime"]
        self.assertGreater(report["mapping"]["cycles"], 0)
        if realtime["memory_locked"] and realtime["priority_permitted"]:
            self.skipTest("these rights cannot be given away here")
        self.assertFalse(realtime["memory_locked"])
        self.assertIn("LimitMEMLOCK", realtime["why_not_locked"])
        self.assertIn("no right to priority 10", error)
        self.assertIn("memory is not locked", error)

    def test_a_limit_of_locked_memory_that_is_less_than_it_takes(self):
        # More than is there when it begins, less than it takes; and enough for that, but not for writing maps.
        for limit_bytes in (256 << 20, 512 << 20):
            limited = ("prlimit", f"--memlock={limit_bytes}")
            if subprocess.run([*limited, "true"], capture_output=True).returncode != 0:
                self.skipTest("this limit cannot be set here")
            with self.subTest(limit_bytes):
                report, error = self.run_node(self.alone(realtime=LOCKED, fusion={"memory": "300M"}, run={"duration_s": 2}), *limited,
                                              "setpriv", "--bounding-set=-all", "--inh-caps=-all", "--")
                realtime = report["realtime"]
                self.assertGreater(report["mapping"]["cycles"], 0)
                if realtime["memory_locked"]:
                    self.skipTest("these rights cannot be given away here")
                self.assertIn("LimitMEMLOCK", realtime["why_not_locked"])
                self.assertIn("memory is not locked", error)

    def test_a_save_is_asked_for_while_it_runs(self):
        def save_twice(process):
            self.started()
            process.send_signal(signal.SIGUSR1)
            time.sleep(1)
            self.assertTrue((self.folder / "local.tsm").exists())
            (self.folder / "local.tsm").unlink()
            process.send_signal(signal.SIGUSR1)
        report, _ = self.run_node(self.alone(output={"local_map": "local.tsm"}), during=save_twice)
        self.assertEqual((2, 0), (report["mapping"]["saves"], report["mapping"]["failed_saves"]))
        self.assertGreater(report["mapping"]["cycles"], 20)

    def test_a_save_without_a_name_is_said(self):
        def save(process):
            self.started()
            process.send_signal(signal.SIGUSR1)
        report, error = self.run_node(self.alone(run={"duration_s": 2}), during=save)
        self.assertEqual(0, report["mapping"]["saves"])
        self.assertIn("[output] local_map names no file", error)

    def test_a_disk_that_is_full_ends_nothing(self):
        def save(process):
            self.started()
            process.send_signal(signal.SIGUSR1)
            time.sleep(1)
            process.send_signal(signal.SIGTERM)
        # Files of 1 kB at most: the counter of starts fits, a map does not.
        config = self.alone(output={"local_map": "local.tsm", "global_map": None, "contribution": None, "report": None})
        process = subprocess.Popen(["prlimit", "--fsize=1024", "--", command_path(), "node", "--config", str(config)],
                                   cwd=self.folder, text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        save(process)
        _, error = process.communicate(timeout=TIME_LIMIT_S)
        self.assertEqual(2, process.returncode, error)
        self.assertIn("the map could not be saved", error)
        self.assertIn("local.tsm", error)
        self.assertFalse((self.folder / "local.tsm").exists())
        self.assertEqual([], [path for path in pathlib.Path(self.folder).iterdir() if path.suffix == ".part"])

    def test_a_budget_that_is_too_small_sheds_work(self):
        report, _ = self.run_node(self.alone(map={"deadline_ms": 1, "resolution_m": 0.1, "memory": "64M"}))
        mapping = report["mapping"]
        self.assertGreater(mapping["shed"], 0)
        self.assertEqual(0, mapping["lost"])
        self.assertGreater(report["scans"]["left_out"], 0)

    def test_a_configuration_is_checked_and_nothing_changed(self):
        config = self.config(0, output={"snapshots": "growing"})
        result = self.done("node", "--check", "--config", config)
        self.assertIn("is valid: robot 0", result.stdout)
        self.assertEqual({"robot_0.toml"}, {path.name for path in pathlib.Path(self.folder).iterdir()})
        self.refused("node", "--check", "--config", self.config(0, map={"resolution_m": -1}))


if __name__ == "__main__":
    unittest.main()
