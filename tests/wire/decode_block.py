#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A decoder of a block's content, written from docs/reference/wire-format.md alone, whose table it reads.

decode_block.py PAGE FILE: decodes the blocks that write_blocks wrote and compares them with what it says they hold.
"""
import pathlib
import re
import sys

from decode_bits import Bits, Corrupt, check

LABELS, PASSES, LABELLED, FULL, VOXEL, SAME, REST, MORE, COMPONENT = 0, 1, 2, 10, 11, 27, 29, 30, 33
PASSED, VOXEL_PASSED, FREED, ALL_FREED, VOXEL_FREED = 97, 105, 108, 135, 162
CENTROID, CENTROID_LEVEL = 278, 296


def table_of(page):
    text = re.search(r"```table\n(.*?)```", page, re.DOTALL)[1]
    numbers = [int(word) for word in re.findall(r"\d+", text)]
    assert len(numbers) == 401
    return numbers


def count_of(level):
    return (1 + (level - 1) % 4 / 4) * 2.0 ** ((level - 1) // 4 - 12)


def passes_of(level):
    return level if level <= 8 else (4 + level % 4) << (level // 4 - 1)


class Octet:
    def __init__(self):
        self.labelled, self.freed = [False] * 8, [False] * 8
        self.levels = [0] * 8
        self.passed, self.f, self.passes = False, 0, 0


def clamp(level):
    return min(max(level, 1), 127)


class Block:
    """labels: {(octet, voxel): ((components), {slot: level})}; passes and centroids: {(octet, voxel): passes, or levels}."""

    def __init__(self, code, layers, num_components, table):
        self.bits, self.num_components = Bits(code, table), num_components
        self.octets = [Octet() for _ in range(64)]
        self.labels, self.passes, self.centroids = {}, {}, {}
        self.last_had_centroid, self.last_centroid = 2, [0, 0, 0]
        self.last_set, self.steps, self.last_passes = ((), False), [0, -4, -4, -4], 1
        has_labels, has_passes = self.bits.bit(LABELS), self.bits.bit(PASSES)
        check(has_labels or has_passes)
        for o in range(64):
            if layers >> (o // 16) & 1:
                if has_labels:
                    self.read_labels(o)
                if has_passes:
                    self.read_passes(o)
        check(has_labels == bool(self.labels) and has_passes == bool(self.passes))
        bits = layers.bit_count() * 16 * (3 + 8 * 69) + 14
        most = (bits + bits // 1024) // 8 + 1
        check(self.bits.plain or self.bits.read - 4 < 3 * most // 4)
        self.bits.check_end()

    def before(self, o):
        return [self.octets[o - 1] if o % 4 else Octet(), self.octets[o - 4] if o // 4 % 4 else Octet(),
                self.octets[o - 16] if o >= 16 else Octet()]

    def read_labels(self, o):
        octet, before = self.octets[o], self.before(o)
        if not self.bits.bit(LABELLED + sum(any(b.labelled) << i for i, b in enumerate(before))):
            return
        if self.bits.bit(FULL):
            octet.labelled = [True] * 8
        else:
            for v in range(8):
                less = [v - step for step in (1, 2, 4) if v & step]
                octet.labelled[v] = self.bits.bit(VOXEL + 4 * len(less) + sum(octet.labelled[u] for u in less))
            check(any(octet.labelled) and not all(octet.labelled))
        levels, used, first = [[0] * 8 for _ in range(4)], {0}, True
        for v in range(8):
            slots = []
            if octet.labelled[v]:
                self.read_components(first)
                first = False
                components, rest = self.last_set
                slots = [*range(len(components))] + [3] * rest
            found = self.read_levels(v, slots, levels, used, before)
            if octet.labelled[v]:
                self.labels[o, v] = (components, found)
                if slots != [0, 1, 2, 3]:
                    self.read_centroid(o, v, found[slots[0]])
        octet.levels = levels[0]

    def read_components(self, first):
        if self.bits.bit(SAME if first else SAME + 1):
            check(self.last_set != ((), False))
            return
        rest = self.bits.bit(REST)
        n = 0 if rest else 1
        while n < 3 and self.bits.bit(MORE + n):
            n += 1
        components = []
        for _ in range(n):
            node = 1
            for _ in range(6):
                node = 2 * node + self.bits.bit(COMPONENT + node)
            check(max(components, default=0) < node - 64 < self.num_components)
            components.append(node - 64)
        check((tuple(components), rest) != self.last_set)
        self.last_set = (tuple(components), rest)

    def read_centroid(self, o, v, level):
        amount = 0 if level < 37 else min((level - 37) // 4 + 1, 5)
        self.last_had_centroid = int(self.bits.bit(CENTROID + 6 * self.last_had_centroid + amount))
        if not self.last_had_centroid:
            return
        found = []
        for axis in range(3):
            k = CENTROID_LEVEL + 5 * (7 * axis + self.last_centroid[axis])
            if self.bits.bit(k):
                found.append(4 + self.bits.bit(k + 1))
            else:
                upper = self.bits.bit(k + 2)
                found.append(2 * upper + self.bits.bit(k + 3 + upper))
        self.last_centroid = [1 + one for one in found]
        self.centroids[o, v] = found

    def read_levels(self, v, slots, levels, used, before):
        found = {}
        for s in range(4):
            if s not in used:
                if s not in slots:
                    continue
                used.add(s)
                for u in range(v):
                    levels[s][u] = clamp(levels[0][u] + self.steps[s])
            expected = self.expected(s, v, levels, before)
            levels[s][v] = expected
            if s in slots:
                group = v if s == 0 else 8 if v == 0 else 9
                levels[s][v] = found[s] = self.bits.number(group, expected, 127)
                if s > 0:
                    self.steps[s] = levels[s][v] - levels[0][v]
        return found

    def expected(self, s, v, levels, before):
        row = levels[s]
        if v == 0:
            if s > 0:
                return clamp(levels[0][0] + self.steps[s])
            known = [b.levels[1 << i] for i, b in enumerate(before) if any(b.labelled)]
            return sum(known) // len(known) if known else 49
        if v in (1, 2, 4):
            return row[0]
        if v == 7:
            return clamp(int((2 * (row[3] + row[5] + row[6]) - row[1] - row[2] - row[4]) / 3))
        one, other = {3: (1, 2), 5: (1, 4), 6: (2, 4)}[v]
        return clamp(row[one] + row[other] - row[0])

    def read_passes_level(self, group):
        self.last_passes = self.bits.number(group, self.last_passes, 27)
        return self.last_passes

    def read_passes(self, o):
        octet, before = self.octets[o], self.before(o)
        labelled = [v for v in range(8) if octet.labelled[v]]
        if labelled and self.bits.bit(PASSED + sum(b.passed << i for i, b in enumerate(before))):
            octet.passed, c = True, 2
            for v in labelled:
                c = int(self.bits.bit(VOXEL_PASSED + c))
                if c:
                    self.passes[o, v] = passes_of(self.read_passes_level(10))
            check(any((o, v) in self.passes for v in labelled))
        others = [v for v in range(8) if not octet.labelled[v]]
        if not others:
            octet.f = 1
            return
        c = before[0].f + 3 * before[1].f + 9 * before[2].f
        if not self.bits.bit(FREED + c):
            return
        if self.bits.bit(ALL_FREED + c):
            octet.f = 2
            for v in others:
                octet.freed[v] = True
        else:
            octet.f = 1
            for v in others:
                near = [(octet if v & step else b).freed[v ^ step] for step, b in zip((1, 2, 4), before)]
                octet.freed[v] = self.bits.bit(VOXEL_FREED + near[0] + 2 * near[1] + 4 * near[2])
            check(any(octet.freed) and any(not octet.freed[v] for v in others))
        for b in reversed(before):
            if any(b.freed):
                self.last_passes = b.passes
        octet.passed, octet.passes = True, self.read_passes_level(11)
        self.passes.update({(o, v): passes_of(octet.passes) for v in others if octet.freed[v]})

    def lines(self):
        """As write_blocks writes them: by octet and voxel."""
        for o in range(64):
            for v in range(8):
                components, levels = self.labels.get((o, v), ((), {}))
                words = [f"{c}:{count_of(levels[s]):.9g}" for s, c in enumerate(components)]
                words += [f"rest:{count_of(levels[3]):.9g}"] if 3 in levels else []
                words += [f"passes:{self.passes[o, v]}"] if (o, v) in self.passes else []
                words += ["centroid:" + ",".join(map(str, self.centroids[o, v]))] if (o, v) in self.centroids else []
                if words:
                    yield f"{o} {v} " + " ".join(words)


def main():
    table = table_of(pathlib.Path(sys.argv[1]).read_text())
    records = pathlib.Path(sys.argv[2]).read_text().split("block ")[1:]
    corrupt = 0
    for i, record in enumerate(records):
        head, *content = record.splitlines()
        layers, num_components, code = head.split(" ")
        try:
            found = [*Block(bytes.fromhex(code), int(layers), int(num_components), table).lines()] if code else []
        except Corrupt:
            found = ["corrupt"]
            corrupt += 1
        if found != content:
            sys.exit(f"block {i} of {len(records)}: {found[:3]} instead of {content[:3]}")
    print(f"{len(records)} blocks, {corrupt} of them corrupt, are what they are said to be")
    if not corrupt < len(records):
        sys.exit("nothing was compared")


if __name__ == "__main__":
    main()
