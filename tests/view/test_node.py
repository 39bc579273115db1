# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A node's maps in a browser while it runs: what comes, what it costs, and what its configuration refuses."""
import http.client
import json
import os
import pathlib
import re
import sys
import unittest

import serving
from browser import Browser
from test_browser import drawn_share

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "support"))
import own_network
from node_case import NodeCase
from running_node import RunningNode, until

own_network.enter_or_skip()

# What a sanitizer's own allocator gives is not counted.
COUNTED = not os.environ.get("TESSERA_SANITIZE")
SERVICE = {"view": "127.0.0.1:0"}
URL = re.compile(r"http://127\.0\.0\.1:(\d+)/")


class ViewNode(NodeCase):
    def start(self, text="", **service):
        config = self.config(0, replay={"rate_hz": 5, "loop": True}, service={**SERVICE, **service},
                             run={"wait_for_peers": None, "quiet_s": None, "linger_s": None},
                             output={"global_map": None, "contribution": None})
        config.write_text(config.read_text() + text)
        node = RunningNode(self.folder, config)
        self.addCleanup(node.close)
        node.says("the maps are shown at")
        until(lambda: URL.search(node.said), "the address")
        self.port = int(URL.search(node.said).group(1))
        return node

    def get(self, path):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=serving.LIMIT_S)
        try:
            connection.request("GET", path)
            reply = connection.getresponse()
            return reply, reply.read()
        finally:
            connection.close()

    def json(self, path):
        return json.loads(self.get(path)[1])

    def test_what_changes_comes(self):
        node = self.start()
        until(lambda: self.json("/status")["timing"]["cycles"] >= 2, "cycles")
        header, blocks = serving.read_all(self)
        self.assertGreater(len(blocks), 100)
        words = "&".join(f"{name}={header[name]}" for name in serving.START)
        newest = max(block["revision"] for block in blocks.values())

        # What was being written while it was read the first time comes again, with the same revision.
        def changed():
            _, more = serving.read_message(self.get(f"/blocks?map=0&{words}")[1])
            return [block for block in more.values() if block["revision"] > newest]

        until(changed, "what a later scan changes")
        until(lambda: len(serving.read_all(self, 1)[1]) > 100, "the global map")
        marks = [voxel[4] for block in serving.read_all(self, 1)[1].values() for voxel in block["voxels"]]
        self.assertGreater(marks.count(254), 0.9 * len(marks), "it has no other robot's labels")
        report = node.end()
        if COUNTED:
            self.assertEqual(0, report["heap_allocations_after_start"])
            self.assertGreater(report["view"]["heap_allocations"], 0)
        self.assertGreater(report["view"]["blocks"], 200)

    def test_how_things_stand(self):
        self.start()

        def driven():
            told = self.json("/status")
            # The viewer does not see each cycle: it has the lowest priority.
            ready = told["timing"]["cycles"] >= 3 and len(told["robots"][0]["track"]) >= 2 and told["network"]["sent"] > 0
            return told if ready else None

        told = until(driven, "three cycles, two places and a datagram")
        self.assertEqual(100, told["timing"]["period_ms"])
        self.assertEqual(told["timing"]["cycles"], sum(count for _, count in told["timing"]["buckets"]) + told["timing"]["unseen"])
        self.assertLessEqual(told["timing"]["p50_ms"], told["timing"]["p99_ms"])
        self.assertEqual([0], [robot["robot"] for robot in told["robots"]])
        self.assertEqual(12, len(told["robots"][0]["T_map_sensor"]))
        self.assertEqual(0, told["network"]["missing"])

    def test_maps_of_earlier_days_are_named_by_their_date(self):
        yesterday = self.folder / "yesterday.tsm"
        self.done("map", "--dataset", f"{self.street}/robot_1", "--resolution", "0.4", "--max-range", "60", "--out", yesterday)
        os.utime(yesterday, (1764115200, 1764115200))
        self.start(text=f'[[sessions]]\nfile = "{yesterday}"\nweight = 0.25\n')
        (session,) = until(lambda: self.json("/status")["network"]["sessions"], "the session")
        self.assertEqual(("2025-11-26T00:00:00Z", 0.25), (session["date"], session["weight"]))
        self.assertEqual("only other robots or earlier days", self.json("/maps")["maps"][1]["contributors"][0])

    def test_so_many_voxels_a_second_and_no_more(self):
        node = self.start(view_voxels_per_s=1000)
        until(lambda: self.json("/status")["timing"]["cycles"] >= 3, "cycles")
        first = "/blocks?map=0&" + "&".join(f"{name}=0" for name in serving.START)
        until(lambda: serving.read_message(self.get(first)[1])[0]["flags"] & serving.DEFERRED, "that some are deferred")
        self.assertGreater(node.end()["view"]["deferred"], 0)

    def test_without_it_nothing_is_there(self):
        config = self.config(0, run={"wait_for_peers": 0, "quiet_s": 0.2, "linger_s": 5})
        result = self.done("node", "--config", config)
        self.assertNotIn("shown at", result.stderr)
        self.assertNotIn("view", json.loads((self.folder / "robot_0.json").read_text()))

    def test_what_is_refused(self):
        for address in ("0.0.0.0:8080", "10.1.2.3:80", "[::]:80"):
            self.refused("node", "--check", "--config", self.config(0, service={"view": address}), saying=["[service] view", "view_everywhere"])
        for address in ("8080", "example.org:80", "127.0.0.1"):
            self.refused("node", "--check", "--config", self.config(0, service={"view": address}), saying=["[service] view", "127.0.0.1:8080"])
        self.refused("node", "--check", "--config", self.config(0, service={**SERVICE, "view_voxels_per_s": 5}), saying=["view_voxels_per_s"])
        self.done("node", "--check", "--config", self.config(0, service={"view": "0.0.0.0:0", "view_everywhere": True}))

    def test_voxels_appear_while_it_runs(self):
        self.start()
        browser = Browser()
        self.addCleanup(browser.close)
        browser.driver.get(f"http://127.0.0.1:{self.port}/#map=1")
        browser.until(lambda: int(browser.data("voxels") or 0) > 1000, "voxels of the global map")
        first = int(browser.data("received"))
        browser.until(lambda: browser.text("connection") == "live", "that it is live")
        browser.until(lambda: int(browser.data("received")) > first, "what later scans change")
        browser.until(lambda: drawn_share(browser.picture()) > 0.01, "a picture")
        browser.until(lambda: int(browser.text("timing-cycles") or 0) > 3, "cycles")
        self.assertIn("robot 0", browser.text("robots"))
        browser.until(lambda: re.search(r"[kM]B$", browser.text("network-sent")), "what was sent")
        browser.picture("live")
        self.assertEqual([], browser.faults())


if __name__ == "__main__":
    unittest.main()
