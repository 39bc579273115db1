#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A second decoder of datagrams, written from docs/reference/wire-format.md alone: reads what a team said, keeps what each robot holds by the page's rules,
and compares it with what the robots hold.

decode_datagram.py PAGE FILE...: FILE as record_exchange writes it.
"""
import collections
import pathlib
import struct
import sys

import decode_block
import wire_datagram as wire
import wire_encode
import wire_frames
from wire_trust import Fleet, Refused, crc32c, mix, M64


class Replica:
    """What a robot holds of one contribution."""

    def __init__(self):
        self.frame, self.records, self.layers, self.sum = 0, {}, {}, None

    def add(self, record, leaf):
        """leaf: its first eight bytes are the high half of the hash."""
        high, low = struct.unpack("<QQ", leaf)
        name = record.version, record.block, record.layers, high, low
        for layer in range(4):
            if record.layers >> layer & 1:
                counts = self.layers.get((record.block, layer))
                if counts is None or (record.version, -high, -low) > (counts[0], -counts[3], -counts[4]):
                    self.layers[record.block, layer] = name
        self.records[name] = record
        self.sum = None

    def live(self):
        """Records that count, with their live layers, by version."""
        found = collections.defaultdict(int)
        for (_, layer), name in self.layers.items():
            found[name] |= 1 << layer
        return sorted(found.items())

    def fingerprint(self):
        """The number of records and the halves of their fingerprint."""
        if self.sum is None:
            live = self.live()
            marks = [mark(name, layers) for name, layers in live]
            self.sum = len(live), sum(low for low, _ in marks) & M64, sum(high for _, high in marks) & M64
        return self.sum

    def evidence(self, codes):
        """The number of blocks with any evidence, and the sums of passes and of evidence of labels."""
        blocks, passes, labels = set(), 0, 0.0
        for name, layers in self.live():
            record = self.records[name]
            if not record.code:
                continue
            block = codes[record.layers, record.code]
            blocks.add(record.block)
            passes += sum(n for (octet, _), n in block.passes.items() if layers >> octet // 16 & 1)
            labels += sum(decode_block.count_of(level) for (octet, _), (_, levels) in block.labels.items() if layers >> octet // 16 & 1
                          for level in levels.values())
        return len(blocks), passes, labels


def mark(name, layers):
    """The low and the high half of a record's fingerprint."""
    return mix((name[4] + layers) & M64), mix((name[3] + layers) & M64)


def folded(low, high):
    return mix((low + mix(high)) & M64)


class Recording:
    def __init__(self, page, path):
        self.path, self.lines, self.seen = path, path.read_text().splitlines(), collections.Counter()
        words = collections.defaultdict(list)
        for line in self.lines:
            word, _, rest = line.partition(" ")
            words[word].append(rest)
        resolution, prior, free, most, policy = map(float, words["configuration"][0].split())
        names = b"".join(name.encode() + b"\0" for name in words["class"])
        configuration = struct.pack("<ddfHIfB", resolution, prior, free, len(words["class"]), crc32c(names), most, int(policy))
        public_keys = {int(robot): bytes.fromhex(key) for robot, key in map(str.split, words["public"])}
        key = bytes.fromhex(words["key"][0]) if words["key"] else None
        self.fleet = Fleet(key, words["mission"][0].encode() if key else None, configuration, len(words["class"]), public_keys)
        self.decoder = wire.Decoder(self.fleet, decode_block.table_of(page))
        self.robots, self.floors, self.stated, self.samples, self.latest = {}, {}, set(), {}, {}

    def fail(self, why):
        sys.exit(f"{self.path.name}: {why}")

    def read(self):
        for number, line in enumerate(self.lines, 1):
            word, *rest = line.split(" ")
            try:
                if word == "start":
                    self.robots[int(rest[0])] = {}
                    self.floors[int(rest[0])] = {}
                elif word == "datagram":
                    self.hear(bytes.fromhex(rest[0]), [int(robot) for robot in rest[1:]])
            except Refused as why:
                self.fail(f"line {number}: refused: {why}")
        return self

    def hear(self, data, heard_by):
        datagram = self.decoder.decode(data)
        if wire_encode.encode(self.fleet, datagram) != data:
            self.fail(f"a {wire.KINDS[datagram.kind - 1]} is written again in other bytes")
        wire.check(not datagram.wrong, datagram.wrong)
        self.samples.setdefault((datagram.kind, self.count(datagram)), data)
        self.check_sequence(datagram)
        self.check_claims(datagram)
        for robot in [datagram.sender, *heard_by]:
            self.take(robot, datagram)

    def check_sequence(self, datagram):
        control = datagram.kind in (wire.ANNOUNCEMENT, wire.REQUEST, wire.LEAVE, wire.DESCRIPTION, wire.PRESENCE)
        stream = datagram.sender, datagram.session, control
        if datagram.sequence != self.latest.get(stream, 0) + 1:
            self.fail(f"sequence {datagram.sequence} after {self.latest.get(stream, 0)}")
        self.latest[stream] = datagram.sequence

    def count(self, datagram):
        body, kind = datagram.body, wire.KINDS[datagram.kind - 1]
        seen = [kind]
        seen += [f"request of {wire.TYPES[one['type']]}" for one in body.get("wanted", [])]
        seen += ["answer" if kind else "question" for kind, _, _ in body.get("challenges", [])]
        seen += ["list" if span["kind"] == 128 else "parts" for span in body.get("spans", [])]
        seen += ["presence with an announcement"] if datagram.kind == wire.PRESENCE and "held" in body else []
        if datagram.kind == wire.CHUNK:
            seen += ["relayed chunk"] if body["flags"] & 1 else []
            seen += ["partial chunk"] if body["flags"] & 2 else []
            seen += [what for record in body["records"] for what in
                     ["record"] + ["later part"] * (record.part > 0) + ["empty record"] * (not record.code)
                     + ["objection"] * (body["name"][2] == wire.wire_objection.SUBMAP)
                     + [("link", "prior")[record.block == (0, 0, 1)]] * (body["name"][2] == wire.wire_frame_statement.SUBMAP)]
            seen += ["proof"] * sum(len(record.proof) > 0 for record in body["records"])
        if datagram.kind == wire.STATEMENT and datagram.sender != body["name"][0]:
            seen.append("relayed statement")
        if datagram.kind == wire.FRAME:
            seen += ["relayed frame"] if body["flags"] & 1 else []
            seen += ["frame beside another"] if len(body["frames"]) > 1 else []
            seen += ["matrix" if wire_frames.code_of(one["T"]) is None else "short code" for one in body["frames"]]
            seen += ["proof of a frame"] * sum(len(one["proof"]) > 0 for one in body["frames"])
        self.seen.update(seen)
        return frozenset(seen)

    def check_claims(self, datagram):
        """What the sender says of what it holds is what its replica is."""
        body, held = datagram.body, self.robots[datagram.sender]
        for name, latest, frame, flags, digest in body.get("held", []):
            if name[0] == datagram.sender:
                continue  # It holds what it has published, before it says it.
            if (frame, flags) == (0, 0):
                self.check_floor(datagram.sender, name)
                continue
            replica = held.get(name, Replica())
            if (replica.frame, folded(*replica.fingerprint()[1:])) != (frame, digest):
                self.fail(f"robot {datagram.sender} announces another content of {name}")
            if flags & 5 == 5 and (name, latest, replica.fingerprint()) not in self.stated:
                self.fail(f"robot {datagram.sender} holds of {name} what nobody stated")
            self.seen["announced contribution"] += 1
        if "stated" in body:
            self.stated.add((body["name"], body["stated"]["latest"], (body["stated"]["records"], *body["stated"]["fingerprint"])))
        for span in body.get("spans", []):
            self.check_span(span, held[body["name"]])

    def check_floor(self, robot, name):
        if name[1] != self.floors[robot].get(name[0], 0):
            self.fail(f"robot {robot} announces a floor of robot {name[0]} that nobody stated")
        self.seen["floor of another"] += 1

    def check_span(self, span, replica):
        first = (span["index"] << span["width"]) + 1
        last = first + (1 << span["width"]) - 1
        inside = [(name, layers) for name, layers in replica.live() if first <= name[0] <= last]
        if span["kind"] == 128:
            listed = [(name[0], name[3] >> 36 << 4 | layers) for name, layers in inside if name[0] <= span["to"]]
            if listed != [*zip(span["versions"], span["hashes"])]:
                self.fail(f"a list of {first} to {last} is not what its sender holds")
            return
        sums = [0] * len(span["sums"])
        for name, layers in inside:
            part = (name[0] - first) >> span["kind"]
            sums[part] = (sums[part] + mark(name, layers)[0]) & M64
        if sums != span["sums"]:
            self.fail(f"sums of {first} to {last} are not of what their sender holds")

    def take(self, robot, datagram):
        body, held = datagram.body, self.robots[robot]
        floors = self.floors[robot]
        if "epoch" in body:
            floors[datagram.sender] = max(floors.get(datagram.sender, 0), body["epoch"])
        if "stated" in body:
            floors[body["name"][0]] = max(floors.get(body["name"][0], 0), body["stated"]["floor"])
        for name in [name for name in held if name[1] < floors.get(name[0], 0)]:
            del held[name]
        for one in body.get("frames", []):
            if one["name"][1] >= floors.get(one["name"][0], 0):
                replica = held.setdefault(one["name"], Replica())
                replica.frame = max(replica.frame, one["revision"])
        if datagram.kind != wire.CHUNK or body["name"][1] < floors.get(body["name"][0], 0):
            return
        replica = held.setdefault(body["name"], Replica())
        for record in body["records"][:body["taken"]]:
            replica.add(record, self.fleet.leaf_of_record(body["name"], record))

    def compare(self):
        """With what the robots say that they hold in the end. Returns the number of contributions."""
        lines = [line.split(" ")[1:] for line in self.lines if line.startswith("holds ")]
        for robot, *name, records, digest, low, high, frame, blocks, passes, labels in lines:
            replica = self.robots[int(robot)].get(tuple(map(int, name)), Replica())
            wanted = (int(records), int(low, 16), int(high, 16)), int(digest, 16), int(frame), (int(blocks), int(passes), float(labels))
            found = replica.fingerprint(), folded(*replica.fingerprint()[1:]), replica.frame, replica.evidence(self.decoder.codes)
            if wanted != found:
                self.fail(f"robot {robot} holds of {name} {wanted}, not {found}")
        if not lines:
            self.fail("nothing is held")
        return len(lines)

    def damaged(self):
        """Of each kind: each byte changed and each length with the old tag, and what the page does not allow with a new one. Returns their number."""
        refused = 0
        for (kind, _), data in self.samples.items():
            for i in range(len(data)):
                changed = data[:i] + bytes([data[i] ^ 1 << i % 8]) + data[i + 1:]
                refused += self.refuses(changed, f"byte {i} of a {wire.KINDS[kind - 1]} changed")
                refused += self.refuses(data[:i], f"{i} bytes of a {wire.KINDS[kind - 1]}")
            for size in (0, 1, 31, len(data) - 17, len(data) - 15):
                body = (data[:-16] + b"\0")[:size]
                refused += self.refuses(body + self.fleet.tag(body), f"a {wire.KINDS[kind - 1]} of another length")
            for at, value in ((0, b"S"), (2, b"\1"), (3, b"\0"), (3, bytes([data[3] ^ 128])), (3, bytes([data[3] | 16])), (4, b"????"),
                              (8, b"????"), (24, bytes(8))):
                body = data[:at] + value + data[at + len(value):-16]
                refused += self.refuses(body + self.fleet.tag(body), f"another header of a {wire.KINDS[kind - 1]}")
            for what, bad in wire_encode.bad_bodies(self.decoder.decode(data)).items():
                refused += self.refuses(wire_encode.encode(self.fleet, bad), f"a {wire.KINDS[kind - 1]}: {what}")
            # Sender, session and sequence are signed in control messages alone, and a chunk's session.
            by_origin = kind in (wire.CHUNK, wire.FRAME, wire.STATEMENT, wire.CONFLICT)
            for i in range(4, len(data) - 16, 7) if self.fleet.signs else ():
                if not (by_origin and 12 <= i < 32):
                    body = data[:i] + bytes([data[i] ^ 1]) + data[i + 1:-16]
                    refused += self.refuses(body + self.fleet.tag(body), f"byte {i} of a signed {wire.KINDS[kind - 1]}")
        return refused

    def refuses(self, data, what):
        try:
            if self.decoder.decode(data).wrong:
                return 1
        except Refused:
            return 1
        return self.fail(f"not refused: {what}")


NEEDED = [*wire.KINDS, *(f"request of {name}" for name in wire.TYPES), "question", "answer", "list", "parts", "relayed chunk", "partial chunk",
          "record", "later part", "empty record", "objection", "link", "prior", "relayed frame", "frame beside another", "matrix", "short code", "relayed statement",
          "announced contribution", "presence with an announcement"]
NEEDED.remove("conflict")
SIGNED = ["proof", "proof of a frame", "conflict"]


def main():
    page = pathlib.Path(sys.argv[1]).read_text()
    for path in sys.argv[2:]:
        recording = Recording(page, pathlib.Path(path)).read()
        needed = NEEDED + SIGNED * recording.fleet.signs
        print(f"{recording.path.name}: " + ", ".join(f"{recording.seen[what]} {what}" for what in needed), flush=True)
        for what in needed:
            if not recording.seen[what]:
                recording.fail(f"no {what} occurred")
        print(f"  {recording.compare()} contributions are held as they are said to be; {recording.damaged()} damaged datagrams are refused")


if __name__ == "__main__":
    main()
