# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""One who joins a fleet's network, hears what is said there, and says what it likes, by docs/reference/wire-format.md alone. How much of
it is believed depends on what it has: no key, the fleet's key, or a member's signing key beside it."""
import collections
import ctypes
import os
import pathlib
import random
import socket
import struct
import sys
import threading
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "wire"))
import wire_datagram as wire
import wire_encode
import wire_frames
import wire_trust
from decode_datagram import Replica
from signing import keys_of, sign

GROUP = "239.255.76.67", 7667
CHANNEL = b"TESSERA\0"
NO_KEY, FLEET_KEY, MEMBER = DEGREES = "no key", "fleet's key", "member"
CLONE_NEWNET = 0x40000000
# Received datagrams that are kept; recordings of one test have some thousands.
MOST_HEARD = 50_000


def inside(network, host, make):
    """What make gives in the network namespace of a host: a socket stays in the one that it was made in."""
    made = []

    def run():
        with open(f"/run/netns/{network.name(host)}", encoding="ascii") as namespace:
            libc = ctypes.CDLL(None, use_errno=True)
            if libc.setns(namespace.fileno(), CLONE_NEWNET) != 0:
                made.append(OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno())))
                return
        made.append(make())

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    if isinstance(made[0], OSError):
        raise made[0]
    return made[0]


def end_listening(opened, listener):
    """Closes a socket that a thread waits for."""
    try:
        opened.shutdown(socket.SHUT_RDWR)
    except OSError:
        pass
    listener.join(5)
    opened.close()


def payloads(opened, channel):
    """What comes on an LCM channel, until the socket is shut down."""
    while True:
        try:
            data = opened.recv(2048)
        except OSError:
            return
        if not data:
            return
        if data[:4] == b"LC02" and data[8:8 + len(channel)] == channel:
            yield data[8 + len(channel):]


class Ear(wire.Decoder):
    """Reads without a key: nothing is encrypted, and what is sent was checked by the one who sent it."""

    def decode(self, data):
        self.fleet.tag = lambda _: data[-16:]
        self.fleet.check_signature = lambda *_: None
        return super().decode(data)

    def check_code(self, name, record):
        pass


class Contribution:
    """What was heard of one."""

    def __init__(self):
        self.records, self.stated, self.frame, self.session = {}, None, None, 0


class Attacker:
    """keys: the folder of the fleet's keys, or None. member: the number whose secret it has if it is one."""

    def __init__(self, network, host, trust, keys=None, member=None, seed=1):
        self.trust, self.member, self.random = trust, member, random.Random(seed)
        self.key = self.mission = self.secret = None
        if trust != NO_KEY:
            self.key = bytes.fromhex(keys_of(keys / "fleet.key", "tessera-fleet-key")[0][0])
            self.mission = " ".join(keys_of(keys / "fleet.key", "tessera-mission")[0]).encode()
        if trust == MEMBER:
            self.secret = bytes.fromhex(keys_of(keys / f"robot_{member}.key", "tessera-robot-secret")[0][1])
        self.heard = collections.deque(maxlen=MOST_HEARD)
        self.fleet, self.known, self.sessions, self.read = None, {}, {}, 0
        self.sent = self.sequence = 0
        self.socket = inside(network, host, lambda: self.open(network.address(host)))
        self.raw = inside(network, host, lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW))
        self.raw.bind(("eth0", 0))
        self.address = network.address(host)
        self.listener = threading.Thread(target=self.listen, daemon=True)
        self.listener.start()

    @staticmethod
    def open(address):
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        opened.bind(GROUP)
        own = socket.inet_aton(address)
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP[0]) + own)
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, own)
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 0)
        return opened

    def listen(self):
        for payload in payloads(self.socket, CHANNEL):
            self.heard.append(payload)

    def close(self):
        end_listening(self.socket, self.listener)
        self.raw.close()

    def learn(self, limit_s=10):
        """Reads what has been heard since the last call; at first waits for an announcement, which tells the configuration."""
        end = time.monotonic() + limit_s
        while self.fleet is None:
            found = [data for data in list(self.heard) if len(data) > 79 and data[3] & 127 == wire.ANNOUNCEMENT]
            if found:
                self.make_fleet(found[-1])
            elif time.monotonic() > end:
                raise RuntimeError("the attacker heard no announcement")
            else:
                time.sleep(0.05)
        heard = list(self.heard)
        for data in heard[self.read:]:
            try:
                self.note(self.ear.decode(data))
            except (wire.Refused, struct.error):
                continue  # Of another attacker, or of another mission.
        self.read = len(heard)

    def make_fleet(self, announcement):
        configuration = announcement[32:63]
        classes = struct.unpack_from("<H", configuration, 20)[0]
        signs = {0: b""} if announcement[3] & 128 else {}
        self.fleet = wire_trust.Fleet(self.key, self.mission, configuration, classes, signs)
        overheard = wire_trust.Fleet(None, None, configuration, classes, signs)
        overheard.mission_value = announcement[4:8] + bytes(12)
        self.ear = Ear(overheard, None)
        if self.trust == NO_KEY:
            # It sees whether there is a key, and can only guess it.
            self.fleet.mission_value = overheard.mission_value
            self.fleet.key = self.random.randbytes(32) if announcement[4:8] != bytes(4) else None

    def note(self, datagram):
        body = datagram.body
        self.sessions[datagram.sender] = max(datagram.session, self.sessions.get(datagram.sender, 0))
        for one in body.get("frames", []):
            self.known.setdefault(one["name"], Contribution()).frame = one
        if "name" not in body:
            return
        known = self.known.setdefault(body["name"], Contribution())
        for record in body.get("records", []):
            known.records[record.version] = record
        if "stated" in body and (known.stated is None or body["stated"]["latest"] >= known.stated["latest"]):
            known.stated = body["stated"]

    def honest(self):
        """Names of the contributions of others that were heard whole enough to forge them, with what was heard."""
        return [(name, c) for name, c in sorted(self.known.items()) if c.stated and c.records and name[0] != self.member]

    # --- Making datagrams --------------------------------------------------------------------------

    def signature(self, robot, message):
        if self.secret is not None and robot == self.member:
            return sign(self.secret, self.fleet.mission_value + message)
        return self.random.randbytes(64)

    def root_signature(self, name, leaves, kind=wire.CHUNK):
        crc = struct.pack("<I", wire_trust.crc32c(self.fleet.configuration))
        return self.signature(name[0], b"TS\2" + bytes([kind]) + crc + struct.pack("<3IB", *name, len(leaves)) + self.fleet.root(leaves))

    def prove(self, name, leaf, kind=wire.CHUNK):
        """A proof of a leaf that is alone in its tree."""
        return b"\0" + self.root_signature(name, [leaf], kind) if self.fleet.signs else b""

    def proven(self, name, record):
        record.proof = self.prove(name, self.fleet.leaf_of_record(name, record))
        return record

    def datagram(self, kind, sender, body, session=None, sequence=None):
        """One of that kind, signed and tagged as well as this attacker can."""
        self.sequence += 1
        sequence = self.sequence + 2**33 if sequence is None else sequence
        session = self.sessions.get(sender, 1 << 32) if session is None else session
        relayed = kind in (wire.CHUNK, wire.FRAME) and body["flags"] & 1
        if kind == wire.STATEMENT:
            statement = wire_encode.body_bytes(kind, {**body, "proof": b""})
            body = {**body, "proof": self.prove(body["name"], self.fleet.leaf_of_statement(statement))}
        crc = wire_trust.crc32c(self.fleet.configuration)
        data = struct.pack("<2sBB4sIIQQ", b"TS", 2, kind + 128 * self.fleet.signs, self.fleet.mission_value[:4], crc, sender, session,
                           sequence) + wire_encode.body_bytes(kind, body)
        if self.fleet.signs and kind not in (wire.STATEMENT, wire.CONFLICT) and not relayed:
            data += self.end_signature(kind, sender, session, body, data)
        return data + self.fleet.tag(data)

    def end_signature(self, kind, sender, session, body, data):
        if kind == wire.CHUNK:
            statement = data[32:52] + data[53:89] + struct.pack("<Q", session)
            leaves = [self.fleet.leaf_of_record(body["name"], record) for record in body["records"]]
            return self.root_signature(body["name"], [*leaves, self.fleet.leaf_of_statement(statement)])
        if kind == wire.FRAME:
            leaves = [self.fleet.leaf_of_frame(wire_frames.alone(one)) for one in body["frames"]]
            return self.root_signature((body["robot"], 0, 0), leaves, kind)
        return self.signature(sender, data)

    def announcement(self, sender, held=(), epoch=0, data=0, challenges=(), **header):
        return self.datagram(wire.ANNOUNCEMENT, sender, {"configuration": self.fleet.configuration, "epoch": epoch, "data": data,
                                                         "challenges": challenges, "held": held}, **header)

    def chunk(self, sender, name, versions, records=(), relayed=True, partial=False, stated=None, **header):
        if relayed:
            records = [self.proven(name, record) for record in records]
        return self.datagram(wire.CHUNK, sender, {"name": name, "range": versions, "flags": relayed + 2 * partial, "stated": stated,
                                                  "records": records}, **header)

    def statement(self, sender, name, stated, **header):
        session = header.get("session") or self.sessions.get(sender, 1 << 32)
        return self.datagram(wire.STATEMENT, sender, {"name": name, "range": (1, 1), "stated": stated, "session": session}, **header)

    def frame(self, sender, name, revision, T, extent=None, **header):
        one = {"name": name, "revision": revision, "T": T, "extent": extent, "session": None, "proof": b""}
        relayed = sender != name[0]
        if relayed:
            one["proof"] = self.prove((name[0], 0, 0), self.fleet.leaf_of_frame(wire_frames.alone(one)), wire.FRAME)
        return self.datagram(wire.FRAME, sender, {"flags": int(relayed), "robot": name[0], "frames": [one]}, **header)

    def conflict(self, sender, name, kind, sides, **header):
        """sides: the bytes of what is said, and the proof of it."""
        return self.datagram(wire.CONFLICT, sender, {"name": name, "kind": kind, "sides": [(said, None, proof) for said, proof in sides]},
                             **header)

    def request(self, sender, wanted, **header):
        return self.datagram(wire.REQUEST, sender, {"wanted": wanted}, **header)

    def state_of(self, name, records, floor=0, frame=1):
        """What an origin that holds these records would state."""
        replica = Replica()
        for record in records:
            replica.add(record, self.fleet.leaf_of_record(name, record))
        number, low, high = replica.fingerprint()
        return {"latest": max([record.version for record in records], default=0), "records": number, "fingerprint": (low, high),
                "frame": frame, "floor": floor, "session_floor": floor}

    # --- Sending -----------------------------------------------------------------------------------

    def lcm(self, payload):
        self.sent += 1
        return b"LC02" + struct.pack(">I", self.sent & 0xffffffff) + CHANNEL + payload

    def say(self, payload):
        try:
            self.socket.sendto(self.lcm(payload), GROUP)
        except OSError:
            self.sent -= 1  # A full buffer of the sender's.

    def say_to(self, mac, payload):
        """The same to one host alone: its frame has that host's address, and the group's only inside."""
        udp = self.lcm(payload)
        udp = struct.pack(">4H", GROUP[1], GROUP[1], 8 + len(udp), 0) + udp
        head = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 1, 17, 0, socket.inet_aton(self.address),
                           socket.inet_aton(GROUP[0]))
        total = sum(struct.unpack(">10H", head))
        total = (total & 0xffff) + (total >> 16)
        head = head[:10] + struct.pack(">H", ~(total + (total >> 16)) & 0xffff) + head[12:]
        try:
            self.raw.send(mac + self.raw.getsockname()[4] + b"\x08\x00" + head + udp)
        except OSError:
            self.sent -= 1  # A full buffer, or longer than a frame: nobody would read that as a datagram.
