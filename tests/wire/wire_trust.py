# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Tags, hashes, trees, proofs and signatures of docs/reference/wire-format.md, written from it, from RFC 7693 (by hashlib) and from RFC 8032."""
import functools
import hashlib
import struct

M64 = 2**64 - 1


class Refused(Exception):
    """A datagram that the page does not allow."""


def check(condition, why):
    if not condition:
        raise Refused(why)


# CRC-32C: polynomial 0x1edc6f41, bits reflected, begins with and is inverted by 2^32 - 1.
def crc_entry(byte):
    for _ in range(8):
        byte = byte >> 1 ^ (0x82f63b78 if byte & 1 else 0)
    return byte


CRC_TABLE = [crc_entry(byte) for byte in range(256)]


def crc32c(data):
    crc = 2**32 - 1
    for byte in data:
        crc = crc >> 8 ^ CRC_TABLE[(crc ^ byte) & 255]
    return crc ^ (2**32 - 1)


assert crc32c(b"123456789") == 0xe3069283


def mix(x):
    x ^= x >> 30
    x = x * 0xbf58476d1ce4e5b9 & M64
    x ^= x >> 27
    x = x * 0x94d049bb133111eb & M64
    return x ^ x >> 31


def digest(words):
    s = 0x7465737365726121
    for w in words:
        s = mix((s + 0x9e3779b97f4a7c15 + mix(w ^ (s << 23 | s >> 41) & M64)) & M64)
    return mix(s)


def unsigned_hash(data):
    """The hash of a fleet that does not sign."""
    whole = len(data) // 8
    words = [len(data), *struct.unpack_from(f"<{whole}Q", data), int.from_bytes(data[8 * whole:], "big")]
    return struct.pack("<QQ", digest(words), digest([1, *words]))


# Ed25519, RFC 8032 section 5.1. A point is (X, Y, Z, T) with x = X / Z, y = Y / Z, x y = T / Z.
P = 2**255 - 19
ORDER = 2**252 + 27742317777372353535851937790883648493
D = -121665 * pow(121666, P - 2, P) % P
ROOT_OF_MINUS_ONE = pow(2, (P - 1) // 4, P)


def add(one, other):
    a = (one[1] - one[0]) * (other[1] - other[0]) % P
    b = (one[1] + one[0]) * (other[1] + other[0]) % P
    c = 2 * one[3] * other[3] * D % P
    d = 2 * one[2] * other[2] % P
    e, f, g, h = b - a, d - c, d + c, b + a
    return e * f % P, g * h % P, f * g % P, e * h % P


def point_of(data):
    """None for bytes that are no point."""
    y, sign = int.from_bytes(data, "little") & 2**255 - 1, data[31] >> 7
    if y >= P:
        return None
    u, v = y * y - 1, D * y * y + 1
    x = u * pow(v, 3, P) * pow(u * pow(v, 7, P), (P - 5) // 8, P) % P
    if v * x * x % P != u % P:
        x = x * ROOT_OF_MINUS_ONE % P
    if v * x * x % P != u % P or (x == 0 and sign):
        return None
    x = x if x & 1 == sign else P - x
    return x, y, 1, x * y % P


def times(scalars, points):
    """The sum of each scalar times its point, for two of each."""
    sums = [None, points[0], points[1], add(*points)]
    total = 0, 1, 1, 0
    for i in reversed(range(256)):
        total = add(total, total)
        which = (scalars[0] >> i & 1) + 2 * (scalars[1] >> i & 1)
        if which:
            total = add(total, sums[which])
    return total


BASE = point_of((4 * pow(5, P - 2, P) % P).to_bytes(32, "little"))


@functools.lru_cache(maxsize=None)
def is_signature(key, message, signature):
    a, s = point_of(key), int.from_bytes(signature[32:], "little")
    if a is None or s >= ORDER:
        return False
    h = int.from_bytes(hashlib.sha512(signature[:32] + key + message).digest(), "little") % ORDER
    x, y, z, _ = times((s, h), (BASE, (P - a[0], a[1], 1, P - a[3])))
    x, y = x * pow(z, P - 2, P) % P, y * pow(z, P - 2, P) % P
    return (y | (x & 1) << 255).to_bytes(32, "little") == signature[:32]


class Fleet:
    """What all robots of a fleet know: key and mission (or None), configuration, number of classes, and, if it signs, each one's public key."""

    def __init__(self, key, mission, configuration, num_classes, public_keys):
        self.configuration, self.num_classes, self.public_keys = configuration, num_classes, public_keys
        self.key, self.mission_value = None, bytes(16)
        if key:
            name = bytes([len(mission)]) + mission
            self.key = hashlib.blake2b(b"tessera 2 datagram tag" + name, digest_size=32, key=key).digest()
            self.mission_value = hashlib.blake2b(b"tessera 2 mission" + name, digest_size=16).digest()
        self.signs = bool(public_keys)

    def tag(self, data):
        if self.key:
            return hashlib.blake2b(data, digest_size=16, key=self.key).digest()
        return struct.pack("<I12x", crc32c(data))

    def hash(self, data):
        return hashlib.blake2b(data, digest_size=16).digest() if self.signs else unsigned_hash(data)

    def leaf_of_record(self, name, record):
        return self.leaf_of_facts(name, self.facts_of(record))

    def facts_of(self, record):
        return struct.pack("<2IB3i", record.version, record.version - record.part, record.layers, *record.block) + self.hash(record.code)

    def leaf_of_facts(self, name, facts):
        return self.hash(b"\0" + struct.pack("<3I", *name) + facts)

    def leaf_of_statement(self, statement):
        return self.hash(b"\2" + statement)

    def leaf_of_frame(self, alone):
        return self.hash(b"\3" + alone)

    def node(self, left, right):
        return self.hash(b"\1" + left + right)

    def root(self, leaves):
        while len(leaves) > 1:
            pairs = [self.node(*leaves[i:i + 2]) for i in range(0, len(leaves) - 1, 2)]
            leaves = pairs + (leaves[-1:] if len(leaves) % 2 else [])
        return leaves[0]

    def check_signature(self, robot, message, signature):
        check(robot in self.public_keys, "a robot without a key")
        check(is_signature(self.public_keys[robot], self.mission_value + message, signature), "signature")

    def check_tree(self, kind, name, leaves, signature):
        self.check_root(kind, name, len(leaves), self.root(leaves), signature)

    def check_root(self, kind, name, num_leaves, root, signature):
        crc = struct.pack("<I", crc32c(self.configuration))
        self.check_signature(name[0], b"TS\2" + bytes([kind]) + crc + struct.pack("<3IB", *name, num_leaves) + root, signature)

    def check_proof(self, kind, name, leaf, reader):
        """Reads a proof of this leaf of a tree of that kind; returns its bytes."""
        begin = reader.at
        i, n = reader.u8() % 16, reader.data[begin] // 16 + 1
        check(i < n, "proof of a leaf that is none")
        num_leaves = n
        while n > 1:
            if i ^ 1 < n:
                beside = reader.bytes(16)
                leaf = self.node(beside, leaf) if i & 1 else self.node(leaf, beside)
            i, n = i // 2, (n + 1) // 2
        self.check_root(kind, name, num_leaves, leaf, reader.bytes(64))
        return reader.data[begin:reader.at]
