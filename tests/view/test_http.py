# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What tessera view serves, to whom, and what it does with those who mean harm. After each of these it still serves."""
import contextlib
import json
import os
import pathlib
import random
import socket
import subprocess
import tempfile
import unittest

from serving import LIMIT_S, START, Server, ViewCase, command, make_street, read_all
from command_case import DONE, FAILURE, USAGE, CommandCase


class Http(ViewCase):
    def tearDown(self):
        self.assertEqual(3, len(self.server.json("/maps")["maps"]), "it serves no more")
        self.assertIsNone(self.server.process.poll())

    def exchange(self, data, limit_s=LIMIT_S):
        """All that comes back for these bytes, until it closes the connection or nothing more comes."""
        with socket.create_connection(("127.0.0.1", self.server.port), timeout=limit_s) as link:
            with contextlib.suppress(OSError):
                link.sendall(data)
                link.shutdown(socket.SHUT_WR)
            got = b""
            with contextlib.suppress(OSError):
                while part := link.recv(65536):
                    got += part
            return got

    def test_the_page_and_all_that_it_names_come_from_here(self):
        reply, body = self.server.get("/")
        self.assertEqual(200, reply.status)
        self.assertIn("text/html", reply.getheader("Content-Type"))
        policy = reply.getheader("Content-Security-Policy")
        self.assertIn("default-src 'none'", policy)
        self.assertNotIn("unsafe", policy)
        self.assertIsNone(reply.getheader("Access-Control-Allow-Origin"))
        text = body.decode()
        self.assertNotIn("http://", text.replace("http://www.w3.org", ""))
        self.assertNotIn("https://", text)
        for name in ("style.css", "main.js", "gpu.js", "icon.svg"):
            reply, body = self.server.get("/" + name)
            self.assertEqual((200, True), (reply.status, len(body) > 100), name)

    def test_other_paths_are_nothing(self):
        for path in ("/nothing", "/../etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd", "/%2e%2e/main.js", "/index.html/",
                     "/platform/view/page/main.js", "/blocks/", "/" + "a" * 2000):
            reply, body = self.server.get(path)
            self.assertEqual(404, reply.status, path)
            self.assertNotIn(b"root:", body)

    def test_arguments_are_numbers_in_their_range(self):
        good = "since=0&round=0&key=0&page=0&met=0"
        for path in ("/blocks", "/blocks?map=0", f"/blocks?map=3&{good}", f"/blocks?map=-1&{good}", f"/blocks?map=99999999999&{good}",
                     f"/blocks?map=0x0&{good}", f"/blocks?map=&{good}", "/voxel?map=0&x=1&y=2", "/voxel?map=0&x=1&y=2&z=3m",
                     "/voxel?map=9&x=1&y=2&z=3", "/keys?map=0", "/keys?page=0"):
            self.assertEqual(400, self.server.get(path)[0].status, path)

    def test_any_cursor_is_answered(self):
        chance = random.Random(3)
        for _ in range(100):
            words = "&".join(f"{name}={chance.choice([0, 1, 7, 600, 2**31, chance.randrange(2**32)])}"
                             for name in ("since", "round", "key", "page", "met"))
            self.assertEqual(200, self.server.get(f"/blocks?map=0&{words}")[0].status, words)

    def test_points_that_are_nowhere_are_unknown(self):
        for value in ("nan", "inf", "-inf", "1e300", "4e6"):
            told = self.server.json(f"/voxel?map=0&x={value}&y=0&z=0")
            self.assertEqual(("unknown", 0), (told["state"], told["label"]))

    def test_only_get(self):
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "CONNECT", "BREW"):
            reply, _ = self.server.get("/", method=method)
            self.assertEqual((405, "GET"), (reply.status, reply.getheader("Allow")), method)
        reply, body = self.server.get("/", method="HEAD")
        self.assertEqual((200, b""), (reply.status, body))

    def test_a_page_may_ask_for_less_at_once(self):
        first = "/blocks?map=0&" + "&".join(f"{name}=0" for name in START)
        whole = len(self.server.get(first)[1])
        for most in (0, 1, 5000, 20_000):
            some = len(self.server.get(f"{first}&most={most}")[1])
            self.assertLess(64, some)
            self.assertLessEqual(some, max(most, 8192))
            self.assertLess(some, whole)
        self.assertEqual(whole, len(self.server.get(f"{first}&most=99999999999")[1]))

    def test_a_name_that_is_made_to_mean_this_machine_is_refused(self):
        for host in ("evil.example", "evil.example:80", "localhost.evil.example", "127.0.0.1.evil.example", "127.0.0.1:80:80", "", "[::1",
                     "0x7f000001", "2130706433", "127.1", "localhost:99999"):
            self.assertEqual(403, self.server.get("/maps", Host=host)[0].status, host)
        for host in ("127.0.0.1", "localhost", "LOCALHOST:9", f"127.0.0.1:{self.server.port}", "[::1]:8080", "192.168.7.7:1"):
            self.assertEqual(200, self.server.get("/maps", Host=host)[0].status, host)
        self.assertIn(b" 403 ", self.exchange(b"GET /maps HTTP/1.0\r\n\r\n"))

    def test_pages_of_elsewhere_are_refused(self):
        for path in ("/", "/maps", "/main.js", "/blocks?map=0&since=0&round=0&key=0&page=0&met=0"):
            for site in ("cross-site", "same-site", "", "same-origin, cross-site"):
                reply, body = self.server.get(path, **{"Sec-Fetch-Site": site})
                self.assertEqual((403, True), (reply.status, b"type the address" in body), (path, site))
            for site in ("same-origin", "none"):
                self.assertEqual(200, self.server.get(path, **{"Sec-Fetch-Site": site})[0].status, (path, site))

    def test_a_request_has_no_body(self):
        head = b"GET /maps HTTP/1.1\r\nHost: localhost\r\n"
        self.assertIn(b" 413 ", self.exchange(head + b"Content-Length: 99999999\r\n\r\n" + b"x" * 4096))
        self.assertIn(b" 413 ", self.exchange(head + b"Transfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n"))

    def test_what_is_too_long_is_refused(self):
        head = b"GET /maps HTTP/1.1\r\nHost: localhost\r\n"
        for data in (head + b"X: " + b"a" * 100_000 + b"\r\n\r\n", head + b"A: b\r\n" * 20_000 + b"\r\n",
                     b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n", b"A" * 100_000):
            got = self.exchange(data)
            self.assertNotIn(b" 200 ", got[:64])

    def test_what_is_no_request(self):
        chance = random.Random(11)
        upgrade = (b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                   b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n")
        for data in (b"\x00" * 1000, b"\xff" * 1000, b"\r\n" * 500, b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", upgrade + chance.randbytes(500),
                     b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", *(chance.randbytes(300) for _ in range(20))):
            self.assertNotIn(b" 101 ", self.exchange(data, limit_s=0.5)[:64])

    @unittest.skipIf(os.environ.get("TESSERA_SANITIZE"), "skipped: sanitizers keep what is given back")
    def test_memory_stays(self):
        def resident_kb():
            with open(f"/proc/{self.server.process.pid}/status") as status:
                return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))
        for _ in range(3):
            read_all(self.server)
        before_kb = resident_kb()
        for _ in range(30):
            read_all(self.server)
            self.exchange(b"GET /" + b"a" * 30_000)
        self.assertLess(resident_kb() - before_kb, 2000)


# Flags of a voxel.
DISAGREE, MOVED = 1, 2


class Content(ViewCase):
    def test_what_maps_there_are(self):
        maps = self.server.json("/maps")["maps"]
        self.assertEqual(["global.tsm", "robot_0.tsm", "robot_1.tsm"], [m["name"] for m in maps])
        self.assertEqual(["global", "local", "local"], [m["kind"] for m in maps])
        self.assertEqual([2, 1, 1], [len(m["contributors"]) for m in maps])
        self.assertEqual({0.2}, {m["resolution_m"] for m in maps})
        self.assertFalse(any(m["live"] for m in maps))

    def test_hardly_a_voxel_of_a_street_is_hidden_behind_six_others(self):
        command("info", "robot_0.tsm", "--report", "info.json", folder=self.folder)
        info = json.loads((self.folder / "info.json").read_text())
        _, blocks = read_all(self.server, 1)
        sent = sum(voxel[5] & MOVED == 0 for block in blocks.values() for voxel in block["voxels"])
        self.assertLessEqual(sent, info["occupied_state"])
        self.assertGreater(sent, 0.9 * info["occupied_state"])

    def test_the_numbers_are_those_of_query(self):
        for number, name in enumerate(("global.tsm", "robot_0.tsm", "robot_1.tsm")):
            _, blocks = read_all(self.server, number)
            told = 0
            for (x, y, z), block in sorted(blocks.items())[::max(1, len(blocks) // 4)]:
                row = block["voxels"][0][0]
                voxel = (8 * x + (row & 7), 8 * y + (row >> 3 & 7), 8 * z + (row >> 6))
                point = [f"{(v + 0.5) * 0.2:.9g}" for v in voxel]
                voxel_told = self.server.json(f"/voxel?map={number}&x={point[0]}&y={point[1]}&z={point[2]}")
                expected = self.query(name, point)
                self.assertEqual(list(voxel), voxel_told["voxel"])
                for key in ("state", "probability", "variance", "evidence"):
                    self.assertEqual(expected[key], voxel_told[key], key)
                self.assertEqual(int(expected["label"]), voxel_told["label"])
                self.assertEqual([expected[f"sigma_{i}"] for i in range(len(voxel_told["sigma"]))], voxel_told["sigma"])
                label, probability, variance = block["voxels"][0][1:4]
                self.assertEqual(int(expected["label"]), label)
                if label:
                    self.assertAlmostEqual(float(expected["probability"]), probability / 255, delta=0.5 / 255 + 1e-9)
                    self.assertAlmostEqual(1, 10 ** (-variance / 40) / float(expected["variance"]), delta=0.03)
                told += 1
            self.assertGreaterEqual(told, 4)

    def test_sessions_are_contributors_by_their_date(self):
        os.utime(self.folder / "robot_1.tsm", (1764115200, 1764115200))
        session = ("--session", "robot_1.tsm:1")
        command("fuse", "robot_0.tsm", *session, "--out", "with_session.tsm", folder=self.folder)
        server = Server(self.folder, "with_session.tsm", "robot_0.tsm", *session)
        try:
            maps = server.json("/maps")["maps"]
            self.assertEqual([["robot 0 (robot_0.tsm)", "session (robot_1.tsm of 2025-11-26)"], ["robot 0"]],
                             [m["contributors"] for m in maps])
            _, blocks = read_all(server, 0)
            contributors = [voxel[4] for block in blocks.values() for voxel in block["voxels"]]
            for one in (0, 1, 254):
                self.assertGreater(contributors.count(one), 100)
        finally:
            self.assertEqual((DONE, ""), server.close())
        for words in (("robot_0.tsm", *session), ("with_session.tsm", *session)):
            refused = subprocess.run([os.environ["TESSERA_COMMAND"], "view", *words, "--listen", "127.0.0.1:0"], cwd=self.folder,
                                     capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=LIMIT_S)
            self.assertEqual(USAGE, refused.returncode)
            self.assertIn("--session needs a global map and the local ones", refused.stderr)

    def test_who_contributed(self):
        _, blocks = read_all(self.server, 0)
        contributors = [voxel[4] for block in blocks.values() for voxel in block["voxels"]]
        disagree = [voxel for block in blocks.values() for voxel in block["voxels"] if voxel[5] & DISAGREE]
        self.assertEqual({0, 1, 254, 255} | set(contributors), {0, 1, 254, 255}, "one of two robots, both, or none")
        for one in (0, 1, 254):
            self.assertGreater(contributors.count(one), 100)
        self.assertGreater(len(disagree), 0)
        self.assertEqual({254}, {voxel[4] for voxel in disagree}, "it takes two to disagree")

    def test_a_round_ends_with_all_blocks_and_the_next_one_has_nothing_new(self):
        header, blocks = read_all(self.server, 1)
        self.assertEqual(header["met"], len(blocks))
        words = "&".join(f"{name}={header[name]}" for name in ("since", "round", "key", "page", "met"))
        reply, body = self.server.get(f"/blocks?map=1&{words}")
        self.assertEqual((200, 64), (reply.status, len(body)))
        reply, keys = self.server.get("/keys?map=1&page=0")
        self.assertEqual((200, 8 * (1 + len(blocks))), (reply.status, len(keys)))


class Usage(CommandCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = tempfile.TemporaryDirectory(prefix="tessera-view-")
        cls.addClassCleanup(folder.cleanup)
        cls.maps = pathlib.Path(folder.name)
        make_street(cls.maps, scans=1)

    def test_what_is_refused(self):
        a, b, both = (self.maps / name for name in ("robot_0.tsm", "robot_1.tsm", "global.tsm"))
        junk = self.folder / "junk.tsm"
        junk.write_bytes(b"nothing like a map" * 100)
        (self.folder / "T.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        self.refused("view", "missing.tsm", saying=["missing.tsm"])
        self.refused("view", junk, saying=["junk.tsm"])
        self.refused("view", saying=["MAPS"])
        self.refused("view", a, a, saying=["duplicate"])
        self.refused("view", a, "--transform", f"{a}=T.txt", saying=["--transform"])
        for listen in ("8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:-1", "example.org:80", "::1:80", "[::1]", "[127.0.0.1]:80",
                       "127.0.0.1:80x", ""):
            self.refused("view", a, "--listen", listen, saying=["--listen", "127.0.0.1:8080"])
        for listen in ("0.0.0.0:0", "192.168.0.7:0", "[::]:0"):
            self.refused("view", a, b, both, "--listen", listen, saying=["--everywhere"])

    def test_an_address_that_is_taken(self):
        server = Server(self.maps, "robot_0.tsm")
        self.addCleanup(server.close)
        self.refused("view", self.maps / "robot_1.tsm", "--listen", f"127.0.0.1:{server.port}", saying=["another"], exit_status=FAILURE)

    def test_everywhere_is_served_with_a_warning(self):
        server = Server(self.maps, "robot_0.tsm", "--listen", "0.0.0.0:0", "--everywhere")
        self.assertEqual(1, len(server.json("/maps")["maps"]))
        status, said = server.close()
        self.assertEqual(DONE, status)
        self.assertIn("warning: everybody", said)

    def test_ipv6(self):
        server = Server(self.maps, "robot_0.tsm", "--listen", "[::1]:0")
        with socket.create_connection(("::1", server.port), timeout=LIMIT_S) as link:
            link.sendall(b"GET /maps HTTP/1.1\r\nHost: [::1]\r\nConnection: close\r\n\r\n")
            self.assertIn(b" 200 ", link.recv(4096))
        self.assertEqual(DONE, server.close()[0])


if __name__ == "__main__":
    unittest.main()
