# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""docs/reference/can/tessera.dbc says what the code does: it is written from the code's tables (--write), and frames that the code
packed are read by the file bit by bit; docs/reference/can.md has the load of the bus as it is computed from that file."""
import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

import dbc
import e2e
import write_dbc

SOURCE = pathlib.Path(__file__).parents[2]
TABLES = os.environ.get("TESSERA_BUS_TABLES", str(SOURCE / "build/release/tests/can/bus_tables"))
FILE = SOURCE / "docs/reference/can/tessera.dbc"
SLOW, RATIO = 500_000, 4  # bit/s, and how much faster CAN FD sends its data


def classic_bits(size):
    """SOF, identifier, RTR, IDE, r0, length, data and CRC are stuffed; 13 bits behind them are not."""
    stuffed = 1 + 11 + 1 + 1 + 1 + 4 + 8 * size + 15
    return stuffed + (stuffed - 1) // 4 + 13


def fd_bits(size):
    """At the slow rate, and at the fast one."""
    slow, fast = 17, 5 + 8 * size
    crc = 17 if size <= 16 else 21
    stuff = (slow + fast - 1) // 4
    fixed = -(-(4 + crc) // 4)
    return slow + 4 + 13, fast + stuff - 4 + 4 + crc + fixed


def tables_of_the_code():
    return json.loads(subprocess.run([TABLES], check=True, capture_output=True, timeout=60).stdout)


def written(tables):
    return write_dbc.text_of(tables, (SOURCE / "platform/vehicle/bus_values.hpp").read_text(), FILE.read_text())


class Dbc(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.file = dbc.read(FILE)
        cls.code = tables_of_the_code()

    def test_file_is_whole(self):
        self.assertEqual(["VEHICLE", "TESSERA"], self.file.nodes)
        self.assertEqual("CAN FD", self.file.attributes["BusType"])
        for message in self.file.messages.values():
            self.assertTrue(message.comment, f"{message.name} has no comment")
            self.assertLess(message.id, 0x800)
            used = 0
            for signal in message.signals.values():
                bits = ((1 << signal.length) - 1) << signal.start
                self.assertEqual(0, used & bits, f"{message.name}.{signal.name} overlaps another")
                self.assertEqual(0, bits >> 8 * message.size, f"{message.name}.{signal.name} is not in the frame")
                used |= bits

    def test_reader_refuses(self):
        good = FILE.read_text()
        for old, new in (("BO_ 256 COMMAND: 4", "BO_ 257 COMMAND: 4"), ("|8@1+", "|8@2+"), ('"m" TESSERA', '"m" NOBODY'),
                         ("CM_ BO_ 256", "CM_ BO_ 999"), ('"VFrameFormat" BO_ 262 14', '"VFrameFormat" BO_ 262 99'),
                         ("VAL_ 256 Command ", "VAL_ 256 Commands "), ('VERSION "', "VERSION ")):
            self.assertIn(old, good)
            with self.assertRaises((dbc.Invalid, IndexError), msg=new):
                dbc.File(good.replace(old, new, 1))

    def test_file_is_written_from_the_tables(self):
        self.assertEqual(written(self.code), FILE.read_text(), "write it anew: tests/can/test_dbc.py --write")

    def test_frames(self):
        """What the code packed, read by the file."""
        for table in self.code["messages"]:
            message = self.file.messages[table["id"]]
            profile = self.file.attribute(message, "E2EProfile")
            for example in table["examples"]:
                data = bytes.fromhex(example["bytes"])
                for name, said in example["values"].items():
                    signal = message.signals[name]
                    self.assertEqual(said["raw"], signal.raw(data), f"{message.name}.{name}")
                    self.assertAlmostEqual(said["value"], signal.value(data), delta=1e-9 * max(1, abs(said["value"])))
                if profile != "None":
                    data_id = self.file.attribute(message, "E2EDataID")
                    self.assertTrue(e2e.is_right(profile, data_id, data), message.name)
                    self.assertFalse(e2e.is_right(profile, data_id ^ 1, data), message.name)
                    self.assertEqual(example["counter"], message.signals["Counter"].raw(data))
                    self.assertEqual(data, e2e.sealed(profile, data_id, example["counter"], data))

    def test_names_of_values(self):
        found = set()
        for message in self.file.messages.values():
            for signal in message.signals.values():
                if signal.name in self.code["names"]:
                    found.add(signal.name)
                    self.assertEqual(list(range(self.code["names"][signal.name])), sorted(signal.values), signal.name)
                    self.assertEqual(max(signal.values), signal.most)
                if signal.name.endswith("Distance"):
                    self.assertEqual(self.code["codes"]["Distance"], sorted(signal.values))
                for code in signal.values:
                    self.assertLess(code, 1 << signal.length)
        self.assertEqual(set(self.code["names"]), found)
        self.assertEqual([self.code["codes"]["PoseAge"]], list(self.file.named("POSE_ZH").signals["Age"].values))
        self.assertEqual([self.code["codes"]["SectorsAge"]], list(self.file.named("SECTOR_INFO").signals["Age"].values))


class Load(unittest.TestCase):
    """The tables of docs/reference/can.md, from the file alone."""
    @classmethod
    def setUpClass(cls):
        cls.file = dbc.read(FILE)
        cls.page = (SOURCE / "docs/reference/can.md").read_text()

    def bits(self, message):
        """In bits of the slow rate."""
        if self.file.attribute(message, "VFrameFormat") == "StandardCAN":
            return classic_bits(message.size)
        slow, fast = fd_bits(message.size)
        return slow + fast / RATIO

    def load(self, message):
        return self.bits(message) * 1000 / self.file.attribute(message, "GenMsgCycleTime") / SLOW * 100

    def test_known_values(self):
        self.assertEqual((55, 135), (classic_bits(0), classic_bits(8)))

    def test_rows(self):
        rows = {}
        for line in self.page.splitlines():
            match = re.match(r"\| `(\w+)` \| (0x\w+)[^|]*\| \w+ \| (\d+) \| (\d+) \| ([\d.]+) \| ([\d.]+) \|", line)
            if match:
                rows[match[1]] = match.groups()[1:]
        rows_of = {m.name: m for m in self.file.messages.values() if not re.match(r"SECTORS_\d\d$", m.name) or m.name == "SECTORS_00"}
        rows_of = {n: m for n, m in rows_of.items() if n != "SECTORS_FD_16"}
        self.assertEqual(set(rows_of), set(rows))
        for name, message in rows_of.items():
            number, size, cycle, bits, load = rows[name]
            self.assertEqual((message.id, message.size, self.file.attribute(message, "GenMsgCycleTime")),
                             (int(number, 16), int(size), int(cycle)), name)
            self.assertAlmostEqual(self.bits(message), float(bits), delta=0.051, msg=name)
            self.assertAlmostEqual(self.load(message), float(load), delta=0.0051, msg=name)

    def test_sums(self):
        classic_pose = {"POSE_XY", "POSE_ZH", "POSE_RP"}

        def total(fd, sectors):
            kept = 0
            for message in self.file.messages.values():
                first = re.search(r"SECTORS_(FD_)?(\d\d)$", message.name)
                if first and ((first[1] is not None) != fd or int(first[2]) >= sectors):
                    continue
                if message.name in (classic_pose if fd else {"POSE_FD"}):
                    continue
                kept += self.load(message)
            return kept

        for fd in (False, True):
            for sectors in (16, 32):
                load = total(fd, sectors)
                self.assertLess(load, 30)
                row = f"| {'CAN FD, 500 kbit/s and 2 Mbit/s' if fd else 'CAN 2.0, 500 kbit/s'} | {sectors} | {load:.2f} % |"
                self.assertTrue(row in self.page, row)


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        FILE.write_text(written(tables_of_the_code()))
    else:
        unittest.main()
