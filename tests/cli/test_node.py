# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera node: robots as processes over real multicast, in a network of their own."""
import json
import os
import shutil
import signal
import subprocess
import time
import unittest

import own_network
from command_case import DONE, TIME_LIMIT_S, command_path
from node_case import SCANS, NodeCase

own_network.enter_or_skip()

# Heap allocations are not counted under sanitizers.
COUNTED = not os.environ.get("TESSERA_SANITIZE")


class Node(NodeCase):
    def setUp(self):
        super().setUp()
        self.processes = []
        self.addCleanup(self.end_all)

    def end_all(self):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.communicate()

    def start(self, config, *before):
        process = subprocess.Popen([*before, command_path(), "node", "--config", str(config)], cwd=self.folder, text=True,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.processes.append(process)
        return process

    def finished(self, process, config):
        """What came of it: the report, and what it said."""
        out, error = process.communicate(timeout=TIME_LIMIT_S)
        self.assertEqual(DONE, process.returncode, error)
        report = json.loads(config.with_suffix(".json").read_text())
        self.assertIn(report["digest"], out)
        return report, error

    def run_both(self, first, second):
        processes = [(self.start(config), config) for config in (first, second)]
        return [self.finished(*one)[0] for one in processes]

    def assert_same(self, reports):
        self.assertEqual(reports[0]["digest"], reports[1]["digest"])
        self.assertEqual(reports[0]["exchange_digest"], reports[1]["exchange_digest"])

    def test_two_robots_have_the_same_map_and_it_is_what_fusing_gives(self):
        self.done("key", "new", "--fleet", "fleet.key", "--without-signatures")
        key = {"security": {"fleet_key": "fleet.key"}}
        reports = self.run_both(self.config(0, **key, output={"local_map": "local_0.tsm", "snapshots": "growing",
                                                              "snapshot_every_s": 0.2}), self.config(1, **key))
        self.assert_same(reports)
        for robot, report in enumerate(reports):
            self.assertEqual(("quiet", robot, 1), (report["ended_by"], report["robot"], report["epoch"]))
            self.assertEqual([(0, 1, True), (1, 1, True)],
                             sorted((c["robot"], c["epoch"], c["complete"]) for c in report["contributions"]))
            self.assertEqual(SCANS, report["scans"]["integrated"])
            self.assertEqual([1 - robot], [peer["robot"] for peer in report["peers"]])
            self.assertEqual("", report["peers"][0]["mismatch"])
            self.assertGreater(report["global_map"]["overlap_blocks"], 0)
            self.assertEqual(0, report["exchange"]["refused_tag"] + report["exchange"]["records_refused"])
            self.assertEqual(0 if COUNTED else None, report["heap_allocations_after_start"])
            self.assertLessEqual(report["memory"]["used_bytes"], report["memory"]["budget_bytes"])
            self.assertEqual("contractive", report["config"]["fusion"]["diffusion"])
        info = self.info("robot_0.global.tsm")
        self.assertEqual(("global", reports[0]["digest"], [0, 1]), (info["kind"], info["digest"], info["settings"]["robots"]))
        self.assertEqual(reports[0]["local_digest"], self.info("local_0.tsm")["digest"])
        # The global map is that of the contributions, whoever fuses them.
        fused = self.folder / "fused.json"
        self.done("fuse", "robot_0.contribution.tsm", "robot_1.contribution.tsm", "--out", "fused.tsm", "--report", fused)
        self.assertEqual(reports[0]["digest"], json.loads(fused.read_text())["digest"])
        # The shared map grew.
        voxels = [snapshot["label_voxels"] for snapshot in reports[0]["snapshots"]]
        self.assertEqual(sorted(voxels), voxels)
        self.assertGreater(len(set(voxels)), 1)
        for snapshot in reports[0]["snapshots"]:
            self.assertTrue((self.folder / snapshot["file"]).exists())

    def info(self, map_file):
        self.done("info", map_file, "--report", "info.json")
        return json.loads((self.folder / "info.json").read_text())

    def test_kernels_of_a_file_make_the_map_that_the_command_makes(self):
        (self.folder / "kernels.toml").write_text('[[kernel]]\nclass = "car"\nreach_m = 2.0\nheight_m = 2.0\n')
        digests = {}
        for kernels in ("kernels.toml", None):
            config = self.config(0, map={"resolution_m": 0.2, "kernels": kernels, "memory": "128M"},
                                 run={"wait_for_peers": 0, "quiet_s": 0.5, "linger_s": 0})
            report, _ = self.finished(self.start(config), config)
            options = ("--kernels", kernels) if kernels else ()
            mapped = self.map_dataset(f"{self.street}/robot_0", "mapped.tsm", "--resolution", 0.2, "--max-range", 60, "--memory", "128M",
                                      *options)[1]
            self.assertEqual(mapped["digest"], report["local_digest"])
            digests[kernels] = report["local_digest"]
        self.assertEqual(2, len(set(digests.values())))

    def test_killed_and_started_again(self):
        first = self.config(0)
        second = self.config(1, run={"quiet_s": 4, "linger_s": 60}, output={"snapshots": "seen", "snapshot_every_s": 0.2})
        victim, other = self.start(first), self.start(second)
        # The other one's map grows by what it hears.
        self.wait_for(lambda: any((self.folder / "seen").glob("*.tsm")) and self.robots_of("seen") == {0, 1})
        victim.kill()
        victim.communicate()
        reports = [self.finished(self.start(first), first)[0], self.finished(other, second)[0]]
        self.assert_same(reports)
        self.assertEqual(2, reports[0]["epoch"])
        epochs = {(c["robot"], c["epoch"]) for c in reports[0]["contributions"]}
        self.assertEqual({(0, 1), (0, 2), (1, 1)}, epochs)
        self.assertEqual(epochs, {(c["robot"], c["epoch"]) for c in reports[1]["contributions"]})

    def robots_of(self, folder):
        """Those that the latest snapshot in folder is of."""
        latest = max((self.folder / folder).glob("*.tsm"))
        return set(self.info(latest.relative_to(self.folder))["settings"]["robots"])

    def wait_for(self, condition):
        for _ in range(1000):
            if condition():
                return
            time.sleep(0.02)
        self.fail("waited in vain")

    def test_a_signal_ends_it_with_all_outputs(self):
        config = self.config(0, replay={"loop": True}, run={"duration_s": 60})
        process = self.start(config)
        self.wait_for(lambda: (self.folder / "state/robot_0.state").exists())
        process.send_signal(signal.SIGTERM)
        report, _ = self.finished(process, config)
        self.assertEqual("signal", report["ended_by"])
        self.assertTrue((self.folder / "robot_0.global.tsm").exists())

    def test_a_map_that_cannot_be_written_stops_no_other_output(self):
        (self.folder / "maps").mkdir()
        config = self.config(0, replay={"loop": True}, output={"global_map": "maps/global.tsm"}, run={"duration_s": 60})
        process = self.start(config)
        self.wait_for(lambda: (self.folder / "state/robot_0.state").exists())
        shutil.rmtree(self.folder / "maps")
        process.send_signal(signal.SIGTERM)
        out, error = process.communicate(timeout=TIME_LIMIT_S)
        self.assertNotEqual(DONE, process.returncode, error)
        self.assertIn("maps/global.tsm", error)
        report = json.loads(config.with_suffix(".json").read_text())
        self.assertEqual("signal", report["ended_by"])
        self.assertIn(report["digest"], out)
        self.assertTrue((self.folder / "robot_0.contribution.tsm").exists())

    ALONE = {"wait_for_peers": 0, "quiet_s": 0.5}

    @unittest.skipIf(os.cpu_count() > 63, "a machine that has all processors that can be named")
    def test_processors_that_other_threads_do_not_get_are_said(self):
        config = self.config(0, realtime={"other_cpus": [63]}, run=self.ALONE)
        report, error = self.finished(self.start(config), config)
        self.assertFalse(report["realtime"]["cpus_permitted"])
        self.assertTrue(report["realtime"]["priority_permitted"])
        self.assertIn("processors of mapping_cpus or other_cpus", error)

    def test_a_priority_that_only_threads_before_mapping_do_not_get_is_said(self):
        limited = ("prlimit", "--rtprio=10", "setpriv", "--bounding-set=-all", "--inh-caps=-all", "--")
        if subprocess.run([*limited, "chrt", "-f", "10", "true"], capture_output=True, check=False).returncode != 0:
            self.skipTest("this limit cannot be set here")
        config = self.config(0, realtime={"priority": 10}, run=self.ALONE)
        report, error = self.finished(self.start(config, *limited), config)
        if report["realtime"]["priority_permitted"]:
            self.skipTest("the right to more cannot be given away here")
        self.assertIn("no right to priority 11", error)

    def test_without_the_fleets_key_nothing_is_taken(self):
        self.done("key", "new", "--fleet", "fleet.key", "--without-signatures")
        alone = {"run": {"wait_for_peers": 0, "quiet_s": 2.5, "linger_s": 20}}
        reports = self.run_both(self.config(0, **alone, security={"fleet_key": "fleet.key"}), self.config(1, **alone))
        self.assert_strangers(reports, "refused_mission")
        self.done("key", "new", "--fleet", "other.key", "--without-signatures")
        reports = self.run_both(*(self.config(robot, **alone, security={"fleet_key": key, "mission": "harbour 7"})
                                  for robot, key in enumerate(("fleet.key", "other.key"))))
        self.assert_strangers(reports, "refused_tag")

    def assert_strangers(self, reports, counter):
        for report in reports:
            self.assertGreater(report["link"][counter], 0)
            self.assertEqual(0, report["link"]["refused_mission"] + report["link"]["refused_tag"] - report["link"][counter])
            self.assertEqual((0, 0, 1), (report["exchange"]["peers"], report["exchange"]["records_taken"],
                                         report["exchange"]["contributions"]))

    def signing(self, robot, **more):
        return {"fleet_key": "keys/fleet.key", "robot_secret": f"keys/robot_{robot}.key", "robot_public_keys": "all.pub", **more}

    def test_another_mission_is_not_heard(self):
        """With the same keys: the configuration's name wins over the one in the key file."""
        self.fleet_keys(2)
        alone = {"run": {"wait_for_peers": 0, "quiet_s": 2.5, "linger_s": 20}}
        reports = self.run_both(self.config(0, **alone, security=self.signing(0)),
                                self.config(1, **alone, security=self.signing(1, mission="yesterday")))
        self.assert_strangers(reports, "refused_mission")

    def test_another_process_with_this_robots_number_is_told(self):
        """At once by both and by a third robot, and once only in their few seconds."""
        (self.folder / "copied").mkdir()
        (self.folder / "copied/robot_0.starts").write_text("5\n")
        alone = {"wait_for_peers": 0, "duration_s": 8}
        reports, errors = [], []
        processes = [(self.start(c), c) for c in (self.config(0, replay={"loop": True}, run=alone),
                                                  self.config(0, "copied", robot={"state": "copied"}, replay={"loop": True}, run=alone),
                                                  self.config(1, replay={"loop": True}, run=alone))]
        for process, config in processes:
            report, error = self.finished(process, config)
            reports.append(report)
            errors.append(error)
        self.assertGreater(reports[2]["exchange"]["twins"], 0)
        self.assertRegex(errors[2], r"node: error: exchange twins: \d+ times another robot's number")
        reports.pop()
        for report, error in zip(reports, errors):
            self.assertGreater(report["exchange"]["refused_robot"], 3)
            self.assertEqual(1, error.count("another process uses the number of robot 0"), error)
        # They begin in epochs 1 and 6. Each goes above the other's when it hears of it, and both are never in one.
        epochs = sorted(report["epoch"] for report in reports)
        self.assertGreaterEqual(epochs[1], 6)
        self.assertEqual(2, len(set(epochs)))

    def test_robots_that_sign(self):
        self.fleet_keys(2)
        reports = self.run_both(*(self.config(robot, security=self.signing(robot)) for robot in range(2)))
        self.assert_same(reports)
        for report in reports:
            self.assertEqual((0, 0), (report["exchange"]["refused_signature"], report["exchange"]["refused_tag"]))
            self.assertGreater(report["exchange"]["records_taken"], 0)

    def test_another_configuration_is_named(self):
        alone = {"run": {"wait_for_peers": 0, "quiet_s": 2.5, "linger_s": 20}}
        processes = [(self.start(c), c) for c in (self.config(0, **alone), self.config(1, **alone, map={"resolution_m": 0.5}))]
        for process, config in processes:
            report, error = self.finished(process, config)
            self.assertIn("resolution_m is 0.", report["peers"][0]["mismatch"])
            self.assertIn("nothing is accepted from robot", error)
            self.assertGreater(report["exchange"]["refused_configuration"], 0)

    def test_an_excluded_robot(self):
        reports = self.run_both(self.config(0, security={"exclude": [1]}, run={"wait_for_peers": 0, "quiet_s": 4}), self.config(1))
        self.assertGreater(reports[0]["link"]["refused_excluded"], 0)
        self.assertEqual([0], [c["robot"] for c in reports[0]["contributions"]])
        self.assertEqual({0, 1}, {c["robot"] for c in reports[1]["contributions"]})


if __name__ == "__main__":
    unittest.main()
