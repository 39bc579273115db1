# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A fleet of processes in network namespaces, and an attacker among them. What is recorded of a session before it, and of another
mission, the attacker has."""
import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "processes"))
import network_space
from attacker import FLEET_KEY, MEMBER, NO_KEY, Attacker
from effects import effects
from team import Member, held, program

ROBOTS = 3          # Honest ones, numbered from 0, each on the host of its number.
NEWCOMER = ROBOTS   # One more of them, which joins when the attack is over.
CAPTURED = 9        # The robot whose secret a member among the attackers has.
ATTACKERS_HOST = ROBOTS + 1
SIGNS, KEY_ALONE = "signs", "key alone"
COMBINATIONS = ((SIGNS, NO_KEY), (SIGNS, FLEET_KEY), (SIGNS, MEMBER), (KEY_ALONE, NO_KEY), (KEY_ALONE, FLEET_KEY))
BLOCKS, BLOCKS_PER_S = 240, 60


class Scenario:
    """Use it in a with statement."""

    def __init__(self, fleet, trust, blocks=BLOCKS, seed=1):
        self.fleet, self.trust, self.blocks, self.seed, self.closing = fleet, trust, blocks, seed, []

    def __enter__(self):
        try:
            temporary = tempfile.TemporaryDirectory(prefix="tessera-attack-")
            self.closing.append(temporary.cleanup)
            self.keys = pathlib.Path(temporary.name) / "keys"
            subprocess.run([program("TESSERA_COMMAND"), "key", "new", "--robots", str(CAPTURED + 1), "--dir", self.keys], check=True,
                           capture_output=True)
            self.network = network_space.Network(ATTACKERS_HOST + 1)
            self.closing.append(self.network.close)
            self.attacker = Attacker(self.network, ATTACKERS_HOST, self.trust, self.keys, CAPTURED if self.trust == MEMBER else None,
                                     self.seed)
            self.closing.append(self.attacker.close)
            self.attacker.macs = [self.mac(host) for host in range(ROBOTS)]
            self.published = self.record()
            self.members = [self.member(host) for host in range(ROBOTS)]
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for close in reversed(self.closing):
            close()

    def mac(self, host):
        text = network_space.run(*self.network.inside(host), "cat", "/sys/class/net/eth0/address")
        return bytes.fromhex(text.strip().replace(":", ""))

    def member(self, host, session=2, **options):
        keys = {"key": self.keys / "fleet.key"}
        if self.fleet == SIGNS:
            keys |= {"secret": self.keys / f"robot_{host}.key", "public_keys": self.keys / "fleet.pub"}
        options = {"floor": session, "blocks": self.blocks, "blocks_per_s": BLOCKS_PER_S, "robot_parts": 1 << 11} | options
        member = Member(self.network, host, session, **keys, **options)
        self.closing.append(member.close)
        return member

    def record(self):
        """Of each robot what it publishes where nobody attacks. The attacker hears robot 1 in an earlier session, and all of another
        mission, in which they say what they say later."""
        quick = {"blocks_per_s": 1000}
        yesterday = [self.member(host, mission="yesterday", **quick) for host in range(ROBOTS + 1)]
        time.sleep(0.3)
        for member in yesterday:
            reports = self.until_published(yesterday)
        published = {report["robot"]: held(report, report["robot"], report["epoch"]) for report in reports}
        for member in yesterday:
            member.close()
        self.attacker.other_mission = self.take_heard()
        earlier = self.member(1, session=1, **quick)
        self.until_published([earlier])
        time.sleep(0.5)
        earlier.kill()
        self.attacker.earlier = self.take_heard()
        return published

    @staticmethod
    def until_published(members, limit_s=30):
        end = time.monotonic() + limit_s
        while True:
            reports = [member.report() for member in members]
            if all(report["published_all"] for report in reports):
                return reports
            if time.monotonic() > end:
                raise RuntimeError("the robots do not publish")
            time.sleep(0.1)

    def take_heard(self):
        heard = list(self.attacker.heard)
        self.attacker.heard.clear()
        return heard

    def attack(self, attack, duration_s, per_s=400):
        """Attacks again and again for so long; what was heard meanwhile is part of the next round. Returns how many datagrams it sent."""
        attacker = self.attacker
        before, begin = attacker.sent, time.monotonic()
        while time.monotonic() - begin < duration_s:
            attacker.learn()
            for payload in attack(attacker):
                if isinstance(payload, tuple):
                    attacker.say_to(*payload)
                else:
                    attacker.say(payload)
                ahead_s = (attacker.sent - before) / per_s - (time.monotonic() - begin)
                if ahead_s > 0:
                    time.sleep(ahead_s)
                if time.monotonic() - begin >= duration_s:
                    break
            time.sleep(0.02)
        return attacker.sent - before

    def join(self):
        """The newcomer comes."""
        self.members.append(self.member(NEWCOMER))

    def effects(self):
        """Those that there are now."""
        reports = [member.report() for member in self.members]
        unfinished = [f"robot {report['robot']} has not published all" for report in reports if not report["published_all"]]
        return unfinished or effects(reports, self.published, CAPTURED if self.trust == MEMBER else None,
                                     self.fleet == KEY_ALONE and self.trust == FLEET_KEY)

    def last_effects(self, limit_s):
        """Those that are left after so long, and when there were none, in seconds from now. They must stay away for a second."""
        begin, none_since = time.monotonic(), None
        while True:
            found, now = self.effects(), time.monotonic()
            none_since = None if found else none_since or now
            if none_since and now - none_since >= 1:
                return [], none_since - begin
            if now - begin >= limit_s and found:
                return found, None
            time.sleep(0.2)
