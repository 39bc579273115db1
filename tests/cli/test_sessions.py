# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Maps of earlier days: two nodes that load one file, a start again, one that is taken out while the node runs; fuse --session."""
import json
import pathlib
import signal
import subprocess

import own_network
from command_case import DONE, TIME_LIMIT_S, command_path
from fault_case import Faults
from node_case import NodeCase
from running_node import RunningNode, sensing, write_config

own_network.enter_or_skip()


def sessions(*items):
    return "".join("[[sessions]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in item.items()) for item in items)


def run_map(*arguments):
    """For all tests of a class."""
    subprocess.run([command_path(), "map", *map(str, arguments)], check=True, capture_output=True, timeout=TIME_LIMIT_S)


def own_sessions(report):
    return [c for c in report["contributions"] if c["own"] and "session" in c]


class Sessions(NodeCase, Faults):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.yesterday = cls.class_folder() + "/yesterday.tsm"
        run_map( "--dataset", f"{cls.street}/robot_1", "--resolution", "0.4", "--max-range", "60", "--out", cls.yesterday)

    def info(self, path):
        self.done("info", path, "--report", "info.json")
        return json.loads((self.folder / "info.json").read_text())

    def start(self, number, text, **changes):
        config = self.config(number, **changes)
        config.write_text(config.read_text() + text)
        node = RunningNode(self.folder, config)
        self.closing.callback(node.close)
        return node

    def ended(self, node):
        node.process.wait(timeout=120)
        node.reader.join(30)
        self.assertEqual(DONE, node.process.returncode, node.said)
        return json.loads(node.report_path.read_text())

    def test_two_nodes_load_one_file_and_it_counts_once(self):
        digest = self.info(self.yesterday)["digest"]
        (self.folder / "damaged.tsm").write_bytes(pathlib.Path(self.yesterday).read_bytes()[:-1000])
        nodes = [self.start(0, sessions({"file": self.yesterday}, {"file": "damaged.tsm"})),
                 self.start(1, sessions({"file": self.yesterday, "weight": 0.25}))]
        reports = [self.ended(node) for node in nodes]
        self.assertEqual(*(report["digest"] for report in reports))
        self.assertEqual(*(report["exchange_digest"] for report in reports))
        for report, weight in zip(reports, (0.5, 0.25)):
            shared = report["sessions"]["files"][0]
            self.assertEqual(("shared", digest, weight, 0), tuple(shared[key] for key in ("state", "digest", "weight", "refused_blocks")))
            self.assertGreater(shared["blocks"], 100)
            # Everybody has both, and says so.
            held = [c["session"] for c in report["contributions"] if "session" in c and c["complete"]]
            self.assertEqual([digest] * 2, [one["digest"] for one in held])
            self.assertEqual([0.25, 0.5], sorted(one["weight"] for one in held))
            self.assertIn(report["heap_allocations_after_start"], (0, None))
        self.assertEqual([1, 0], [report["sessions"]["left_out"] for report in reports])
        left_out = reports[0]["sessions"]["files"][1]
        self.assertEqual("left out", left_out["state"])
        self.assertIn("damaged.tsm", left_out["why"])
        self.assertIn("a session is left out: ", nodes[0].said)
        self.assertIn(f"digest {digest}", nodes[1].said)

    def test_a_start_again_with_it_and_without_it(self):
        alone = {"run": {"wait_for_peers": 0, "quiet_s": 0.5}}
        text = sessions({"file": self.yesterday})
        first = self.ended(self.start(0, text, **alone))
        second = self.ended(self.start(0, text, **alone))
        self.assertEqual((1, 2), (own_sessions(first)[0]["epoch"], own_sessions(second)[0]["epoch"]))
        third = self.ended(self.start(0, "", **alone))
        self.assertEqual([], own_sessions(third))
        self.assertEqual([], third["sessions"]["files"])

    def test_one_that_is_taken_out_while_the_node_runs_is_removed(self):
        sensors = self.sensors()
        wall = self.folder / "wall.tsm"
        node = self.node("first")
        node.says("integrated the first scan")
        node.end()
        (self.folder / "first.tsm").rename(wall)
        config = write_config(self.folder, "node", sensing("node", 0))
        without = config.read_text()
        config.write_text(without + sessions({"file": "wall.tsm"}))
        node = RunningNode(self.folder, config)
        self.closing.callback(node.close)
        here = node.says(f"session {wall} of 20")
        config.write_text(without)
        node.process.send_signal(signal.SIGHUP)
        here = node.says(f"session {wall} is removed", here)
        # And another one is loaded.
        config.write_text(without + sessions({"file": "wall.tsm", "weight": 1.0}))
        node.process.send_signal(signal.SIGHUP)
        node.says("with weight 1 are shared", here)
        self.assertNotIn("changes are ignored", node.said)
        report = node.end()
        self.assertEqual([1.0], [one["weight"] for one in report["sessions"]["files"]])
        self.assertEqual([0.0, 1.0], sorted(one["session"]["weight"] for one in own_sessions(report)))
        sensors.close()

    def test_what_a_configuration_may_not_say(self):
        for text, said in (("[[sessions]]\nweight = 0.5\n", "[sessions] file: is missing; give a map file"),
                           (sessions({"file": "a.tsm", "weight": 0}), "[sessions] weight: 0 is not allowed; give a number from 0.0001 to 1"),
                           (sessions({"file": "a.tsm", "weight": 1.5}), "[sessions] weight: 1.5 is not allowed"),
                           (sessions({"file": "a.tsm", "wieght": 1}), "unknown key wieght in [sessions]; did you mean weight?"),
                           ("[sessions]\nfile = \"a.tsm\"\n", "[sessions] is written as [[sessions]]"),
                           (sessions(*[{"file": "a.tsm"}] * 9), "[[sessions]] is given 9 times; give at most 8")):
            config = self.config(0)
            config.write_text(config.read_text() + text)
            self.refused("node", "--config", config, "--check", saying=(said,))


class Fuse(NodeCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = cls.class_folder()
        cls.maps = [f"{folder}/robot_{robot}.tsm" for robot in (0, 1)]
        for robot, path in enumerate(cls.maps):
            run_map( "--dataset", f"{cls.street}/robot_{robot}", "--resolution", "0.4", "--out", path)

    def fused(self, *arguments):
        self.done("fuse", *arguments, "--out", "g.tsm", "--report", "g.json")
        return json.loads((self.folder / "g.json").read_text())

    def test_a_session_counts_less_and_is_named(self):
        first, second = self.maps
        as_map = self.fused(first, second, "--diffusion", "none")
        whole = self.fused(first, "--session", f"{second}:1", "--diffusion", "none")
        half = self.fused(first, "--session", second, "--diffusion", "none")
        self.assertEqual(3, len({report["digest"] for report in (as_map, whole, half)}))
        self.assertEqual(as_map["voxels"], half["voxels"])
        (session,) = half["sessions"]
        self.assertEqual((second, 0.5), (session["map"], session["weight"]))
        self.assertEqual([first], [one["map"] for one in half["contributions"]])
        self.assertRegex(session["date"], r"^20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
        self.assertEqual(self.fused(first, "--session", second, "--diffusion", "none")["digest"], half["digest"])
        info = self.done("info", "g.tsm").stdout
        self.assertIn(f"session      {session['digest']} of {session['date']}, weight 0.5", info)

    def test_what_is_refused(self):
        first, second = self.maps
        (self.folder / "copy.tsm").write_bytes(pathlib.Path(second).read_bytes())
        self.done("map", "--dataset", f"{self.street}/robot_1", "--resolution", "0.5", "--out", "coarse.tsm")
        for said, arguments in (("is not allowed; give a weight from 0.0001 to 1", ("--session", f"{second}:0")),
                                ("is given twice", ("--session", second, "--session", f"{second}:0.2")),
                                ("has the same content as", ("--session", second, "--session", "copy.tsm")),
                                ("has resolution 0.5, but the maps here have 0.4", ("--session", "coarse.tsm")),
                                ("cannot read none.tsm", ("--session", "none.tsm")),
                                ("is given 9 times; give at most 8", ("--session", second) * 9)):
            self.refused("fuse", first, *arguments, "--out", "g.tsm", saying=(said,))
            self.assertFalse((self.folder / "g.tsm").exists())
