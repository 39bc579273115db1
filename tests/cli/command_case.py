# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the command and holds what is promised of every run: it never crashes, it never hangs, a refusal is one line on
stderr, and no half-written file stays behind. TESSERA_COMMAND is the command's path."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

DONE, USAGE, FAILURE = 0, 1, 2
TIME_LIMIT_S = 120
# Enough for every scene of these tests, and quick to set up.
MEMORY = ("--memory", "48M")


def command_path():
    path = os.environ.get("TESSERA_COMMAND")
    if not path:
        raise RuntimeError("set TESSERA_COMMAND to the path of the tessera command")
    return path


def crc32c(data):
    """The checksum of map files."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


class CommandCase(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="tessera-cli-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def tearDown(self):
        self.assertEqual([], [str(p) for p in self.folder.rglob("*.part")], "a half-written file stayed behind")

    @classmethod
    def class_folder(cls):
        """The path of a folder that all tests of the class share."""
        folder = tempfile.TemporaryDirectory(prefix="tessera-cli-")
        cls.addClassCleanup(folder.cleanup)
        return folder.name

    @staticmethod
    def simulate(out, *options):
        """Makes a street for all tests of a class."""
        subprocess.run([command_path(), "simulate", *map(str, options), "--out", out], check=True, capture_output=True, timeout=TIME_LIMIT_S)

    def run_command(self, *arguments):
        return subprocess.run([command_path(), *map(str, arguments)], cwd=self.folder, text=True, capture_output=True,
                              stdin=subprocess.DEVNULL, timeout=TIME_LIMIT_S, check=False)

    def done(self, *arguments):
        """Runs what must succeed."""
        result = self.run_command(*arguments)
        self.assertEqual(DONE, result.returncode, result.stderr)
        return result

    def refused(self, *arguments, saying=(), exit_status=USAGE):
        """Runs what must be refused in one line that holds each of saying."""
        result = self.run_command(*arguments)
        allowed = exit_status if isinstance(exit_status, tuple) else (exit_status,)
        self.assertIn(result.returncode, allowed, f"{arguments}: {result.stderr}")
        lines = result.stderr.splitlines()
        self.assertEqual(1, len(lines), f"{arguments}: {result.stderr}")
        self.assertTrue(lines[0].startswith("tessera: "), lines[0])
        for words in saying:
            self.assertIn(str(words), lines[0])
        return lines[0]

    def assert_warned(self, result, *words):
        warnings = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
        for word in words:
            self.assertTrue(any(word in line for line in warnings), f"no warning has '{word}': {result.stderr}")

    def assert_not_warned(self, result):
        self.assertEqual([], [line for line in result.stderr.splitlines() if line.startswith("warning: ")])

    def map_dataset(self, dataset, out, *options):
        """Maps with a report; gives the run and the report."""
        report = self.folder / "map.json"
        chosen = options if "--memory" in options else (*options, *MEMORY)
        result = self.done("map", "--dataset", dataset, "--out", out, "--report", report, *chosen)
        return result, json.loads(report.read_text())

    def map_refused(self, dataset, *options, saying=(), exit_status=USAGE):
        """Mapping must be refused, and leave neither a map nor a report."""
        out, report = self.folder / "refused.tsm", self.folder / "refused.json"
        message = self.refused("map", "--dataset", dataset, "--out", out, "--report", report, *options, saying=saying,
                               exit_status=exit_status)
        self.assertFalse(out.exists())
        self.assertFalse(report.exists())
        return message

    def query_rows(self, map_file, text, *options):
        """The rows of a query, each a dictionary by column."""
        points, out = self.folder / "points.csv", self.folder / "states.csv"
        points.write_text(text)
        self.done("query", "--map", map_file, "--points", points, "--out", out, *options)
        lines = out.read_text().splitlines()
        columns = lines[0].split(",")
        return columns, [dict(zip(columns, line.split(","), strict=True)) for line in lines[1:]]
