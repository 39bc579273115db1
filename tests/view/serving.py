# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera view as a process of its own, maps for it, and what it says over HTTP. TESSERA_COMMAND is the command's path."""
import http.client
import json
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "cli"))

LIMIT_S = 30
HEAD, BLOCK, VOXEL = 64, 20, 8
START = {"since": 0, "round": 0, "key": 0, "page": 0, "met": 0}
DEFERRED = 2
URL = re.compile(r"http://(\S+):(\d+)/")


def command(*arguments, folder):
    return subprocess.run([os.environ["TESSERA_COMMAND"], *map(str, arguments)], cwd=folder, check=True, capture_output=True,
                          text=True, stdin=subprocess.DEVNULL, timeout=120)


def make_street(folder, scans=2):
    """A street that two robots have mapped, one behind the other, and their global map."""
    command("simulate", "--scans", 2 * scans, "--robots", 1, "--seed", 7, "--out", "street", folder=folder)
    for robot in (0, 1):
        command("map", "--dataset", "street/robot_0", "--first", robot * scans, "--last", robot * scans + scans - 1, "--out", f"robot_{robot}.tsm",
                "--resolution", 0.2, "--max-range", 25, "--robot", robot, "--memory", "64M", folder=folder)
    command("fuse", "robot_0.tsm", "robot_1.tsm", "--out", "global.tsm", folder=folder)


class Server:
    """tessera view on a free port."""

    def __init__(self, folder, *arguments):
        words = [os.environ["TESSERA_COMMAND"], "view", *map(str, arguments)]
        if "--listen" not in words:
            words += ["--listen", "127.0.0.1:0"]
        self.process = subprocess.Popen(words, cwd=folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE)
        line = self.process.stdout.readline()
        found = URL.search(line)
        if not found:
            raise AssertionError(f"it says {line!r} and {self.process.communicate(timeout=LIMIT_S)}")
        self.port = int(found.group(2))
        self.url = found.group(0)

    def get(self, path, method="GET", **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=LIMIT_S)
        try:
            connection.request(method, path, headers=headers)
            reply = connection.getresponse()
            return reply, reply.read()
        finally:
            connection.close()

    def json(self, path):
        reply, body = self.get(path)
        if reply.status != 200:
            raise AssertionError(f"{path}: {reply.status} {body}")
        return json.loads(body)

    def close(self):
        """Its exit status, and what it said of errors."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        _, said = self.process.communicate(timeout=LIMIT_S)
        return self.process.returncode, said


def read_message(body):
    """The header, and by block's coordinates the voxels: (row, label, probability, variance, contributor, flags)."""
    names = ("magic", "map", "session", "since", "round", "key", "page", "zero", "met", "blocks", "flags")
    header = dict(zip(names, struct.unpack_from("<IIQQQQIIIII", body), strict=True))
    assert header["magic"] == 0x31565354, header
    blocks, at = {}, HEAD
    for _ in range(header["blocks"]):
        x, y, z, revision, count = struct.unpack_from("<iiiII", body, at)
        rows = [struct.unpack_from("<HBBBBBx", body, at + BLOCK + VOXEL * i) for i in range(count)]
        blocks[x, y, z] = {"revision": revision, "voxels": rows}
        at += BLOCK + VOXEL * count
    assert at == len(body), (at, len(body))
    return header, blocks


def read_all(server, map_number=0):
    """Every block of a map, and the header that ends the round."""
    cursor, blocks = dict(START), {}
    for _ in range(1000):
        words = "&".join(f"{name}={value}" for name, value in cursor.items())
        reply, body = server.get(f"/blocks?map={map_number}&{words}")
        assert reply.status == 200, (reply.status, body)
        header, found = read_message(body)
        blocks.update(found)
        cursor = {name: header[name] for name in START}
        if header["flags"] & 1:
            return header, blocks
        if header["flags"] & DEFERRED:
            time.sleep(0.05)
    raise AssertionError("the round does not end")


class ViewCase(unittest.TestCase):
    """Maps of a street, made once, and a server that shows them."""
    ARGUMENTS = ("global.tsm", "robot_0.tsm", "robot_1.tsm")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = tempfile.TemporaryDirectory(prefix="tessera-view-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        make_street(cls.folder)
        cls.server = Server(cls.folder, *cls.ARGUMENTS)
        cls.addClassCleanup(cls.server.close)

    @classmethod
    def query(cls, name, point):
        """The row of query at a point, by column."""
        (cls.folder / "points.csv").write_text("x,y,z\n" + ",".join(map(str, point)) + "\n")
        command("query", "--map", name, "--points", "points.csv", "--out", "states.csv", folder=cls.folder)
        columns, row = (line.split(",") for line in (cls.folder / "states.csv").read_text().splitlines())
        return dict(zip(columns, row, strict=True))
