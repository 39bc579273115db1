# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Statements about frames of docs/reference/wire-format.md, from that page alone."""
import struct

import wire_frames
from wire_trust import check

SUBMAP = 0xfffefffe
LINK, PRIOR, COVARIANCE = 123, 81, 72
UNKNOWN, VAGUE, EXACT = range(3)


class Bytes:
    """What wire_frames.read_code() reads from."""
    def __init__(self, data):
        self.data = data

    def bytes(self, size):
        taken, self.data = self.data[:size], self.data[size:]
        return taken

    def take(self, layout):
        return struct.unpack("<" + layout, self.bytes(struct.calcsize("<" + layout)))

    def u8(self):
        return self.bytes(1)[0]


def check_covariance(data, what):
    steps = [int.from_bytes(data[i:i + 3], "little", signed=True) for i in range(0, COVARIANCE, 3)]
    check(all(step > -2**23 for step in steps), what)
    check(all(steps[3 + row * (row + 3) // 2] >= 1 for row in range(6)), what)


class FrameStatement:
    """A record of what a robot states about frames; refused if it is none. It has no evidence."""
    passes, labels = {}, {}

    def __init__(self, name, record, what):
        self.is_prior = record.block == (0, 0, 1)
        check(record.layers == 15 and record.part == 0 and len(record.code) == (PRIOR if self.is_prior else LINK), what)
        (self.check_prior if self.is_prior else self.check_link)(name, record, what)

    @staticmethod
    def check_prior(name, record, what):
        robot, epoch, kind = struct.unpack_from("<2IB", record.code)
        check((robot, epoch) == name[:2] and kind <= EXACT, what)
        if kind == VAGUE:
            check_covariance(record.code[9:], what)
        else:
            check(not any(record.code[9:]), what)

    @staticmethod
    def check_link(name, record, what):
        robot, to, epoch, _, _, _, revision, flags = struct.unpack_from("<7IB", record.code)
        check((robot, epoch) == name[:2] and to != robot and revision >= 1 and flags <= 1, what)
        check(record.block == (to % 2**16, to // 2**16, 0), what)
        code = wire_frames.read_code(Bytes(record.code[29:51]))
        T = wire_frames.transform_of(code)
        check(T is not None and wire_frames.code_of(T) == code, what)
        check_covariance(record.code[51:], what)
