# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Datagrams of docs/reference/wire-format.md, decoded, from that page alone. Refused is raised for what it does not allow."""
import dataclasses
import struct

import decode_block
import wire_frame_statement
import wire_frames
import wire_objection
from wire_trust import Refused, check, crc32c

ANNOUNCEMENT, REQUEST, CHUNK, FRAME, LEAVE, STATEMENT, DESCRIPTION, CONFLICT, PRESENCE = range(1, 10)
KINDS = "announcement", "request", "chunk", "frame", "leave", "statement", "description", "conflict", "presence"
TYPES = "gaps", "versions", "descriptions"
GAPS, VERSIONS, DESCRIPTIONS = range(3)
LAST_VERSION = 2**32 - 2
CODE = "code of a block"


class Reader:
    def __init__(self, data, end):
        self.data, self.at, self.end = data, 0, end

    def more(self):
        return self.at < self.end

    def bytes(self, size):
        check(size <= self.end - self.at, "too short")
        self.at += size
        return self.data[self.at - size:self.at]

    def take(self, layout):
        values = struct.unpack("<" + layout, self.bytes(struct.calcsize("<" + layout)))
        return values if len(values) > 1 else values[0]

    def u8(self):
        return self.take("B")

    def name(self):
        return self.take("3I")

    def version_range(self):
        first, last = self.take("2I")
        check(1 <= first <= last <= LAST_VERSION, "range of versions")
        return first, last

    def varint(self, most=2**32 - 1):
        value, shift, byte = 0, 0, 128
        while byte & 128:
            byte = self.u8()
            value |= (byte & 127) << shift
            shift += 7
            check(shift <= 35, "long varint")
        check(byte or shift == 7, "varint with more bytes than it needs")
        check(value <= most, "varint's value")
        return value

    def zigzag(self):
        value = self.varint()
        return value >> 1 ^ -(value & 1)

    def ascending(self, number, most):
        values, last = [], -1
        for _ in range(number):
            last += 1 + self.varint()
            values.append(last)
        check(last <= most, "ascending numbers")
        return values


@dataclasses.dataclass
class Record:
    version: int
    part: int
    layers: int
    block: tuple
    code: bytes
    proof: bytes = b""


@dataclasses.dataclass
class Datagram:
    kind: int
    configuration: int
    sender: int
    session: int
    sequence: int
    body: dict
    signature: bytes = b""
    wrong: str = ""  # Why records from some record on are none.


class Decoder:
    def __init__(self, fleet, table):
        self.fleet, self.table, self.codes = fleet, table, {}
        self.bodies = (None, self.announcement, self.request, self.chunk, self.frame, lambda _, r: {}, self.statement, self.description,
                       self.conflict, self.presence)

    def decode(self, data):
        check(48 <= len(data) <= 1392, "size")
        check(self.fleet.tag(data[:-16]) == data[-16:], "tag")
        letters, version, kind, mission, configuration, *sent = struct.unpack_from("<2sBB4sIIQQ", data)
        check(letters == b"TS" and version == 2, "format")
        check(mission == (self.fleet.mission_value[:4]), "mission")
        check(bool(kind & 128) == self.fleet.signs, "signatures or none")
        check(1 <= kind & 127 <= 9, "kind")
        check(configuration == crc32c(self.fleet.configuration), "configuration")
        check(sent[2] >= 1, "sequence")
        out = Datagram(kind & 127, configuration, *sent, {})
        flags_at = {CHUNK: 52, FRAME: 32}.get(out.kind)
        relayed = flags_at and len(data) > flags_at and data[flags_at] & 1
        signed = self.fleet.signs and out.kind not in (STATEMENT, CONFLICT) and not relayed
        end = len(data) - 16 - (64 if signed else 0)
        check(end >= 32, "no signature")
        out.signature = data[end:-16]
        reader = Reader(data, end)
        reader.at = 32
        out.body = self.bodies[out.kind](out, reader)
        check(not reader.more(), "bytes after the body")
        if signed:
            self.check_signature(out, data, end)
        return out

    def check_signature(self, out, data, end):
        if out.kind == CHUNK:
            name, statement = out.body["name"], data[32:52] + data[53:89] + struct.pack("<Q", out.session)
            leaves = [self.fleet.leaf_of_record(name, record) for record in out.body["records"]] + [self.fleet.leaf_of_statement(statement)]
            check(len(leaves) <= 16, "leaves")
            self.fleet.check_tree(CHUNK, name, leaves, out.signature)
        elif out.kind == FRAME:
            self.fleet.check_tree(FRAME, (out.sender, 0, 0), [leaf for _, leaf in out.body["leaves"]], out.signature)
        else:
            self.fleet.check_signature(out.sender, data[:end], out.signature)

    def announcement(self, out, r):
        body = {"configuration": r.bytes(31), "epoch": r.take("I"), "data": r.take("Q")}
        check(body["configuration"] == self.fleet.configuration, "configuration of an announcement")
        number = r.u8()
        check(number <= 4, "challenges")
        body["challenges"] = [r.take("BIQ") for _ in range(number)]
        check(all(kind <= 1 for kind, _, _ in body["challenges"]), "kind of a challenge")
        body["held"] = []
        while r.more():
            body["held"].append((r.name(), *r.take("IIBQ")))
            check(body["held"][-1][3] <= 15, "flags of a contribution")
        return body

    def presence(self, out, r):
        place = dict(zip(("flags", "age", "low_stamp", "high_stamp", "x", "y", "z"), r.take("BBIH3i")))
        place["rotation"], place["box"] = r.take("3H"), r.take("6b")
        parts = [(word & 32767) - 32768 * (word >> 14 & 1) for word in place["rotation"]]
        check(place["rotation"][2] < 32768 and all(abs(part) <= 11586 for part in parts), "rotation of a presence")
        check(1 - sum(part * part for part in parts) / 2**28 >= 0.2499, "rotation of a presence")
        return {"place": place, **(self.announcement(out, r) if r.more() else {})}

    def request(self, out, r):
        wanted = []
        while r.more():
            name, frame, kind = r.name(), r.take("I"), r.u8()
            check(kind & 127 <= 2, "type of a request")
            one = {"name": name, "frame": frame, "type": kind & 127, "stated": r.take("I") if kind & 128 else None}
            number = r.u8()
            check(number <= (32 if one["type"] == GAPS else 128), "number of what is asked for")
            if one["type"] == GAPS:
                one["gaps"] = [r.version_range() for _ in range(number)]
                check(all(a[1] < b[0] for a, b in zip(one["gaps"], one["gaps"][1:])), "order of gaps")
            else:
                one["asked"] = r.take("I")
                one["width"] = r.u8() if one["type"] == DESCRIPTIONS else 0
                check(one["width"] <= 32, "width")
                one["numbers"] = r.ascending(number, LAST_VERSION if one["type"] == VERSIONS else (2**32 >> one["width"]) - 1)
                check(one["type"] == DESCRIPTIONS or not number or one["numbers"][0] >= 1, "version")
            wanted.append(one)
        return {"wanted": wanted}

    @staticmethod
    def stated(name, r):
        latest, records, low, high, frame, floor, sessions = r.take("IIQQIII")
        check(latest <= LAST_VERSION and frame >= 1 and max(floor, sessions) <= name[1], "what is stated")
        return {"latest": latest, "records": records, "fingerprint": (low, high), "frame": frame, "floor": floor, "session_floor": sessions}

    def chunk(self, out, r):
        body = {"name": r.name(), "range": r.version_range(), "flags": r.u8(), "records": [], "taken": 0}
        check(body["flags"] <= 3, "flags of a chunk")
        relayed = body["flags"] & 1
        if not relayed:
            check(out.sender == body["name"][0], "a chunk of another robot")
            body["stated"] = self.stated(body["name"], r)
            check(body["range"][1] <= body["stated"]["latest"], "range of what was not published")
        before = body["range"][0] - 1, (0, 0, 0)
        while r.more():
            try:
                record = self.record(body, before, r)
                before = record.version, record.block
                self.check_code(body["name"], record)
            except Refused as why:
                # The tree of a chunk that is signed as a whole has all of its records.
                check(not self.fleet.signs or relayed or why.args[0] == CODE, why.args[0])
                out.wrong = out.wrong or why.args[0]
                if not self.fleet.signs or relayed:
                    r.at = r.end
                    break
            body["records"].append(record)
            body["taken"] += not out.wrong
        return body

    def record(self, body, before, r):
        layers = r.u8()
        check(layers & 15 and layers < 64, "layers")
        version = before[0] + 1 + r.varint()
        check(version <= body["range"][1] and version - (layers >> 4) >= 1, "version of a record")
        block = tuple(c + r.zigzag() for c in before[1])
        check(all(-2**20 <= c < 2**20 for c in block), "block")
        record = Record(version, layers >> 4, layers & 15, block, r.bytes(r.varint(1171)))
        if body["flags"] & 1 and self.fleet.signs:
            record.proof = self.fleet.check_proof(CHUNK, body["name"], self.fleet.leaf_of_record(body["name"], record), r)
        return record

    def check_code(self, name, record):
        key = record.layers, record.code
        if name[2] == wire_objection.SUBMAP:
            self.codes[key] = wire_objection.Objection(record, CODE)
        elif name[2] == wire_frame_statement.SUBMAP:
            self.codes[key] = wire_frame_statement.FrameStatement(name, record, CODE)
        elif record.code and key not in self.codes:
            try:
                self.codes[key] = decode_block.Block(record.code, record.layers, self.fleet.num_classes + 2, self.table)
            except decode_block.Corrupt:
                raise Refused(CODE) from None

    def frame(self, out, r):
        body = {"flags": r.u8(), "robot": r.take("I"), "frames": [], "leaves": []}
        check(body["flags"] <= 1, "flags of frames")
        check(body["flags"] or out.sender == body["robot"], "frames of another robot")
        before = 0, 0, 0
        while r.more():
            check(len(body["frames"]) < 16, "frames")
            one = wire_frames.read(body["robot"], before, r, struct.unpack_from("<d", self.fleet.configuration)[0])
            before = *one["name"][1:], one["revision"]
            leaf = self.fleet.leaf_of_frame(wire_frames.alone(one))
            one["proof"] = self.fleet.check_proof(FRAME, (body["robot"], 0, 0), leaf, r) if body["flags"] and self.fleet.signs else b""
            body["frames"].append(one)
            body["leaves"].append((one["name"], leaf))
        check(body["frames"], "no frame")
        return body

    def statement(self, out, r):
        begin = r.at
        body = {"name": r.name(), "range": r.version_range()}
        body["stated"] = self.stated(body["name"], r)
        body["session"] = r.take("Q")
        leaf = self.fleet.leaf_of_statement(r.data[begin:r.at])
        body["proof"] = self.fleet.check_proof(CHUNK, body["name"], leaf, r) if self.fleet.signs else b""
        return body

    def conflict(self, out, r):
        check(self.fleet.signs, "a conflict in a fleet that does not sign")
        body = {"name": r.name(), "kind": r.u8(), "sides": []}
        check(body["kind"] <= 1, "kind of a conflict")
        for _ in range(2):
            begin = r.at
            if body["kind"]:
                check(r.name() == body["name"], "statement of another contribution")
                r.version_range()
                what = self.stated(body["name"], r), r.take("Q")
                leaf = self.fleet.leaf_of_statement(r.data[begin:r.at])
            else:
                what = r.take("2IB3i"), r.bytes(16)
                leaf = self.fleet.leaf_of_facts(body["name"], r.data[begin:r.at])
            body["sides"].append((r.data[begin:r.at], what, self.fleet.check_proof(CHUNK, body["name"], leaf, r)))
        a, b = (what for _, what, _ in body["sides"])
        if body["kind"]:
            check(a[0]["latest"] == b[0]["latest"], "statements of two moments")
            check(any(a[0][of] != b[0][of] for of in ("records", "fingerprint")), "statements that agree")
        else:
            check(a[0][0] == b[0][0] and a != b, "records that do not contradict")
        return body

    def description(self, out, r):
        body = {"name": r.name(), "to": r.take("I"), "spans": []}
        while r.more():
            width, index, kind, number = r.take("BIBB")
            check(width <= 32 and (index + 1) << width <= 2**32, "span")
            span = {"width": width, "index": index, "kind": kind}
            if kind == 128:
                check(number <= 135, "records of a list")
                span["to"] = r.take("I")
                span["versions"] = [(index << width) + 1 + offset for offset in r.ascending(number, (1 << width) - 1)]
                span["hashes"] = [r.take("I") for _ in range(number)]
            else:
                check(kind < width <= kind + 6 and number == 1 << width - kind, "parts of a span")
                span["sums"] = [r.take("Q") for _ in range(number)]
            body["spans"].append(span)
        return body
