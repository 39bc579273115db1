# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What an attacker sends. Each attack is a function that gives datagrams, once through; its first line says what it does. All work
for every degree of trust: what the attacker cannot tag or sign has tags and signatures that are made up."""
import dataclasses
import itertools
import struct

from attacker import MEMBER, wire, wire_encode

LAST = wire.LAST_VERSION
HIGHEST = 2**32 - 1
NOBODY = 77_000  # Numbers of robots that do not exist begin here.
UNMOVED = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
MOST_SENT = 300  # Datagrams of one attack in one go, of those that have one for each that was heard.


def some(a, all_of_it, number=MOST_SENT):
    all_of_it = list(all_of_it)
    return all_of_it if len(all_of_it) <= number else a.random.sample(all_of_it, number)


def senders(a, name):
    """In whose name something of a contribution is said: its robot's, one that does not exist, one's own."""
    return [name[0], NOBODY] + ([a.member] if a.member is not None else [])


def lower(a, name, record, codes):
    """The record with another content, and of many a low hash: of two contents of one version the lower one counts."""
    others = [dataclasses.replace(record, code=code) for code in {*codes, b""} if code != record.code]
    return min(others, key=lambda other: struct.unpack("<QQ", a.fleet.leaf_of_record(name, other)), default=None)


def codes_of(contribution):
    """Of the records that have all layers, as any code must be of the layers that it is used for."""
    return [record.code for record in contribution.records.values() if record.layers == 15]


def forged_statements(a):
    """Statements of honest robots' contributions with more versions, fewer, none, or another fingerprint."""
    for name, known in a.honest():
        true = known.stated
        for change in ({"latest": min(LAST, true["latest"] + 1000)}, {"latest": min(LAST, true["latest"] + 1), "records": true["records"] + 1},
                       {"latest": max(0, true["latest"] - 1), "records": 1}, {"latest": 0, "records": 0, "fingerprint": (0, 0)},
                       {"fingerprint": (1, 1)}, {"latest": LAST}, {"frame": HIGHEST}):
            for sender in senders(a, name):
                yield a.statement(sender, name, {**true, **change})


def forged_records(a):
    """Other contents of versions that honest robots published, chosen to win, and versions that they did not publish."""
    for name, known in a.honest():
        codes = codes_of(known)
        for record in some(a, known.records.values(), 60):
            other = lower(a, name, record, codes) if record.layers == 15 else dataclasses.replace(record, code=b"")
            if other is None or other.code == record.code:
                continue
            for sender in senders(a, name):
                yield a.chunk(sender, name, (other.version, other.version), [dataclasses.replace(other)])
            yield a.chunk(name[0], name, (other.version, other.version), [other], relayed=False, stated=known.stated)
        latest = known.stated["latest"]
        for ahead in (1, 2, 3, 1000, LAST - latest):
            if not 0 < ahead <= LAST - latest:
                continue
            record = dataclasses.replace(a.random.choice([*known.records.values()]), version=latest + ahead, part=0)
            yield a.chunk(name[0], name, (record.version, record.version), [record], relayed=False,
                          stated={**known.stated, "latest": record.version})
            yield a.chunk(NOBODY, name, (record.version, record.version), [dataclasses.replace(record)])


def unsigned_ranges(a):
    """Chunks of no records, which say that there is nothing more in their range."""
    for name, known in a.honest():
        latest = max(1, known.stated["latest"])
        # What was heard last may itself be forged, with the last version that there can be.
        for versions in ((1, latest), (1, LAST), (latest, latest), (max(1, latest - 5), min(LAST, latest + 50))):
            for sender in senders(a, name):
                yield a.chunk(sender, name, versions)
            yield a.chunk(name[0], name, versions, relayed=False, stated={**known.stated, "latest": max(versions[1], latest)})


def earlier_session(a):
    """What was recorded of an earlier session of one of the robots."""
    yield from some(a, a.earlier)


def other_mission(a):
    """What was recorded of the same robots with the same key in another mission."""
    yield from some(a, a.other_mission)


def replay_now(a):
    """What the same processes said before, again."""
    yield from some(a, list(a.heard))


def forged_announcements(a):
    """Announcements in honest robots' names: later versions, other digests, frames that nobody has, complete or not."""
    for name, known in a.honest():
        latest = known.stated["latest"]
        for of, frame, flags in ((latest, 1, 7), (latest, 1, 4), (min(LAST, latest + 1), 1, 7), (LAST, 1, 6), (0, 1, 7), (latest, HIGHEST, 7)):
            for sender in senders(a, name):
                yield a.announcement(sender, [(name, of, frame, flags, a.random.getrandbits(64))], epoch=name[1])


def requests(a):
    """Requests for everything of everybody: gaps over all versions, single versions, descriptions, frames."""
    for name, known in a.honest():
        one = {"name": name, "frame": 0, "stated": None}
        versions = sorted(some(a, range(1, min(5000, known.stated["latest"]) + 1), 100))
        wanted = [{**one, "type": wire.GAPS, "gaps": [(1, LAST)]},
                  {**one, "type": wire.VERSIONS, "asked": name[0], "numbers": versions},
                  {**one, "type": wire.DESCRIPTIONS, "asked": name[0], "width": 32, "numbers": [0]},
                  {**one, "type": wire.DESCRIPTIONS, "asked": name[0], "width": 6, "numbers": [*range(100)]}]
        for sender in senders(a, name):
            for request in wanted:
                yield a.request(sender, [request])


def restarts(a):
    """A robot, the attacker's own or one that does not exist, that has restarted 100 times and published in each epoch."""
    robot = a.member if a.trust == MEMBER else NOBODY + 1
    for epoch in range(1, 101):
        name, session = (robot, epoch, 0), epoch << 32
        records = [wire.Record(1, 0, 15, (epoch, 0, 0), b"")]
        yield a.announcement(robot, [(name, 1, 1, 7, 0)], session=session)
        yield a.frame(robot, name, 1, UNMOVED, session=session)
        yield a.chunk(robot, name, (1, 1), records, relayed=False, stated=a.state_of(name, records), session=session)


def robots_of_nobody(a):
    """Robots that do not exist, each with a name, a frame, a statement and a record."""
    for robot in range(NOBODY + 10, NOBODY + 140):
        name = robot, 1, 0
        records = [wire.Record(1, 0, 15, (0, 0, robot - NOBODY), b"")]
        yield a.announcement(robot, [((robot + 1000 * i, 1, 0), 9, 1, 7, i) for i in range(20)])
        yield a.frame(robot, name, 1, UNMOVED)
        yield a.chunk(robot, name, (1, 1), records, relayed=False, stated=a.state_of(name, records))
        yield a.statement(robot, name, a.state_of(name, records))


def leaves(a):
    """Honest robots say that they are gone."""
    for robot in sorted({name[0] for name, _ in a.honest()}):
        yield a.datagram(wire.LEAVE, robot, {})
        yield a.datagram(wire.LEAVE, robot, {}, session=HIGHEST << 32)


def frames(a):
    """Frames of honest robots' contributions: later revisions, far away, upside down, and ones that are none; extents of no block, of a place
    where the contribution is not, of the whole world, and ones that are none."""
    extents = itertools.cycle([None, (4000, 4000, 0, 4001, 4001, 1), (-2**20,) * 3 + (2**20 - 1,) * 3, (0,) * 3 + (2**32 - 1, 0, 0), (-2**31,) * 6])
    turned = (-1.0, 0.0, 0.0, 5.0, 0.0, -1.0, 0.0, -3.0, 0.0, 0.0, 1.0, 1.0)
    absurd = [(float("nan"), *UNMOVED[1:]), (*UNMOVED[:3], 1e308, *UNMOVED[4:]), (-1.0, *UNMOVED[1:]), (0.0,) * 12,
              (*UNMOVED[:3], 1e5, *UNMOVED[4:]), (*UNMOVED[:3], float("inf"), *UNMOVED[4:])]
    for name, known in a.honest():
        revision = min(known.stated["frame"], HIGHEST - 3)
        for later, T in [(revision + 1, turned), (revision + 2, UNMOVED), (HIGHEST, turned), *((revision + 3, T) for T in absurd)]:
            for sender in senders(a, name):
                yield a.frame(sender, name, later, T, next(extents))


def floors(a):
    """Announcements and statements by which epochs of honest robots count no more."""
    for name, known in a.honest():
        for epoch in sorted({min(HIGHEST, name[1] + ahead) for ahead in (1, 1000, HIGHEST - 1, HIGHEST)}):
            later = (name[0], epoch, 0)
            for session in (None, 1000 << 32):
                yield a.announcement(name[0], [(later, 1, 1, 7, 0)], epoch=epoch, session=session)
                yield a.statement(name[0], later, {**known.stated, "floor": epoch}, session=session or a.sessions[name[0]])
                yield a.statement(name[0], later, {**known.stated, "session_floor": epoch}, session=session or a.sessions[name[0]])
                yield a.frame(name[0], later, 1, UNMOVED, session=session)


def floor_claims(a):
    """Honest robots are told of later epochs of theirs than the ones that they publish in."""
    for name, known in a.honest():
        for ahead in (1, 1000, 2**16, 2**17, HIGHEST):
            claimed = (name[0], min(HIGHEST, name[1] + ahead), 0), 0, 0, 0, 0
            for sender in [NOBODY] + ([a.member] if a.member is not None else []):
                yield a.announcement(sender, [claimed])


def starts(a):
    """A robot, the attacker's own or one that does not exist, that starts again and again and asks for everything each time."""
    robot = a.member if a.trust == MEMBER else NOBODY + 3
    for start in range(1, 20):
        for name, known in a.honest():
            wanted = [{"name": name, "frame": 0, "stated": None, "type": wire.GAPS, "gaps": [(1, LAST)]}]
            yield a.announcement(robot, session=start << 32)
            yield a.request(robot, wanted, session=start << 32)


def last_sessions(a):
    """Honest robots' numbers with the last session and the last sequence that there can be, and answers to challenges."""
    last = 2**64 - 1
    for robot in sorted({name[0] for name, _ in a.honest()}):
        for session, sequence in ((last, 1), (last, last), (a.sessions[robot], last), (a.sessions[robot] + 1, 1), (HIGHEST << 32, 5)):
            answers = [(kind, other, a.random.getrandbits(64)) for kind in (0, 1) for other in range(2)]
            yield a.announcement(robot, session=session, sequence=sequence, challenges=answers)
            yield a.datagram(wire.LEAVE, robot, {}, session=session, sequence=sequence)


def impostor(a):
    """Another process that speaks as an honest robot, with its session and in its epoch, and maps on."""
    for name, known in a.honest():
        latest, codes = known.stated["latest"], codes_of(known)
        for ahead in range(1, min(20, LAST - latest)):
            record = wire.Record(latest + ahead, 0, 15, (50 + ahead, 50, 0), a.random.choice(codes) if codes else b"")
            stated = {**known.stated, "latest": record.version, "records": known.stated["records"] + ahead}
            for session in (a.sessions[name[0]], a.sessions[name[0]] + 1):
                yield a.chunk(name[0], name, (record.version, record.version), [record], relayed=False, stated=stated, session=session)
            yield a.announcement(name[0], [(name, record.version, 1, 7, a.random.getrandbits(64))], epoch=name[1])


def conflicts(a):
    """Proofs that robots signed two contents of one version, or two statements, which they did not: the proofs are made up, or true
    ones of other things."""
    for name, known in a.honest():
        records = some(a, [record for record in known.records.values() if record.proof], 10)
        for record, other in zip(records, records[1:]):
            forged = dataclasses.replace(record, code=b"x")
            leaf = a.fleet.leaf_of_record(name, forged)
            for second, proof in ((forged, record.proof), (other, other.proof), (forged, a.prove(name, leaf))):
                sides = (a.fleet.facts_of(record), record.proof), (a.fleet.facts_of(second), proof)
                for sender in senders(a, name):
                    yield a.conflict(sender, name, 0, sides)
        said = [wire_encode.statement_bytes(name, (1, 1), {**known.stated, "records": known.stated["records"] + i}, a.sessions[name[0]])
                for i in range(2)]
        yield a.conflict(NOBODY, name, 1, [(what, a.prove(name, a.fleet.leaf_of_statement(what))) for what in said])


def damaged(a):
    """What was heard, cut short, with bits changed, or with other bytes, under the old tag and under a new one."""
    for data in some(a, list(a.heard), 150):
        body = bytearray(data[:-16])
        for _ in range(a.random.randint(1, 8)):
            body[a.random.randrange(len(body))] ^= 1 << a.random.randrange(8)
        cut = data[:a.random.randrange(len(data))]
        for payload in (bytes(body), cut, data[:-16] + b"\0"):
            yield payload + data[-16:]
            yield payload
            yield payload + a.fleet.tag(payload)


def two_faces(a):
    """Two contents of the same versions of the attacker's contribution, each said to one half of the robots alone."""
    robot = a.member if a.trust == MEMBER else NOBODY + 2
    name = robot, 500, 0
    # Short ones, as all of a chunk must fit.
    codes = sorted((code for _, known in a.honest() for code in codes_of(known)), key=len)[:40] or [b""]
    for i, mac in enumerate(a.macs):
        records = [wire.Record(version, 0, 15, (version, 90, 0), codes[(version + i % 2) % len(codes)]) for version in range(1, 9)]
        yield mac, a.frame(robot, name, 1, UNMOVED, session=500 << 32)
        yield mac, a.chunk(robot, name, (1, 8), records, relayed=False, stated=a.state_of(name, records), session=500 << 32)


ATTACKS = (forged_statements, forged_records, unsigned_ranges, earlier_session, other_mission, replay_now, forged_announcements, requests,
           restarts, robots_of_nobody, leaves, frames, floors, floor_claims, starts, last_sessions, impostor, conflicts, damaged, two_faces)


def mixed(a):
    """All of them at once, in turns."""
    running = [attack(a) for attack in ATTACKS]
    while running:
        for attack in list(running):
            payload = next(attack, None)
            if payload is None:
                running.remove(attack)
            else:
                yield payload


def title(attack):
    return attack.__name__.replace("_", " ")

