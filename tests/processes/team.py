# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Robots as processes on a network of their own, and what is held of every team: it comes to equal bytes, and what each
robot published is there once."""
import json
import os
import pathlib
import select
import subprocess
import tempfile
import time
import unittest

import network_space

# For a report, a farewell and the like; settling has limits of its own.
ANSWER_LIMIT_S = 30


def program(variable):
    path = os.environ.get(variable)
    if not path:
        raise RuntimeError(f"set {variable}, as ctest does: the path of the built program")
    return path


class Member:
    """One process. Options are those of team_member, with _ for -."""

    def __init__(self, network, host, session=1, **options):
        words = [word for name, value in options.items() for word in (f"--{name.replace('_', '-')}", str(value))]
        self.robot, self.session = host, session
        self.process = subprocess.Popen(
            [*network.inside(host), program("TESSERA_MEMBER"), "--robot", str(host), "--session", str(session), "--interface",
             "eth0", *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        if self.line() != "ready":
            raise RuntimeError("a member did not begin with ready")

    def line(self):
        ready, _, _ = select.select([self.process.stdout], [], [], ANSWER_LIMIT_S)
        text = self.process.stdout.readline() if ready else ""
        if not text:
            raise RuntimeError(f"robot {self.robot} says nothing; its exit status is {self.process.poll()}")
        return text.strip()

    def report(self):
        self.process.stdin.write("report\n")
        return json.loads(self.line())

    def kill(self):
        """As a robot loses power."""
        self.process.kill()
        self.close()

    def leave(self):
        """Lets it take its leave; gives its last report."""
        self.process.terminate()
        report = json.loads(self.line())
        self.process.wait(ANSWER_LIMIT_S)
        self.close()
        return report

    def close(self):
        """Ends it at once if it runs."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(ANSWER_LIMIT_S)
        self.process.stdin.close()
        self.process.stdout.close()


def held(report, robot, epoch):
    """What a report says of a contribution; None if it is not there."""
    found = [c for c in report["contributions"] if (c["robot"], c["epoch"]) == (robot, epoch)]
    return found[0] if found else None


class TeamCase(unittest.TestCase):
    def network(self, hosts):
        network = network_space.Network(hosts)
        self.addCleanup(network.close)
        return network

    def member(self, network, host, session=1, **options):
        member = Member(network, host, session, **options)
        self.addCleanup(member.close)
        return member

    def members(self, network, hosts=None, **options):
        return [self.member(network, host, **options) for host in (range(network.hosts) if hosts is None else hosts)]

    def folder(self):
        temporary = tempfile.TemporaryDirectory(prefix="tessera-team-")
        self.addCleanup(temporary.cleanup)
        return pathlib.Path(temporary.name)

    def fleet_key(self, name):
        """A new key file, with a mission of its own."""
        path = self.folder() / name
        subprocess.run([program("TESSERA_COMMAND"), "key", "new", "--fleet", path, "--without-signatures"], check=True, capture_output=True)
        return path

    def key_of_same_mission(self, name, other):
        """A new key file, with the mission of another one."""
        path = self.fleet_key(name)
        mission = next(line for line in other.read_text().splitlines() if "mission" in line)
        own = [mission if "mission" in line else line for line in path.read_text().splitlines()]
        path.write_text("\n".join(own) + "\n")
        return path

    def settled(self, members, limit_s=60, contributions=None, lacking=False):
        """Waits until all have published all and hold the same, and lack nothing unless lacking; gives their reports."""
        end = time.monotonic() + limit_s
        while True:
            reports = [member.report() for member in members]
            if (all(report["published_all"] for report in reports)
                    and len({(report["digest"], report["content"]) for report in reports}) == 1
                    and (lacking or all(report["complete"] == report["known"] for report in reports))
                    and contributions in (None, reports[0]["known"])):
                break
            if time.monotonic() > end:
                self.fail(f"after {limit_s} s they do not hold the same: {json.dumps(reports)}")
            time.sleep(0.1)
        for report in reports:
            self.assertEqual(report["contributions"], reports[0]["contributions"])
            self.assertEqual(0, report["exchange"]["records_refused"])
            self.assertEqual(0, report["link"]["fragments"])
        return reports

    def assert_each_counts_once(self, reports):
        """What all hold together is what each holds of its own, and so nothing is there twice or lacking."""
        own = [held(report, report["robot"], report["session"]) for report in reports]
        for report in reports:
            for contribution in own:
                self.assertEqual(contribution, held(report, contribution["robot"], contribution["epoch"]))
            self.assertEqual(len(reports), len(report["contributions"]))
