# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What a node reads again while it runs: who is excluded, and the public keys."""
import json
import os
import re
import signal
import socket
import struct
import threading
import unittest
import urllib.request

import own_network
from fault_case import Faults

own_network.enter_or_skip()

GROUP = ("239.255.76.67", 7667)
STATUS = b"LC02\0\0\0\0TESSERA_STATUS\0"
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
        a.says("changes are ignored until the node is restarted: [publish] blocks", since)
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
        a.says("the public keys and [[sessions]] were reloaded", since)
        a.says("robots in reach: 1, before: 0", since)
        # And one that is taken away again.
        (self.folder / "a.pub").write_text(own)
        self.reload()
        a.says("robots in reach: 0, before: 1", since)

    def test_secrets_that_are_others_now_are_named(self):
        self.done("key", "new", "--robots", 2, "--dir", "keys")
        security = {"fleet_key": "keys/fleet.key", "robot_secret": "keys/robot_0.key", "robot_public_keys": "keys/fleet.pub"}
        a = self.node("a", 0, security=security)
        a.says("no scan")
        since = a.here()
        self.reload()
        since = a.says("the public keys and [[sessions]] were reloaded", since)
        self.assertNotIn("changes are ignored", a.said)
        self.done("key", "mission", "--new", "--fleet", "keys/fleet.key")
        self.reload()
        since = a.says("changes are ignored until the node is restarted: the mission in ", since)
        self.assertIn("keys/fleet.key\n", a.said[since - 1:])
        self.rewrite("a", "blocks = 4096", "blocks = 8192")
        self.reload()
        a.says("changes are ignored until the node is restarted: [publish] blocks, the mission in ", since)

    def test_a_conflict_that_a_robot_heard_is_found_by_doctor(self):
        """Robot 9 is not there: its status is robot 0's with another number and counters."""
        a = self.node("a", 0)
        a.says("no scan")
        data = bytearray(self.a_status())
        at = len(STATUS)
        struct.pack_into(">i", data, at + 12, 9)
        struct.pack_into(">q", data, at + 436 - 8, 3)
        self.assertEqual(("good", "no conflict heard"), self.contents())
        sending = threading.Event()

        def send():
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
                sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
                while not sending.wait(0.2):
                    sender.sendto(data, GROUP)

        thread = threading.Thread(target=send)
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(sending.set)
        self.assertEqual(("advice", "robot 9 heard two contents of one version"), self.contents())

    def contents(self):
        check = self.doctor("a")["contents"]
        return check["state"], check["found"]

    def a_status(self):
        """The next packet of the channel TESSERA_STATUS."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hearing:
            hearing.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            hearing.bind(GROUP)
            hearing.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP[0]) + socket.inet_aton("127.0.0.1"))
            hearing.settimeout(20)
            while True:
                data = hearing.recv(2048)
                if data[8:len(STATUS)] == STATUS[8:]:
                    return data

    def test_robots_that_exclude_others(self):
        self.done("key", "new", "--robots", 2, "--dir", "keys")
        keys = [{"fleet_key": "keys/fleet.key", "robot_secret": f"keys/robot_{robot}.key", "robot_public_keys": "keys/fleet.pub"}
                for robot in (0, 1)]
        a = self.node("a", 0, security={**keys[0], "exclude": [7]}, service={"view": "127.0.0.1:0"})
        b = self.node("b", 1, security={**keys[1], "exclude": []})
        a.says("robot 1 excludes other robots than this one")
        b.says("robot 0 excludes other robots than this one")
        self.assertEqual([1], self.shown_by(a)["exclude_differs"])
        lists = self.doctor("b")["exclude lists"]
        self.assertEqual("advice", lists["state"])
        self.assertIn("robot 0 with another list", lists["found"])
        self.rewrite("b", "exclude = []", "exclude = [7]")
        # The file is another one now, and the node has not read it yet.
        self.assertIn("robot 1 with another list", self.doctor("b")["exclude lists"]["found"])
        since = a.here(), b.here()
        self.reload("b")
        a.says("robot 1 excludes the same robots as this one again", since[0])
        b.says("robot 0 excludes the same robots as this one again", since[1])
        self.assertEqual([], self.shown_by(a)["exclude_differs"])
        self.assertEqual([], self.shown_by(a)["doubted"])
        checks = self.doctor("b")
        self.assertEqual(("good", "robots heard with this list: 2"), tuple(checks["exclude lists"][k] for k in ("state", "found")))
        self.assertEqual("good", checks["robots' numbers"]["state"])
        self.assertEqual(1, a.said.count("robot 1 excludes other robots"))
        reports = a.end(), b.end()
        for report in reports:
            statuses = report["security"]["statuses"]
            self.assertEqual([], report["security"]["exclude_differs"])
            for count in ("received", "taken"):
                self.assertGreater(statuses.pop(count), 2)
            self.assertEqual({0}, set(statuses.values()), statuses)
            if COUNTED:
                self.assertEqual(0, report["heap_allocations_after_start"])
        found = self.doctor("b")
        self.assertIn("no robot was heard; statuses refused: 0", found["exclude lists"]["found"])
        self.assertNotIn("robots' numbers", found)

    def test_a_robot_that_differs_in_the_end(self):
        a = self.node("a", 0, security={"exclude": [7]})
        b = self.node("b", 1)
        a.says("robot 1 excludes other robots than this one")
        self.assertEqual([1], a.end()["security"]["exclude_differs"])
        b.says("robot 0, which excludes other robots than this one, is no longer heard")

    def shown_by(self, node):
        url = re.search(r"http://127\.0\.0\.1:\d+/", node.said)[0]
        with urllib.request.urlopen(url + "status", timeout=10) as reply:
            return json.load(reply)["network"]

    def doctor(self, name):
        # What else is wrong with this machine is not this test's.
        self.run_command("doctor", "--config", f"{name}.toml", "--report", "doctor.json")
        return {check["check"]: check for check in json.loads((self.folder / "doctor.json").read_text())["checks"]}

    def test_what_cannot_be_read_changes_nothing(self):
        a = self.node("a", 0, security={"exclude": [7]})
        a.says("no scan")
        self.rewrite("a", "exclude = [7]", "exclude = 7")
        self.refused("node", "--config", "a.toml", "--reload", saying=("exclude",))
        a.process.send_signal(signal.SIGHUP)
        a.says("nothing was reloaded: ")
        self.assertEqual([7], a.end()["security"]["excluded"])

    def test_a_robot_that_does_not_run(self):
        a = self.node("a", 0)
        a.says("no scan")
        a.end()
        self.refused("node", "--config", "a.toml", "--reload", saying=("robot 0 does not run with the state in",))


if __name__ == "__main__":
    unittest.main()
