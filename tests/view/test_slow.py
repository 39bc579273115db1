# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Those who send slowly, take nothing or are many, against tessera view. After each of these it still serves."""
import contextlib
import http.client
import socket
import time
import unittest

from serving import LIMIT_S, ViewCase

PATIENCE_S = 10  # WebServer::kPatience_us


class Slow(ViewCase):
    def tearDown(self):
        self.assertEqual(3, len(self.server.json("/maps")["maps"]), "it serves no more")
        self.assertIsNone(self.server.process.poll())

    def test_those_who_take_their_time_keep_nobody_waiting(self):
        """A byte now and then for a request; and a reply that is asked for and not taken."""
        with contextlib.ExitStack() as links:
            slow = [links.enter_context(socket.create_connection(("127.0.0.1", self.server.port), timeout=LIMIT_S)) for _ in range(20)]
            greedy = [links.enter_context(socket.create_connection(("127.0.0.1", self.server.port), timeout=LIMIT_S)) for _ in range(4)]
            for link in greedy:
                link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                link.sendall(b"GET /blocks?map=0&since=0&round=0&key=0&page=0&met=0 HTTP/1.1\r\nHost: localhost\r\n\r\n")
            end = time.monotonic() + PATIENCE_S + LIMIT_S
            text = b"GET /maps HTTP/1.1\r\nHost: localhost\r\nX: "
            sent, closed = 0, 0
            while time.monotonic() < end and closed < len(slow):
                closed = 0
                for link in slow:
                    try:
                        link.sendall(text[sent:sent + 1] or b"a")
                    except OSError:
                        closed += 1
                sent += 1
                self.assertEqual(200, self.server.get("/maps")[0].status)
                time.sleep(0.3)
            self.assertEqual(len(slow), closed, "who takes too long is dropped")
        self.assertGreaterEqual(self.server.json("/status")["view"]["dropped"], len(slow))

    def test_who_takes_no_bytes_of_replies_shuts_nobody_out(self):
        """On the address of the honest page: as many who take nothing as there are large rooms, with 60 requests each, and anew every 2 s.
        The page is answered every time, by a connection of its own or one that it keeps."""
        request = b"GET /blocks?map=0&since=0&round=0&key=0&page=0&met=0 HTTP/1.1\r\nHost: localhost\r\n\r\n"
        path = "/blocks?map=0&since=0&round=0&key=0&page=0&met=0"
        whole = len(self.server.get(path)[1])
        kept = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=LIMIT_S)
        self.addCleanup(kept.close)
        answers, sizes = [], []
        for _ in range(6):
            with contextlib.ExitStack() as links:
                for _ in range(4):
                    link = links.enter_context(socket.socket())
                    link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
                    link.connect(("127.0.0.1", self.server.port))
                    link.sendall(60 * request)
                for _ in range(5):
                    time.sleep(0.4)
                    reply, body = self.server.get(path)
                    answers.append(reply.status)
                    sizes.append(len(body))
                    kept.request("GET", path)
                    reply = kept.getresponse()
                    answers.append((reply.status, len(reply.read()) > 64))
        self.assertEqual({200, (200, True)}, set(answers), answers)
        self.assertLess(min(sizes), whole, "the large rooms were never all taken, so nothing was shown")

    def test_who_takes_no_byte_for_two_seconds_is_dropped(self):
        request = b"GET /blocks?map=0&since=0&round=0&key=0&page=0&met=0 HTTP/1.1\r\nHost: localhost\r\n\r\n"
        before = self.server.json("/status")["view"]["stalled"]
        with contextlib.ExitStack() as links:
            for _ in range(3):
                link = links.enter_context(socket.socket())
                link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
                link.connect(("127.0.0.1", self.server.port))
                link.sendall(60 * request)
            end = time.monotonic() + LIMIT_S
            while self.server.json("/status")["view"]["stalled"] < before + 3:
                self.assertLess(time.monotonic(), end, "they hold their rooms")
                time.sleep(0.2)

    def test_who_takes_little_but_something_is_served(self):
        request = b"GET /blocks?map=0&since=0&round=0&key=0&page=0&met=0 HTTP/1.1\r\nHost: localhost\r\n\r\n"
        with socket.socket() as link:
            link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            link.settimeout(LIMIT_S)
            link.connect(("127.0.0.1", self.server.port))
            link.sendall(60 * request)
            for _ in range(100):
                self.assertTrue(link.recv(8192), "it is dropped")
                time.sleep(0.05)

    def test_more_connections_than_there_is_room_for(self):
        with contextlib.ExitStack() as links:
            for _ in range(150):
                link = links.enter_context(socket.create_connection(("127.0.0.1", self.server.port), timeout=LIMIT_S))
                link.sendall(b"GET /maps HTTP/1.1\r\n")
            self.assertEqual(200, self.server.get("/maps")[0].status)


if __name__ == "__main__":
    unittest.main()
