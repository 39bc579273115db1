# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Writes datagrams that wire_datagram.py has read, by docs/reference/wire-format.md: to see that they have one form, and to make bad ones."""
import copy
import struct

import wire_frames
from wire_frames import varint, zigzag
from wire_datagram import ANNOUNCEMENT, CHUNK, CONFLICT, DESCRIPTION, DESCRIPTIONS, FRAME, GAPS, PRESENCE, REQUEST, STATEMENT, VERSIONS


def ascending(values):
    return b"".join(varint(value - before - 1) for before, value in zip([-1, *values], values))


def stated_bytes(s):
    return struct.pack("<IIQQIII", s["latest"], s["records"], *s["fingerprint"], s["frame"], s["floor"], s["session_floor"])


def statement_bytes(name, versions, stated, session):
    return struct.pack("<3I2I", *name, *versions) + stated_bytes(stated) + struct.pack("<Q", session)


def body_bytes(kind, b):
    name = struct.pack("<3I", *b["name"]) if "name" in b else b""
    if kind == PRESENCE:
        place = b["place"]
        scalars = [place[key] for key in ("flags", "age", "low_stamp", "high_stamp", "x", "y", "z")]
        out = struct.pack("<BBIH3i3H6b", *scalars, *place["rotation"], *place["box"])
        return out + (body_bytes(ANNOUNCEMENT, b) if "held" in b else b"")
    if kind == ANNOUNCEMENT:
        return b"".join([b["configuration"], struct.pack("<IQB", b["epoch"], b["data"], len(b["challenges"])),
                         *(struct.pack("<BIQ", *challenge) for challenge in b["challenges"]),
                         *(struct.pack("<3IIIBQ", *held[0], *held[1:]) for held in b["held"])])
    if kind == REQUEST:
        out = b""
        for one in b["wanted"]:
            states = one["stated"] is not None
            out += struct.pack("<3IIB", *one["name"], one["frame"], one["type"] + 128 * states)
            out += struct.pack("<I", one["stated"]) if states else b""
            if one["type"] == GAPS:
                out += bytes([len(one["gaps"])]) + b"".join(struct.pack("<II", *gap) for gap in one["gaps"])
            else:
                out += struct.pack("<BI", len(one["numbers"]), one["asked"])
                out += bytes([one["width"]] if one["type"] == DESCRIPTIONS else []) + ascending(one["numbers"])
        return out
    if kind == CHUNK:
        out = name + struct.pack("<IIB", *b["range"], b["flags"]) + (b"" if b["flags"] & 1 else stated_bytes(b["stated"]))
        version, block = b["range"][0] - 1, (0, 0, 0)
        for record in b["records"]:
            out += bytes([record.layers + 16 * record.part]) + varint(record.version - version - 1)
            out += b"".join(zigzag(c - before) for c, before in zip(record.block, block))
            out += varint(len(record.code)) + record.code + record.proof
            version, block = record.version, record.block
        return out
    if kind == FRAME:
        return wire_frames.body_bytes(b)
    if kind == STATEMENT:
        return statement_bytes(b["name"], b["range"], b["stated"], b["session"]) + b["proof"]
    if kind == CONFLICT:
        return name + bytes([b["kind"]]) + b"".join(said + proof for said, _, proof in b["sides"])
    out = name + (struct.pack("<I", b["to"]) if kind == DESCRIPTION else b"")
    for span in b.get("spans", []):
        values = span["hashes"] if span["kind"] == 128 else span["sums"]
        out += struct.pack("<BIBB", span["width"], span["index"], span["kind"], len(values))
        if span["kind"] == 128:
            first = (span["index"] << span["width"]) + 1
            out += struct.pack("<I", span["to"]) + ascending([version - first for version in span["versions"]])
        out += struct.pack(f"<{len(values)}{'I' if span['kind'] == 128 else 'Q'}", *values)
    return out


def encode(fleet, d):
    """The bytes of a datagram, with the signature that it came with."""
    data = struct.pack("<2sBB4sIIQQ", b"TS", 2, d.kind + 128 * fleet.signs, fleet.mission_value[:4], d.configuration, d.sender, d.session,
                       d.sequence) + body_bytes(d.kind, d.body) + d.signature
    return data + fleet.tag(data)


def bad_bodies(good):
    """Datagrams that differ from a good one in one thing that the page does not allow, and what that is."""
    def changed(change):
        bad = copy.deepcopy(good)
        change(bad.body)
        return bad

    def of_first(what, **values):
        return lambda body: body[what][0].update(values)

    def of_record(**values):
        return lambda body: vars(body["records"][0]).update(values)

    def of_stated(**values):
        return lambda body: body["stated"].update(values)

    body, changes = good.body, {}
    if good.kind == PRESENCE:
        for what, rotation in {"part": (11587, 0, 0), "fifth part": (0, 0, 32768), "length": (11586, 11586, 0)}.items():
            changes["rotation: " + what] = lambda b, rotation=rotation: b["place"].update(rotation=rotation)
    if good.kind == ANNOUNCEMENT or "held" in body:
        changes["configuration"] = lambda b: b.update(configuration=bytes(31))
        changes["kind of challenge"] = lambda b: b.update(challenges=[(2, 1, 1)])
        changes["five challenges"] = lambda b: b.update(challenges=[(0, 1, 1)] * 5)
        changes["flags"] = lambda b: b.update(held=[((0, 0, 0), 1, 1, 16, 0)])
    if good.kind == REQUEST:
        kind = body["wanted"][0]["type"]
        if kind == GAPS:
            for name, gaps in {"reversed": [(3, 2)], "none": [(0, 2)], "overlap": [(1, 5), (5, 6)], "33": [(n, n) for n in range(1, 34)]}.items():
                changes["gaps: " + name] = of_first("wanted", gaps=gaps)
        else:
            changes["129 numbers"] = of_first("wanted", numbers=[*range(1, 130)])
        if kind == VERSIONS:
            changes["version 0"] = of_first("wanted", numbers=[0, 1])
            changes["version 2^32 - 1"] = of_first("wanted", numbers=[2**32 - 1])
        if kind == DESCRIPTIONS:
            changes["width"] = of_first("wanted", width=33)
            changes["index"] = of_first("wanted", width=31, numbers=[2])
    if good.kind == CHUNK:
        first, last = body["range"]
        changes["flags"] = lambda b: b.update(flags=b["flags"] | 4)
        changes["range"] = lambda b: b.update(range=(last + 1, last), records=[])
        changes["version 0"] = lambda b: b.update(range=(0, last))
        if not body["flags"] & 1:
            changes["another robot's"] = lambda b: b.update(name=(good.sender + 1, *b["name"][1:]))
            changes["above the latest"] = of_stated(latest=last - 1)
        if body["records"]:
            changes["no layers"] = of_record(layers=0)
            changes["bits of layers"] = of_record(layers=15, part=4)
            changes["first of the parts"] = lambda b: (b.update(range=(1, last)), of_record(version=1, part=1)(b))
            if first < body["records"][-1].version:
                changes["above the range"] = lambda b: b.update(range=(first, b["records"][-1].version - 1))
            changes["block"] = of_record(block=(2**20, 0, 0))
            changes["long code"] = of_record(code=bytes(1172))
            changes["code"] = of_record(code=b"\xff\xff\xff\xff")
    if good.kind == FRAME:
        one = body["frames"][0]
        changes["flags"] = lambda b: b.update(flags=b["flags"] | 2)
        changes["revision"] = of_first("frames", revision=0)
        changes["no frame"] = lambda b: b.update(frames=[])
        changes["17 frames"] = lambda b: b.update(frames=b["frames"][:1] * 17)
        changes["extent"] = of_first("frames", extent=(0, 0, 0, 0, 0, 2**20))
        for what, at, value in (("no number", 3, float("nan")), ("scale", 0, 1.001), ("shear", 2, 0.01), ("far", 3, 2.0**20)):
            changes[what] = of_first("frames", T=(*one["T"][:at], value, *one["T"][at + 1:]))
        changes["mirrored"] = of_first("frames", T=(-1.0, *one["T"][1:]))
        if not body["flags"]:
            changes["another robot's"] = lambda b: b.update(robot=b["robot"] + 1)
    if "stated" in body:
        changes["floor"] = of_stated(floor=body["name"][1] + 1)
        changes["no frame"] = of_stated(frame=0)
        changes["latest"] = of_stated(latest=2**32 - 1)
    if good.kind == CONFLICT:
        changes["kind"] = lambda b: b.update(kind=2)
        changes["the same twice"] = lambda b: b.update(sides=b["sides"][:1] * 2)
    if good.kind == DESCRIPTION:
        changes["width"] = of_first("spans", width=33, versions=[], hashes=[])
        changes["index"] = of_first("spans", width=31, index=2, versions=[], hashes=[])
        if body["spans"][0]["kind"] == 128:
            changes["136 records"] = of_first("spans", width=32, index=0, versions=[*range(1, 137)], hashes=[0] * 136)
        else:
            changes["parts"] = of_first("spans", kind=body["spans"][0]["width"])
            changes["number of parts"] = of_first("spans", sums=body["spans"][0]["sums"][1:])
    return {what: changed(change) for what, change in changes.items()}
