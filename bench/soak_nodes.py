#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""soak_nodes.py --build FOLDER [--minutes N] [--seed N] [--kills-per-minute N] [--strict]: three nodes in network namespaces of their own,
in real time, while nodes are killed, links are cut and submaps are corrected.

Each node has sensors of its own: tessera play, which drives along a simulated street and back again, with two small scans a second. They
share over multicast on a bridge. Node 0 is never killed, so that its memory can be judged. A row for each node and minute; at the end all
links are up, nothing is mapped any more, and then must hold, else it ends with status 1:

- descriptors and threads of each process are as many as when it had settled, half a minute after its start
- a process that was there after 10 minutes has not more than 1 MiB more resident memory at the end, where memory could be locked; in runs
  of 10 minutes or less, not more than 4 MiB more than after half of it
- all have the same contributions, and the same global map
- no map has more evidence than the scans that were sent while its node ran, nor the global map more than all maps
- no node ended by itself, logged an error or found damage; no correction was refused; no heap allocation after the start

What a busy machine does, as a cycle that is missed, is printed as late, and fails with --strict alone. Status 77 where no namespaces are
permitted.
"""
import argparse
import os
import pathlib
import random
import re
import signal
import sys
import tempfile
import time
import unittest

from soak_nodes_team import (FREE_STALENESS_S, RATE_HZ, ROBOTS, SPEED_MPS, Robot, Statuses, evidence_of_a_scan, label_evidence, make_street,
                             network_space, until)

SKIPPED = 77
SETTLED_MIN = 10.0
RESIDENT_KIB, RESIDENT_KIB_OF_SHORT = 1024, 4096  # A high mark of the heap may come late in a short run.
AGREEMENT_S = 300  # However slow the machine is.
BETWEEN_PARTITIONS_S, BETWEEN_CORRECTIONS_S = 60.0, 25.0
SUBMAPS = 10  # Of a robot in a run.
# In a log, of what must not happen; a thread that does not respond may only be late.
WRONG = re.compile(r".*(?:: error: (?!.*does not respond)|is damaged|correction \d+ is refused|is missing|begins with an empty map).*")
LATE = re.compile(r".*does not respond.*")
# A kill may cut an append of the journal short: of a batch, at most.
LEFT_OUT = re.compile(r"(\d+) bytes of the kept map were damaged")
TORN_BYTES = 5 << 18


def planned(options, chance):
    """What happens when: (second, what, robot, for how long). Nothing in the first 20 s and the last 15 s."""
    plan, end_s = [], 60 * options.minutes - 15

    def add(what, between_s, robots, low_s, high_s):
        at_s = 20.0
        while between_s and (at_s := at_s + chance.expovariate(1 / between_s)) < end_s:
            plan.append((at_s, what, chance.choice(robots), chance.uniform(low_s, high_s)))

    add("kill", 60 / options.kills_per_minute if options.kills_per_minute else 0, range(1, ROBOTS), 0.0, 3.0)
    add("cut", BETWEEN_PARTITIONS_S, range(ROBOTS), 3.0, 15.0)
    add("correct", BETWEEN_CORRECTIONS_S / ROBOTS, range(ROBOTS), 0.0, 0.0)
    return sorted(plan)


class Soak:
    def __init__(self, options, folder, network):
        self.options, self.chance = options, random.Random(options.seed)
        self.faults, self.late = [], []  # late: what a busy machine does.
        self.folder, self.network = folder, network
        self.statuses = Statuses(network)
        self.robots = [Robot(network, number, folder, options) for number in range(ROBOTS)]
        self.cuts = 0
        self.reference_min = SETTLED_MIN if options.minutes > SETTLED_MIN else options.minutes / 2
        self.reference = {}  # By process: resident KiB then.
        self.grown = {}  # By robot: KiB since then.

    def run(self):
        for robot in self.robots:
            robot.start()
            robot.play()
        begin = time.monotonic()
        coming, minute = planned(self.options, self.chance), 1
        while (now_s := time.monotonic() - begin) < 60 * self.options.minutes:
            if coming and coming[0][0] <= now_s:
                coming += self.do(*coming.pop(0), now_s)
                coming.sort()
                continue
            if now_s >= 60 * minute:
                self.print_minute(minute)
                minute += 1
            self.look(now_s)
            time.sleep(0.05)
        for event in coming:
            if event[1] in ("start", "join"):
                self.do(*event, now_s)
        self.print_minute(minute)

    def do(self, _, what, number, for_s, now_s):
        """What is to come of it later."""
        robot = self.robots[number]
        if what == "kill" and robot.node:
            robot.kill()
            return [(now_s + for_s, "start", number, 0.0)]
        if what == "start":
            robot.start()
        elif what == "cut":
            robot.link("down")
            self.cuts += 1
            return [(now_s + for_s, "join", number, 0.0)]
        elif what == "join":
            robot.link("up")
        elif what == "correct":
            robot.correct(self.chance)
        return []

    def look(self, now_s):
        for robot in self.robots:
            robot.settle()
            if robot.node and robot.node.process.poll() is not None:
                self.faults.append(f"node {robot.number} ended by itself with {robot.node.process.returncode}: {robot.node.said[-500:]}")
                robot.put_away()
                robot.start()
            if robot.player.poll() is not None:
                raise RuntimeError(f"the player of robot {robot.number} ended: {robot.stop_player()}")
        if not self.reference and now_s > 60 * self.reference_min:
            self.reference = {robot.node.process.pid: robot.figures()[2] for robot in self.robots if robot.settled}

    def print_minute(self, minute):
        for robot in self.robots:
            figures, said = robot.figures(), self.statuses.last.get(robot.number, {})
            process = f"{figures[0]:3} descriptors {figures[1]:3} threads {figures[2] / 1024:7.2f} MiB resident" if figures else f"{'down':44}"
            print(f"minute {minute:3} node {robot.number}: {process}, submap {len(robot.kept()):2}, {said.get('scans', 0):5} scans since its start, "
                  f"{said.get('overruns', 0)} ticks late, {said.get('contributions', 0):3} contributions, {robot.kills:3} kills, "
                  f"{robot.corrections:3} corrections, {robot.state()}", flush=True)

    def end(self):
        """Quiet, and what must hold then."""
        for robot in self.robots:
            robot.stop_player()
        since = time.monotonic()
        try:
            # Until then there may be something to publish.
            time.sleep(2 * FREE_STALENESS_S)
            until(lambda: self.statuses.agree(since + 2 * FREE_STALENESS_S), "nodes that agree", AGREEMENT_S)
            print(f"agreed {time.monotonic() - since:.1f} s after the last scan")
        except AssertionError:
            self.faults.append(f"after {AGREEMENT_S} s without scans the nodes do not agree: {self.statuses.last}")
        for robot in self.robots:
            robot.settle()
            self.check_process(robot)
        # Nobody is to hear the others end.
        network_space.run("ip", "link", "set", "bridge0", "down")
        reports = [robot.end() for robot in self.robots]
        self.check_reports(reports)
        self.check_evidence(reports)
        self.check_logs()

    def check_process(self, robot):
        figures = robot.figures()
        if robot.settled and figures[:2] != robot.settled[:2]:
            self.faults.append(f"node {robot.number} has {figures[0]} descriptors and {figures[1]} threads, and had {robot.settled[0]} and "
                               f"{robot.settled[1]} when it had settled")
        before_kib = self.reference.get(robot.node.process.pid)
        if before_kib:
            self.grown[robot.number] = figures[2] - before_kib
            print(f"node {robot.number}: {figures[2] / 1024:.2f} MiB resident at the end, {self.grown[robot.number]:+} KiB since minute "
                  f"{self.reference_min:g}")

    @staticmethod
    def differing(reports):
        """Contributions that not all have alike: a line each."""
        held = [{tuple(c[key] for key in ("robot", "epoch", "submap")): (c["digest"], c["covered_to"]) for c in report["contributions"]}
                for report in reports]
        ids = sorted(set().union(*held))
        return [f"(robot, epoch, submap) {id}, digest and version: {[one.get(id) for one in held]}" for id in ids
                if len({one.get(id) for one in held}) > 1]

    @staticmethod
    def lacking(reports):
        """Contributions of which not all is held that their origin stated: a line each."""
        return [f"node {report['robot']} lacks parts of {c}" for report in reports for c in report["contributions"]
                if not c["complete"] and not c["far"]]

    def check_reports(self, reports):
        for what in ("exchange_digest", "digest"):
            # The global map may need more than the time that it has after SIGTERM.
            found = {report[what] for report in reports if what != "digest" or not report["realtime"]["map_is_behind"]}
            if len(found) > 1:
                self.faults.append(f"{what} differs: {found}")
        self.faults += self.differing(reports) + self.lacking(reports)
        for report in reports:
            here = f"node {report['robot']}"
            if report["heap_allocations_after_start"] not in (0, None):
                self.faults.append(f"{here}: {report['heap_allocations_after_start']} heap allocations after its start")
            submaps, state = report["submaps"], report["state"]
            for what, count in (("refused corrections", submaps["refused_corrections"]), ("failed writes of the state", state["failed"])):
                if count:
                    self.faults.append(f"{here}: {count} {what}")
            if submaps["lost_blocks"] or submaps["cut_short"]:
                self.late.append(f"{here}: {submaps['lost_blocks']} blocks of ended submaps were not published in time")
            sizes = report["global_map"]
            refused = sum(sizes[what] for what in ("refused_blocks", "refused_sums", "replicas_refused_storage", "replicas_refused_quota"))
            print(f"{here}: {report['seconds']:.0f} s, {report['scans']['integrated']} scans, {submaps['number'] + 1} submaps, "
                  f"{len(report['contributions'])} contributions, {refused} refused for lack of memory, "
                  f"most {state['most_lost_ms']:.0f} ms not durable, {state['written_bytes'] / 1e6:.0f} MB written")
        cycles = sum(report["mapping"]["cycles"] for report in reports)
        missed = sum(report["mapping"]["missed"] for report in reports)
        print(f"missed {missed} of {cycles} cycles of the last processes, {100 * missed / max(1, cycles):.2f} %")
        if missed:
            self.late.append(f"{missed} cycles missed")
        most_kib = RESIDENT_KIB if self.options.minutes > SETTLED_MIN else RESIDENT_KIB_OF_SHORT
        for number, grown_kib in self.grown.items():
            if not reports[number]["realtime"]["memory_locked"]:
                print(f"node {number} could not lock its memory, so what is resident is not judged")
            elif grown_kib > most_kib:
                self.faults.append(f"resident memory of node {number} has grown by {grown_kib} KiB")

    def check_evidence(self, reports):
        """A scan that was sent may be in the map once, or lost. A scan at one end has more points than one at the other."""
        maps, scans = 0.0, self.options.scans
        for robot in self.robots:
            of_a_scan = evidence_of_a_scan(self.options.command, self.folder, robot.number)
            evidence, sent = robot.evidence(), robot.up_s * RATE_HZ + robot.kills + 1
            maps += evidence
            print(f"node {robot.number}: evidence of {evidence / of_a_scan:.1f} scans in its map, {sent:.1f} at most were sent while it ran, "
                  f"{robot.kills} kills")
            if evidence > of_a_scan * (1.02 * sent + scans / 2):
                self.faults.append(f"node {robot.number} has more evidence than was sent")
        if reports[0]["realtime"]["map_is_behind"]:
            return
        shared = label_evidence(self.options.command, self.folder, self.folder / "node_0.global.tsm")
        print(f"the global map has {shared / maps:.4f} of the evidence in all maps")
        if shared > 1.01 * maps:
            self.faults.append("the global map has more evidence than all maps together")

    def check_logs(self):
        for robot in self.robots:
            for log in robot.logs:
                self.faults += [f"node {robot.number}: {line}" for line in WRONG.findall(log)]
                for left_out in map(int, LEFT_OUT.findall(log)):
                    print(f"node {robot.number}: a start has left out {left_out} bytes of the journal, of an append that was cut short by a kill")
                    if left_out > TORN_BYTES or robot.kills == 0:
                        self.faults.append(f"node {robot.number}: {left_out} bytes of the kept map were damaged")
                self.late += [f"node {robot.number}: {line}" for line in LATE.findall(log)]

    def close(self):
        for robot in self.robots:
            robot.close()
        self.statuses.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kills-per-minute", type=float, default=1.0, help="of nodes 1 and 2 together")
    parser.add_argument("--scans", type=int, default=20, help="of the street")
    parser.add_argument("--fusion-memory", default="96M")
    parser.add_argument("--strict", action="store_true", help="what is late fails, too")
    options = parser.parse_args()
    options.command = options.build.resolve() / "tessera"
    os.environ["TESSERA_COMMAND"] = str(options.command)
    options.submap_length = max(20.0, round(60 * options.minutes * SPEED_MPS / SUBMAPS))
    try:
        network_space.enter()
    except unittest.SkipTest:
        return SKIPPED
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    print(f"seed {options.seed}, {options.minutes:g} minutes, submaps of {options.submap_length:g} m", flush=True)
    with tempfile.TemporaryDirectory(prefix="tessera-soak-") as name:
        folder = pathlib.Path(name)
        make_street(options.command, folder, options.scans)
        network = network_space.Network(ROBOTS + 1)
        try:
            soak = Soak(options, folder, network)
            try:
                soak.run()
                soak.end()
            finally:
                soak.close()
        finally:
            network.close()
    faults = soak.faults + (soak.late if options.strict else [])
    print(f"{sum(robot.kills for robot in soak.robots)} kills, {soak.cuts} cut links, {sum(robot.corrections for robot in soak.robots)} corrections: "
          f"{len(faults)} violations")
    for line in soak.late:
        print(f"late: {line}")
    for fault in faults:
        print(f"VIOLATION: {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
