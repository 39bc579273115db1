#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""killed_nodes.py --build FOLDER [--kills N] [--seed N]: a node is killed at random moments and started again, each time with
the map of before.

Its sensors stand before a wall and send ten scans a second, also while no node runs. Evidence has no cap, and each scan adds the
same to a voxel, so this says how many scans are in the map. A count ends at 65,535 units, after some 1,500 scans, so an empty map begins
each 60 kills. At the end: no start has refused or found damage, beyond an append that a kill has cut short; no scan is in the map twice;
and no kill has cost more than state_loss_s of mapping and the scan at hand. Takes some 2.5 s a kill, in a network namespace of its own.
"""
import argparse
import csv
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path += [str(ROOT / "tests/support"), str(ROOT / "tests/cli")]
import own_network
from running_node import RunningNode, sensing, write_config
from sensor_sender import Sensors

STATE_LOSS_S = 0.5
RATE_HZ = 10
KILLS_OF_A_MAP = 60
# A kill may cut an append of the journal short: of a batch, at most.
TORN_BYTES = 5 << 18


def evidence_of(folder, state):
    """The most evidence of a voxel in the map that the last node has kept."""
    (journal,) = (folder / state).glob("*.tsj")
    subprocess.run([os.environ["TESSERA_COMMAND"], "export", "--map", str(journal), "--out", "voxels.csv"], cwd=folder, check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(folder / "voxels.csv") as file:
        return max((float(row["evidence"]) for row in csv.DictReader(file)), default=0.0)


def evidence_of_a_scan(folder):
    """By a node that ends in order."""
    config = write_config(folder, "first", sensing("first"), robot={"state": "first"}, map={"max_evidence": 0})
    node = RunningNode(folder, config)
    node.says("mapping: integrated the first scan", limit_s=20)
    time.sleep(1.0)
    scans = node.end()["mapping"]["cycles"]
    node.close()
    return evidence_of(folder, "first") / scans


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=21)
    options = parser.parse_args()
    os.environ["TESSERA_COMMAND"] = str((options.build / "tessera").resolve())
    if not own_network.enter():
        sys.exit("no network namespaces are permitted here (unshare -rn)")
    print(f"seed {options.seed}")
    chance = random.Random(options.seed)
    sent_while_up, most_lost, in_maps, previous, refused, torn, damaged, mapped = 0, 0.0, 0.0, 0.0, 0, 0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        sensors = Sensors(period_s=1 / RATE_HZ)
        of_a_scan = evidence_of_a_scan(folder)
        for kill in range(options.kills):
            if kill % KILLS_OF_A_MAP == 0:
                in_maps, previous, state = in_maps + previous, 0.0, f"state_{kill}"
                config = write_config(folder, "node", sensing(), robot={"state": state, "state_loss_s": STATE_LOSS_S}, map={"max_evidence": 0})
            node = RunningNode(folder, config)
            try:
                place = node.says("mapping: integrated the first scan", limit_s=20)
            except AssertionError:
                refused += 1
                print(f"kill {kill}: {node.said.strip()}")
                place = None
            before = sensors.clouds
            time.sleep(chance.uniform(0.0, 3.0))
            node.kill()
            sent = sensors.clouds - before
            node.close()
            for left_out in map(int, re.findall(r"(\d+) bytes of the kept map were damaged", node.said)):
                torn, damaged = torn + (left_out <= TORN_BYTES), damaged + (left_out > TORN_BYTES)
                print(f"kill {kill}: its start has left out {left_out} bytes of the journal", flush=True)
            now = evidence_of(folder, state) / of_a_scan if list((folder / state).glob("*.tsj")) else 0.0
            # At least the first scan was mapped, and some may have been sent before it was said so.
            gained, bound = now - previous, sent + 5
            if place is not None:
                mapped += 1
                lost = max(0.0, sent + 1 - gained)
                most_lost = max(most_lost, lost / RATE_HZ)
            if gained < -0.01 or gained > bound:
                print(f"kill {kill}: {gained:.1f} scans more in the map, {sent} were sent")
                sys.exit(1)
            previous = now
            sent_while_up += sent
            if kill % 20 == 19:
                print(f"{kill + 1} kills: {in_maps + now:.0f} scans in the maps, at most {most_lost:.1f} s lost, {torn} torn appends, "
                      f"{damaged} starts with damage, {refused} without a map", flush=True)
        sensors.close()
    print(f"{options.kills} kills, {mapped} of them while it mapped: {in_maps + previous:.0f} scans in the maps of {sent_while_up} that were sent "
          f"after each start's first; at most {most_lost:.1f} s lost by a kill")
    sys.exit(1 if refused or damaged or most_lost > STATE_LOSS_S + 1 / RATE_HZ else 0)


if __name__ == "__main__":
    main()
