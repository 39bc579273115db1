# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A fleet of nodes, each a tessera node that replays a scan of a simulated street, and an attacker among them. While they run, their
statuses tell when they agree; when they have ended, their reports and maps tell what they hold."""
import atexit
import concurrent.futures
import functools
import hashlib
import json
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path += [str(HERE.parent / folder) for folder in ("processes", "support", "wire")]
import decode_status
import network_space
from attacker import FLEET_KEY, MEMBER, NO_KEY, Attacker, end_listening, inside, payloads, wire_trust
from effects import CONTRIBUTIONS_PER_ROBOT, wrong_names
from running_node import RunningNode, until, write_config
from scenario import ATTACKERS_HOST, CAPTURED, KEY_ALONE, NEWCOMER, ROBOTS, SIGNS, Scenario
from signing import keys_of
from team import program

CHANNEL = b"TESSERA_STATUS\0"
TYPED = decode_status.TYPED
EXTRA = TYPED - 8 * decode_status.OWN_COUNTERS  # The node's own counters, of which the first are scans, contributions and whole ones.
LIMIT_S = 60
# What makes a robot publish during all of an attack, and what lets it publish at once.
SLOWLY = {"label_bytes_per_s": 2500, "free_bytes_per_s": 1000}
AT_ONCE = {}


@functools.cache
def street():
    """The folder of a scan for each robot, which this program makes once."""
    folder = tempfile.mkdtemp(prefix="tessera-street-")
    atexit.register(shutil.rmtree, folder)
    subprocess.run([program("TESSERA_COMMAND"), "simulate", "--robots", str(ROBOTS + 1), "--scans", "1", "--seed", "5", "--out",
                    folder + "/street"], check=True, capture_output=True, timeout=LIMIT_S)
    return pathlib.Path(folder) / "street"


class Statuses:
    """Hears the nodes' statuses on one host. key, public_keys: None where the fleet has none of them."""

    def __init__(self, network, host, key, public_keys, missions):
        self.key, self.public_keys, self.missions = key, public_keys, missions
        self.raw, self.last = [], {}
        self.socket = inside(network, host, lambda: Attacker.open(network.address(host)))
        self.listener = threading.Thread(target=self.listen, daemon=True)
        self.listener.start()

    def listen(self):
        for status in payloads(self.socket, CHANNEL):
            self.note(status)

    def note(self, data):
        for mission in self.missions:
            try:
                said = decode_status.read_status(data, self.key, mission, self.public_keys)
            except wire_trust.Refused:
                continue
            before = self.last.get((mission, said["robot"]))
            if before and (said["session"], said["sequence"]) <= (before["session"], before["sequence"]):
                return
            self.raw.append(data)
            digest = data[80:88]
            scans, contributions, whole = struct.unpack_from(">3q", data, EXTRA)
            self.last[mission, said["robot"]] = {**said, "digest": digest, "scans": scans, "contributions": contributions, "whole": whole,
                                                 "is_still": before is not None and digest == before["digest"],
                                                 "heard": time.monotonic()}

    def of(self, mission, robots, since):
        """The last of each of these; None if one was not heard since then."""
        found = [self.last.get((mission, robot)) for robot in robots]
        return found if all(one and one["heard"] > since for one in found) else None

    def agree(self, mission, robots, since, most_contributions):
        """Whether the robots hold the same, all that there is, and held it in their status before."""
        found = self.of(mission, robots, since)
        return (found is not None and len({one["digest"] for one in found}) == 1
                and all(one["is_still"] and one["scans"] > 0 for one in found)
                and all(len(robots) <= one["whole"] <= one["contributions"] <= most_contributions for one in found))

    def close(self):
        end_listening(self.socket, self.listener)


class NodeScenario(Scenario):
    """As Scenario, with nodes. They are ended by last_effects(), so that it can be asked for once."""

    def record(self):
        """As Scenario's. Both recordings are made at once, as each datagram names its mission."""
        self.folder = self.keys.parent
        self.reports, self.attack_end = [], 0.0
        self.key = bytes.fromhex(keys_of(self.keys / "fleet.key", "tessera-fleet-key")[0][0])
        self.mission = " ".join(keys_of(self.keys / "fleet.key", "tessera-mission")[0]).encode()
        public = {int(robot): bytes.fromhex(key) for robot, key in keys_of(self.keys / "fleet.pub", "tessera-robot-public")}
        self.statuses = Statuses(self.network, ATTACKERS_HOST, self.key, public if self.fleet == SIGNS else None,
                                 (b"yesterday", self.mission))
        self.closing.append(self.statuses.close)
        robots = range(ROBOTS + 1)
        begin = time.monotonic()
        yesterday = [self.member(host, mission="yesterday", publish=AT_ONCE) for host in robots]
        earlier = self.member(1, publish=AT_ONCE)
        until(lambda: self.statuses.agree(b"yesterday", robots, begin, ROBOTS + 1), "nodes that nobody attacks agree", LIMIT_S)
        until(lambda: self.statuses.agree(self.mission, [1], begin, 1), "a node alone publishes", LIMIT_S)
        earlier.kill()
        self.alone = {report["robot"]: self.own(report, f"yesterday_{report['robot']}") for report in self.end(yesterday)}
        value = hashlib.blake2b(b"tessera 2 mission" + bytes([len(self.mission)]) + self.mission, digest_size=16).digest()
        heard = self.take_heard()
        self.attacker.earlier = [data for data in heard if data[4:8] == value[:4]]
        self.attacker.other_mission = [data for data in heard if data[4:8] != value[:4]]
        return {}

    def member(self, host, mission=None, publish=SLOWLY):
        name = f"robot_{host}" if mission is None else f"{mission}_{host}"
        security = {"fleet_key": "keys/fleet.key", "mission": mission}
        if self.fleet == SIGNS:
            security |= {"robot_secret": f"keys/robot_{host}.key", "robot_public_keys": "keys/fleet.pub"}
        config = write_config(self.folder, name, {
            "robot": {"id": host, "state": mission or "state", "earlier": "drop"},
            "replay": {"dataset": str(street() / f"robot_{host}"), "rate_hz": 0},
            "map": {"resolution_m": 0.5, "max_range_m": 20.0, "memory": "40M"},
            "publish": {"staleness_s": 0.2, "free_staleness_s": 0.4, **publish},
            "network": {"url": "udpm://239.255.76.67:7667?ttl=1&recv_buf_size=400000", "interface": "eth0",
                        "contributions_per_robot": CONTRIBUTIONS_PER_ROBOT},
            "security": security, "fusion": {"memory": "32M"},
            "output": {"contribution": f"{name}.contribution.tsm", "keep_maps": False, "report": f"{name}.json"},
            # Until it is ended.
            "run": {"wait_for_peers": 1000, "linger_s": 600, "duration_s": 600}})
        node = RunningNode(self.folder, config, *self.network.inside(host))
        self.closing.append(node.close)
        return node

    @staticmethod
    def end(nodes):
        """Their reports."""
        with concurrent.futures.ThreadPoolExecutor() as ending:
            return list(ending.map(RunningNode.end, nodes))

    # --- During the attack -------------------------------------------------------------------------

    def attack(self, attack, duration_s, per_s=400):
        """As Scenario's, once each robot has begun to publish; with statuses among what the attack says."""
        until(self.all_are_known, "something of each robot", LIMIT_S)

        def with_statuses(attacker):
            for number, payload in enumerate(attack(attacker)):
                if number % 20 == 0:
                    self.say_a_status()
                yield payload

        sent = super().attack(with_statuses, duration_s, per_s)
        self.attack_end = time.monotonic()
        return sent

    def all_are_known(self):
        self.attacker.learn(LIMIT_S)
        known = {name[0] for name, _ in self.attacker.honest()}
        return known.issuperset(range(ROBOTS))

    def say_a_status(self):
        """One that was heard: as it was, or with another list of who is excluded, and a later session."""
        attacker = self.attacker
        if not self.statuses.raw:
            return
        status = attacker.random.choice(self.statuses.raw)
        if attacker.random.random() < 0.7:
            robot = attacker.random.choice([*range(ROBOTS), CAPTURED])
            typed = bytearray(status[:TYPED])
            struct.pack_into(">i", typed, 12, robot)
            struct.pack_into(">q", typed, decode_status.EXCLUDE_DIGEST_AT, attacker.random.getrandbits(32))
            status = bytes(typed) + struct.pack("<QI", attacker.random.getrandbits(64), 1)
            if self.fleet == SIGNS:
                status += attacker.signature(robot, b"tessera 2 status" + status)
            status += self.status_tag(status)
        attacker.sent += 1
        attacker.socket.sendto(b"LC02" + struct.pack(">I", attacker.sent & 0xffffffff) + CHANNEL + status, ("239.255.76.67", 7667))

    def status_tag(self, status):
        if self.trust == NO_KEY:
            return self.attacker.random.randbytes(16)
        name = bytes([len(self.mission)]) + self.mission
        key = hashlib.blake2b(b"tessera 2 status tag" + name, digest_size=32, key=self.attacker.key).digest()
        return hashlib.blake2b(status, digest_size=16, key=key).digest()

    # --- What is left ------------------------------------------------------------------------------

    def last_effects(self, limit_s):
        """What is left once the nodes agree, or after so long, and when they agreed, in seconds from now. Ends them: nobody hears the
        others end, so each report is of what it held before."""
        begin = time.monotonic()
        agreed_s = self.wait_until_they_agree(begin, limit_s)
        network_space.run("ip", "link", "set", "bridge0", "down")
        self.reports = self.end(self.members)
        found = self.effects()
        return found, None if found else agreed_s

    def wait_until_they_agree(self, begin, limit_s):
        robots = range(len(self.members))
        # What a member says of its own need not be whole, so there these statuses alone do not tell when all is said.
        member = self.trust == MEMBER
        most = len(robots) + (4 if member else 10**6 if self.nobody_may_stay() else 0)
        # A place for what a member only named is given back after 10 s. Within 5 s after the last a forged status may be seen where nobody
        # signs.
        earliest_s = 11 - (begin - self.attack_end) if member else 6 - (begin - self.attack_end) if self.fleet == KEY_ALONE and self.trust == FLEET_KEY else 0
        while time.monotonic() - begin < limit_s:
            passed_s = time.monotonic() - begin
            if passed_s >= earliest_s and self.statuses.agree(self.mission, robots, begin, most):
                return passed_s
            time.sleep(0.1)
        return None

    def nobody_may_stay(self):
        return self.fleet == KEY_ALONE and self.trust == FLEET_KEY

    def effects(self):
        """Of the ended nodes."""
        maps = {report["robot"]: self.folder / f"robot_{report['robot']}.contribution.tsm" for report in self.reports}
        found = [f"robot {report['robot']} has mapped or published another map than where nobody attacks" for report in self.reports
                 if self.own(report, f"robot_{report['robot']}") != self.alone[report["robot"]]]
        found += node_effects(self.reports, CAPTURED if self.trust == MEMBER else None, self.nobody_may_stay())
        if self.trust != MEMBER and not self.nobody_may_stay():
            fused = self.command("fuse", *maps.values(), "--memory", "64M", "--out", self.folder / "fused.tsm")["digest"]
            found += [f"robot {report['robot']} has another global map than what all published gives" for report in self.reports
                      if report["digest"] != fused]
        return found

    def own(self, report, name):
        """What a node mapped, to the bit, and what of it is published. A block may be published in the middle of a scan, and what that
        lacks of a voxel's evidence may be too little to publish it again: evidence is not compared."""
        published = self.command("info", self.folder / f"{name}.contribution.tsm")
        return [report["local_digest"], *(published[what] for what in ("blocks", "label_voxels", "free_voxels"))]

    def command(self, *words):
        report = self.folder / "command.json"
        subprocess.run([program("TESSERA_COMMAND"), *map(str, words), "--report", report], check=True, capture_output=True, timeout=LIMIT_S)
        return json.loads(report.read_text())


def node_effects(reports, quota_of=None, nobody_may_stay=False):
    """One line for each effect in the reports of honest nodes, as effects()."""
    found = []
    own = {report["robot"]: contribution_of(report, report["robot"], report["epoch"]) for report in reports}
    as_members = [{"robot": report["robot"], "epoch": report["epoch"], "names": report["contributions"]} for report in reports]
    for report, as_member in zip(reports, as_members):
        here = f"robot {report['robot']}"
        for origin in reports:
            contribution = contribution_of(report, origin["robot"], origin["epoch"])
            if contribution is None:
                found.append(f"{here} holds nothing of robot {origin['robot']}")
            elif content_of(contribution) != content_of(own[origin["robot"]]):
                found.append(f"{here} holds another content of robot {origin['robot']} than that published")
        found += [f"{here} {what}" for what in wrong_names(as_member, as_members, quota_of, nobody_may_stay)]
        peers = {peer["robot"]: peer for peer in report["peers"]}
        for robot in own.keys() - {report["robot"]}:
            if robot not in peers:
                found.append(f"{here} has not heard robot {robot}")
            elif peers[robot]["left"]:
                found.append(f"{here} takes robot {robot} for gone")
            elif peers[robot]["mismatch"]:
                found.append(f"{here} takes robot {robot} for one of another configuration")
        found += [f"{here} believes that robot {robot} excludes others" for robot in report["security"]["exclude_differs"] if robot in own]
    return found


def contribution_of(report, robot, epoch):
    found = [c for c in report["contributions"] if (c["robot"], c["epoch"], c["submap"]) == (robot, epoch, 0)]
    return found[0] if found else None


def content_of(contribution):
    return [contribution[what] for what in ("digest", "parts", "latest_version")]
