# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Map files by a reader that was written from docs/reference/memory.md: what it computes is what the header and "tessera info" say."""
import json
import os
import pathlib
import struct
import subprocess
import tempfile
import unittest

from map_file import MapFile


def tessera(*arguments):
    subprocess.run([os.environ["TESSERA_COMMAND"], *map(str, arguments)], check=True, capture_output=True)


class Files(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        tessera("simulate", "--robots", "2", "--scans", "1", "--seed", "1", "--out", cls.folder / "street")

    def mapped(self, robot, *options):
        out = self.folder / f"{robot}.tsm"
        tessera("map", "--dataset", self.folder / f"street/robot_{robot}", "--out", out, "--resolution", "0.4", *options)
        return out

    def check(self, path):
        read = MapFile(path.read_bytes())
        self.assertIsNotNone(read.summary)
        self.assertEqual(read.computed, read.summary)
        self.assertGreater(read.computed.voxels[0], 100)
        report = self.folder / "info.json"
        tessera("info", path, "--verify", "--report", report)
        info = json.loads(report.read_text())
        self.assertEqual(info["digest"], f"{read.computed.digest:016x}")
        self.assertEqual((info["label_voxels"], info["free_voxels"]), tuple(read.computed.voxels[:2]))
        return read

    def test_compact_with_free_space(self):
        read = self.check(self.mapped(0))
        self.assertEqual((1, 0), (read.tuple, read.kind))
        self.assertGreater(read.computed.voxels[1], 100)
        self.assertIn(b'"resolution"', read.settings)

    def test_dense_of_the_kernel_mode(self):
        read = self.check(self.mapped(1, "--inference", "kernel", "--free-space", "off", "--robot", "7"))
        self.assertEqual((0, 7), (read.tuple, read.robot))

    def test_a_global_map(self):
        tessera("fuse", self.mapped(0), self.mapped(1), "--out", self.folder / "global.tsm")
        self.assertEqual(1, self.check(self.folder / "global.tsm").kind)

    def test_a_flipped_bit_is_noticed(self):
        data = bytearray(self.mapped(0).read_bytes())
        for at in range(0, len(data), len(data) // 40):
            with self.subTest(at):
                data[at] ^= 16
                with self.assertRaises((ValueError, struct.error)):
                    MapFile(bytes(data))
                data[at] ^= 16


if __name__ == "__main__":
    unittest.main()
