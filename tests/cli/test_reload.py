# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What a node reads again while it runs: who is excluded, and the public keys."""
import os
import signal
import sys
import unittest

import own_network
from fault_case import Faults

if not own_network.enter():
    print("skipped: no network namespaces permitted here (unshare -rn)", file=sys.stderr)
    raise unittest.SkipTest("no network namespaces")

COUNTED = not os.environ.get("TESSERA_SANITIZE")


class Reload(Faults):
    def rewrite(self, name, before, after):
        path = self.folder / f"{name}.toml"
        text = path.read_text()
        self.assertIn(before, text)
        path.write_text(text.replace(before, after))

    def reload(self, name="a"):
        return self.done("node", "--config", f"{name}.toml", "--reload").stdout

    def test_a_robot_is_excluded_while_it_speaks(self):
        a = self.node("a", 0, security={"exclude": []})
        b = self.node("b", 1)
        for node in (a, b):
            node.says("robots in reach: 1")
        self.rewrite("a", "exclude = []", "exclude = [1]")
        self.rewrite("a", "blocks = 4096", "blocks = 8192")
        since = a.here()
        self.assertIn(f"robot 0 (process {a.process.pid}) reads", self.reload())
        a.says("robots excluded: 1", since)
        a.says("changes are ignored until the node is started again: [publish] blocks", since)
        a.says("robots in reach: 0, before: 1", since)
        # It lasts, so it is told.
        a.says("link refused_excluded", since)
        report = a.end()
        self.assertEqual([1], report["security"]["excluded"])
        self.assertGreater(report["link"]["refused_excluded"], 0)
        self.assertEqual([0], [c["robot"] for c in report["contributions"]])
        self.assertEqual(4096, report["config"]["publish"]["blocks"])
        if COUNTED:
            self.assertEqual(0, report["heap_allocations_after_start"])
        self.assertNotEqual(report["security"]["exclude_digest"], b.end()["security"]["exclude_digest"])

    def test_a_public_key_that_comes_later(self):
        for robot in (0, 1):
            self.done("key", "new", "--robot", robot, "--dir", ".")
        own, other = ((self.folder / f"robot_{robot}.pub").read_text() for robot in (0, 1))
        (self.folder / "a.pub").write_text(own)
        (self.folder / "b.pub").write_text(own + other)
        a = self.node("a", 0, security={"robot_secret": "robot_0.key", "robot_public_keys": "a.pub"})
        b = self.node("b", 1, security={"robot_secret": "robot_1.key", "robot_public_keys": "b.pub"})
        b.says("robots in reach: 1")
        a.says("exchange refused_signature")
        self.assertNotIn("robots in reach", a.said)
        (self.folder / "a.pub").write_text(own + other)
        since = a.here()
        a.process.send_signal(signal.SIGHUP)
        a.says("the public keys are read again", since)
        a.says("robots in reach: 1, before: 0", since)
        # And one that is taken away again.
        (self.folder / "a.pub").write_text(own)
        self.reload()
        a.says("robots in reach: 0, before: 1", since)

    def test_what_cannot_be_read_changes_nothing(self):
        a = self.node("a", 0, security={"exclude": [7]})
        a.says("no scan")
        self.rewrite("a", "exclude = [7]", "exclude = 7")
        self.refused("node", "--config", "a.toml", "--reload", saying=("exclude",))
        a.process.send_signal(signal.SIGHUP)
        a.says("nothing is read again: ")
        self.assertEqual([7], a.end()["security"]["excluded"])

    def test_a_robot_that_does_not_run(self):
        a = self.node("a", 0)
        a.says("no scan")
        a.end()
        self.refused("node", "--config", "a.toml", "--reload", saying=("robot 0 does not run with the state in",))


if __name__ == "__main__":
    unittest.main()
