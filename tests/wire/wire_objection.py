# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Objections of docs/reference/wire-format.md, from that page alone."""
import struct

from wire_trust import M64, check, mix

SUBMAP = 0xfffeffff


class Objection:
    """A record of a robot's objections; refused if it is none. It has no evidence."""
    passes, labels = {}, {}

    def __init__(self, record, what):
        check(record.layers == 15 and record.part == 0 and 33 <= len(record.code) <= 96, what)
        robot, epoch, submap, key, _, rows = struct.unpack_from("<3IQIQ", record.code)
        bits = record.code[32:]
        check(submap != SUBMAP and rows != 0 and key < 2**63, what)
        check(len(bits) == bin(rows).count("1") and 0 not in bits, what)
        m = mix((key + mix((submap + mix(robot << 32 | epoch)) & M64)) & M64) % 2**14
        check(record.block == (m % 128, m // 128, 0), what)
