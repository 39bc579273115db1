#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A second decoder of statuses, written from docs/reference/wire-format.md alone.

decode_status.py FILE: as record_status writes it.
"""
import hashlib
import pathlib
import struct
import sys

from wire_trust import Refused, check, is_signature

TYPED = 436
COUNTERS, OWN_COUNTERS = 30, 9
DOUBTED = 8
DOUBTED_AT = TYPED - 8 * COUNTERS - 12 * DOUBTED - 4
EXCLUDE_DIGEST_AT = DOUBTED_AT - 8


def read_status(data, key, mission, public_keys):
    """What it says; key and public_keys: None in a fleet without. Raises Refused."""
    name = bytes([len(mission)]) + mission
    check(len(data) == TYPED + 12 + (64 if public_keys else 0) + (16 if key else 0), "size")
    if key:
        tags = hashlib.blake2b(b"tessera 2 status tag" + name, digest_size=32, key=key).digest()
        check(hashlib.blake2b(data[:-16], digest_size=16, key=tags).digest() == data[-16:], "tag")
    version, robot = struct.unpack_from(">2i", data, 8)
    check(version == 5, "version")
    session, sequence = struct.unpack_from("<QI", data, TYPED)
    if public_keys:
        value = hashlib.blake2b(b"tessera 2 mission" + name, digest_size=16).digest()
        check(robot in public_keys, "a robot without a key")
        check(is_signature(public_keys[robot], value + b"tessera 2 status" + data[:TYPED + 12], data[TYPED + 12:TYPED + 76]), "signature")
    counters = struct.unpack_from(f">{COUNTERS}q", data, TYPED - 8 * COUNTERS)
    doubted, *named = struct.unpack_from(f">{1 + DOUBTED}i{DOUBTED}q", data, DOUBTED_AT)
    return {"robot": robot, "doubted": dict(list(zip(named[:DOUBTED], named[DOUBTED:]))[:doubted]), "session": session, "sequence": sequence, "twins": counters[27:29], "conflicts": counters[29],
            "exclude_digest": struct.unpack_from(">q", data, EXCLUDE_DIGEST_AT)[0]}


def refused(*arguments):
    try:
        read_status(*arguments)
    except Refused as why:
        return str(why)
    return ""


def main(path):
    words = dict(line.split(" ", 1) for line in pathlib.Path(path).read_text().splitlines())
    key, mission = bytes.fromhex(words["key"]), words["mission"].encode()
    public_keys = {2: bytes.fromhex(words["public"])}
    wanted = {"robot": 2, "session": 0x0123456789abcdef, "sequence": 0xfedcba98, "twins": (17, 19), "conflicts": 23, "exclude_digest": 0xfedcba98,
              "doubted": {5: 0b1010, 9: 1 << 62}}
    for mode, keys in (("none", (None, b"", None)), ("key", (key, mission, None)), ("signatures", (key, mission, public_keys))):
        data = bytes.fromhex(words["status_" + mode])
        assert read_status(data, *keys) == wanted, mode
        assert refused(data[:-1], *keys) == "size"
        if mode != "none":
            assert refused(data, key, b"harbour 8", keys[2]) == "tag"
            assert all(refused(data[:i] + bytes([data[i] ^ 1]) + data[i + 1:], *keys) == "tag" for i in range(len(data)))
    # Whoever has the fleet's key can make the tag, and not the signature.
    signed = bytearray.fromhex(words["status_signatures"])
    signed[TYPED] ^= 1
    tags = hashlib.blake2b(b"tessera 2 status tag" + bytes([len(mission)]) + mission, digest_size=32, key=key).digest()
    signed[-16:] = hashlib.blake2b(signed[:-16], digest_size=16, key=tags).digest()
    assert refused(bytes(signed), key, mission, public_keys) == "signature"


if __name__ == "__main__":
    main(sys.argv[1])
