# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Map files that are damaged, and what info tells of sound ones. Whatever byte is wrong, the file is refused in one line
and with bounded memory; every flip and every length of a small file is tried on the codec itself, in tests/unit."""
import json
import resource
import struct
import unittest

import kitti_folder as kitti
from command_case import CommandCase, crc32c

MOST_RESIDENT_BYTES = 512 << 20
PREAMBLE_BYTES = 16  # magic, version, length of the header's body


class Damage(CommandCase):
    def setUp(self):
        super().setUp()
        data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(1, count=40)])
        self.sound = self.folder / "sound.tsm"
        self.map_dataset(data, self.sound, "--inference", "counting")
        self.bytes = self.sound.read_bytes()
        self.header_bytes = PREAMBLE_BYTES + struct.unpack_from("<I", self.bytes, 12)[0] + 4

    def tearDown(self):
        resident = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
        self.assertLess(resident, MOST_RESIDENT_BYTES)
        super().tearDown()

    def info_refuses(self, data, saying=(), options=("--verify",)):
        """--verify reads all of it; without, the header and the end are read."""
        damaged = self.folder / "damaged.tsm"
        damaged.write_bytes(data)
        return self.refused("info", damaged, *options, saying=("damaged.tsm", *saying))

    def positions(self, count):
        """All of the version and lengths, then evenly over the header and over the blocks."""
        size = len(self.bytes)
        header = range(PREAMBLE_BYTES, self.header_bytes, max(1, self.header_bytes // count))
        blocks = range(self.header_bytes, size, max(1, (size - self.header_bytes) // count))
        return sorted({*range(PREAMBLE_BYTES), *header, *range(self.header_bytes - 4, self.header_bytes), *blocks,
                       *range(size - 16, size)})

    def test_the_sound_file_is_accepted(self):
        self.done("info", self.sound)
        self.done("info", self.sound, "--verify")

    def test_what_info_prints_is_what_it_computes(self):
        reports = [self.folder / "stored.json", self.folder / "computed.json"]
        self.done("info", self.sound, "--report", reports[0])
        self.done("info", self.sound, "--verify", "--report", reports[1])
        stored, computed = (json.loads(report.read_text()) for report in reports)
        self.assertEqual((stored["verified"], computed["verified"]), (False, True))
        for report in (stored, computed):
            del report["verified"], report["config"]
        self.assertGreater(stored["label_voxels"], 0)
        self.assertEqual(stored, computed)

    def test_a_flipped_bit_is_refused_wherever_it_is(self):
        for position in self.positions(60):
            with self.subTest(position=position):
                data = bytearray(self.bytes)
                data[position] ^= 1 << (position % 8)
                self.info_refuses(data)

    def test_an_inverted_byte_is_refused_wherever_it_is(self):
        for position in self.positions(60):
            with self.subTest(position=position):
                data = bytearray(self.bytes)
                data[position] ^= 0xFF
                self.info_refuses(data)

    def test_a_truncated_file_is_refused_at_any_length(self):
        for length in self.positions(40):
            with self.subTest(length=length):
                self.info_refuses(self.bytes[:length])
                self.info_refuses(self.bytes[:length], options=())

    def test_a_file_with_more_after_its_end_is_refused(self):
        for more in (b"\0", b"garbage", self.bytes):
            with self.subTest(len(more)):
                self.info_refuses(self.bytes + more)
                if more != self.bytes:  # which ends as the file does
                    self.info_refuses(self.bytes + more, options=())

    def test_files_that_are_no_maps(self):
        self.info_refuses(b"", saying=("too short",))
        self.info_refuses(b"ply\nformat ascii 1.0\n" * 100, saying=("not a map file (.tsm)", ".bt"))
        self.info_refuses(bytes(100000))

    def with_header(self, changed):
        """The file with other header bytes and a checksum that fits them."""
        body = bytearray(self.bytes[:self.header_bytes - 4])
        changed(body)
        return bytes(body) + struct.pack("<I", crc32c(body)) + self.bytes[self.header_bytes:]

    def test_the_checksum_here_is_the_files(self):
        self.assertEqual(self.bytes, self.with_header(lambda body: None))

    def test_a_newer_major_version_is_refused(self):
        self.info_refuses(self.with_header(lambda body: struct.pack_into("<H", body, 8, 3)), saying=("version",))

    def test_a_header_that_claims_more_than_the_file_holds_takes_no_memory(self):
        counts = PREAMBLE_BYTES + 4 + 16 + 8 + 12 + 96  # blocks, label pages, free pages, octets
        for blocks in (1 << 20, 1 << 31, 1 << 32, 1 << 62):
            with self.subTest(blocks):
                def claim(body, blocks=blocks):
                    struct.pack_into("<4Q", body, counts, blocks, blocks, blocks, 64 * blocks % (1 << 64))
                self.info_refuses(self.with_header(claim))

    def test_settings_that_no_map_can_have(self):
        for offset, text in ((4, "resolution"), (12, "prior")):
            for value in (float("nan"), float("inf"), -1.0):
                with self.subTest(setting=text, value=value):
                    def change(body, offset=offset, value=value):
                        struct.pack_into("<d", body, PREAMBLE_BYTES + offset, value)
                    self.info_refuses(self.with_header(change))

    def test_every_reader_refuses(self):
        damaged = self.folder / "damaged.tsm"
        damaged.write_bytes(self.bytes[:-1])
        points = self.folder / "points.csv"
        points.write_text("x,y,z\n0,0,0\n")
        data = self.folder / "data"
        for arguments in (("query", "--map", damaged, "--points", points, "--out", "out"),
                          ("export", "--map", damaged, "--format", "ply", "--out", "out"),
                          ("eval", "--map", damaged, "--dataset", data),
                          ("eval", "--map", self.sound, "--dataset", data, "--overlap-of", self.sound, damaged),
                          ("map", "--dataset", data, "--out", "out", "--continue", damaged)):
            with self.subTest(arguments[0]):
                self.refused(*arguments, saying=("damaged.tsm",))
                self.assertFalse((self.folder / "out").exists())


class Info(CommandCase):
    def test_tells_what_the_map_is(self):
        data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(1)])
        _, mapped = self.map_dataset(data, self.folder / "map.tsm", "--robot", "5", "--resolution", "0.2")
        self.done("info", "map.tsm", "--report", "info.json")
        info = json.loads((self.folder / "info.json").read_text())
        self.assertEqual("local", info["kind"])
        self.assertEqual(5, info["robot"])
        self.assertEqual(0.2, info["resolution"])
        self.assertEqual(19, len(info["classes"]))
        self.assertEqual(mapped["digest"], info["digest"])
        for key in ("label_voxels", "free_voxels"):
            self.assertEqual(mapped["memory"][key], info[key])
        self.assertEqual((self.folder / "map.tsm").stat().st_size, info["file_bytes"])

    def test_files_that_cannot_be_read(self):
        self.refused("info", "absent.tsm", saying=("absent.tsm",))
        self.refused("info", self.folder, saying=(self.folder,))
        self.refused("info")


if __name__ == "__main__":
    unittest.main()
