# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A reader of map files that was written from docs/reference/memory.md, "The map file", alone. It checks what the page says of a
sound file, and computes digest and summary from the blocks."""
import dataclasses
import struct

MASK = 2**64 - 1
SALT = 0x9E3779B97F4A7C15
REST, CENTROID = 64, 65


def crc_table():
    table = []
    for value in range(256):
        for _ in range(8):
            value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
        table.append(value)
    return table


TABLE = crc_table()


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc = crc >> 8 ^ TABLE[(crc ^ byte) & 255]
    return crc ^ 0xFFFFFFFF


def mix(x):
    x ^= x >> 30
    x = x * 0xBF58476D1CE4E5B9 & MASK
    x ^= x >> 27
    x = x * 0x94D049BB133111EB & MASK
    return x ^ x >> 31


class Digest:
    def __init__(self):
        self.s = 0x7465737365726121

    def add(self, word):
        turned = (self.s << 23 | self.s >> 41) & MASK
        self.s = mix((self.s + SALT + mix(word ^ turned)) & MASK)

    def value(self):
        return mix(self.s)


def require(holds, what):
    if not holds:
        raise ValueError(what)


class Bytes:
    """A file's bytes, taken in order; check() takes a checksum of those since the last one."""

    def __init__(self, data):
        self.data, self.at, self.since = data, 0, 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values if len(values) > 1 else values[0]

    def check(self):
        require(crc32c(self.data[self.since:self.at]) == self.take("I"), "a checksum")
        self.since = self.at


@dataclasses.dataclass
class Summary:
    digest: int = 0
    voxels: list = dataclasses.field(default_factory=lambda: [0, 0, 0, 0])
    low: list = None
    high: list = None
    by_label: list = None


class MapFile:
    def __init__(self, data):
        self.bytes = Bytes(data)
        self.read_header()
        self.computed = Summary(by_label=[0] * (self.classes + 2))
        self.digest = Digest()
        self.begin_digest()
        self.content = [0, 0, 0, 0]
        self.last_key = -1
        for _ in range(self.blocks[0]):
            self.read_block()
        self.read_end()
        self.computed.digest = self.digest.value()
        if self.computed.low is None:
            self.computed.low = self.computed.high = [0, 0, 0]

    def read_header(self):
        take = self.bytes.take
        require(take("8s") == b"TSMAP\r\n\x1a", "the magic")
        major, _ = take("HH")
        require(major == 2, "the major version")
        body = take("I")
        require(body <= 6144, "the body's length")
        self.kind, tuple_byte, self.classes, self.has_frame = take("BBBB")
        self.tuple, self.has_shares, self.has_votes = tuple_byte & 63, tuple_byte > 127, bool(tuple_byte & 64)
        self.resolution, self.prior = take("dd")
        self.cap, self.free_weight = take("ff")
        self.robot, self.epoch, self.revision = take("III")
        self.frame = take("12d")
        self.blocks = list(take("QQQQ"))
        self.table = [(take("32s"), take("BBB")) for _ in range(self.classes)]
        self.settings = take(f"{take('I')}s")
        self.summary = None
        if take("B"):
            self.summary = Summary(take("Q"), list(take("QQQQ")), list(take("3i")), list(take("3i")), list(take(f"{self.classes + 2}Q")))
        require(self.bytes.at <= 16 + body, "the body's length")
        self.bytes.at = 16 + body
        self.bytes.check()

    def begin_digest(self):
        for form, value in (("d", self.resolution), ("d", self.prior)):
            self.digest.add(int.from_bytes(struct.pack("<" + form, value), "little"))
        self.digest.add(self.tuple)
        self.digest.add(self.classes)
        for name, (red, green, blue) in self.table:
            for byte in name:
                self.digest.add(byte)
            self.digest.add(red << 16 | green << 8 | blue)

    def read_block(self):
        take = self.bytes.take
        key, revision, parts, mask = take("Q"), take("I"), take("B"), take("Q")
        free, voted = parts & 15, parts >> 4
        labelled = sum(1 << layer for layer in range(4) if mask >> 16 * layer & 0xFFFF)
        require(not voted or (self.has_votes and not voted & ~labelled), "layers with votes")
        self.bytes.check()
        require(self.last_key < key < 2**63 and revision <= self.revision and free <= 1 and (free or mask), "a block's head")
        self.last_key = key
        self.content = [a + b for a, b in zip(self.content, (1, mask != 0, free, mask.bit_count()))]
        passes = take("512s") if free else bytes(512)
        require(any(passes) == bool(free), "passes")
        for layer in range(4):
            if voted >> layer & 1:
                self.read_votes()
        self.centroids = {}
        voxels = {n: {} for n, passed in enumerate(passes) if passed}
        for octet in range(64):
            if mask >> octet & 1:
                self.read_octet(octet, voxels)
        self.bytes.check()
        self.add_block(key, voxels, passes)

    def read_votes(self):
        of_classes = [self.bytes.take("B4H") for _ in range(self.bytes.take("B"))]
        labels = [of_class[0] for of_class in of_classes]
        require(len(labels) <= 5 and labels == sorted(set(labels)) and all(1 <= label <= self.classes for label in labels), "classes of votes")
        require(all(any(of_class[1:]) for of_class in of_classes), "a class without votes")
        require(all(sum(of_class[1 + cell] for of_class in of_classes) <= 8192 for cell in range(4)), "a cell's votes")

    def read_octet(self, octet, voxels):
        take = self.bytes.take
        observed = take("B")
        require(observed, "an octet's mask")
        for voxel in range(8):
            if observed >> voxel & 1:
                number, centroid = take("BB")
                require(centroid <= 216, "a centroid")
                counts = [take("Bf") for _ in range(number)]
                components = [c for c, _ in counts]
                require(counts and components == sorted(set(components)) and components[-1] <= self.classes + 1, "components")
                require(all(2.0**-60 <= count <= 2.0**30 for _, count in counts), "a count")
                voxels[octet * 8 + voxel] = dict(counts)
                self.centroids[octet * 8 + voxel] = centroid

    def add_block(self, key, voxels, passes):
        corner = [8 * ((key >> shift & (2**21 - 1)) - 2**20) for shift in (0, 21, 42)]
        total = 0
        for number, counts in voxels.items():
            octet, voxel = divmod(number, 8)
            x, y, z = (2 * (octet >> 2 * axis & 3) + (voxel >> axis & 1) for axis in range(3))
            free = struct.unpack("<f", struct.pack("<f", passes[number] * self.free_weight))[0]
            hashed = ([(0, free)] if passes[number] else []) + [(c or REST, n) for c, n in counts.items()]
            hashed += [(CENTROID, self.centroids[number])] if self.centroids.get(number) else []
            for component, count in hashed:
                bits = int.from_bytes(struct.pack("<f", count), "little")
                total += mix(((x + 8 * y + 64 * z << 40 | component << 32 | bits) + SALT) & MASK)
            require(not self.cap or free + sum(counts.values()) <= self.cap * 1.001, "the cap")
            self.count([corner[0] + x, corner[1] + y, corner[2] + z], free, counts)
        if total & MASK:
            self.digest.add(key)
            self.digest.add(total & MASK)

    def count(self, at, free, counts):
        s = self.computed
        s.low = [min(a, b) for a, b in zip(s.low or at, at)]
        s.high = [max(a, b) for a, b in zip(s.high or at, at)]
        # Added in the order of components, the rest at the end.
        evidence = free + sum(n for c, n in sorted(counts.items(), key=lambda item: item[0] or REST))
        occupied = 1.0 - (self.prior + free) / ((self.classes + 2) * self.prior + evidence) > 0.5
        s.voxels[0 if counts else 1] += 1
        s.voxels[2 if occupied else 3] += 1
        if occupied:
            of_classes = {c: n for c, n in counts.items() if 1 <= c <= self.classes}
            s.by_label[max(of_classes, key=lambda c: (of_classes[c], -c)) if of_classes else 0] += 1

    def read_end(self):
        require(self.content == self.blocks, "the header's numbers")
        require(self.bytes.take("4s") == bytes.fromhex("21444e45"), "the end mark")
        require(self.bytes.take("Q") == self.blocks[0], "the number of blocks")
        self.bytes.check()
        require(self.bytes.at == len(self.bytes.data), "what follows the end")
