#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""measure.py --build DIR --out DIR [--dataset DIR] [--quick]: what a team costs, by its size and by what is lost, as
OUT/team.json."""
import argparse
import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path += [str(ROOT / "tests/processes"), str(ROOT / "bench")]

import network_space  # noqa: E402  these need the path above
import sources  # noqa: E402
from team import Member  # noqa: E402

SIZES = (2, 3, 4, 8)
SIMULATED_SIZES = (2, 3, 4, 8, 16, 32, 64)
LOSSES = (0.0, 0.01, 0.1, 0.3, 0.7)
LOSS = 0.02
BLOCKS_PER_S = 20
SETTLE_LIMIT_S = 60


def settle(members):
    end = time.monotonic() + SETTLE_LIMIT_S
    while time.monotonic() < end:
        reports = [member.report() for member in members]
        if len({report["content"] for report in reports}) == 1 and all(r["complete"] == r["known"] for r in reports):
            return
        time.sleep(0.2)
    raise RuntimeError(f"a team does not agree after {SETTLE_LIMIT_S} s")


def rates(before, after):
    """Means over the robots, a second, between two reports of each."""
    spans = [b["now_s"] - a["now_s"] for a, b in zip(before, after)]

    def mean(key):
        return sum((b[key] - a[key]) / span for a, b, span in zip(before, after, spans)) / len(spans)
    return {"bytes": mean("wire_bytes"), "heard_bytes": mean("heard_bytes"), "cpu": mean("cpu_s")}


def in_namespaces(robots, publish_s, rest_s):
    """A team of processes that publish for so long, and then rest."""
    network = network_space.Network(robots)
    members = []
    try:
        network.shape_all(loss_percent=round(100 * LOSS))
        for host in range(robots):
            members.append(Member(network, host, blocks=1_000_000, blocks_per_s=BLOCKS_PER_S))
        time.sleep(1.0)
        before = [member.report() for member in members]
        time.sleep(publish_s)
        after = [member.report() for member in members]
        for member in members:
            member.close()
        members = [Member(network, host, session=2, blocks=100, blocks_per_s=BLOCKS_PER_S) for host in range(robots)]
        time.sleep(100 / BLOCKS_PER_S)
        settle(members)
        time.sleep(1.0)
        rest_before = [member.report() for member in members]
        time.sleep(rest_s)
        rest_after = [member.report() for member in members]
    finally:
        for member in members:
            member.close()
        network.close()
    return {"robots": robots, "publishing": rates(before, after), "at_rest": rates(rest_before, rest_after)}


def costs(build, *arguments):
    """What a simulated team costs."""
    done = subprocess.run([build / "tests/network/team_costs", *map(str, arguments)], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def scene(build, out, dataset):
    """A title, and what team_costs needs to publish each block of three robots' maps once, and to drive along the scans."""
    if dataset:
        title, stretches = "SemanticKITTI 08, scans 0-1, 2-3 and 4-5, 0.1 m", [(dataset, 2 * robot, 2 * robot + 1) for robot in range(3)]
    else:
        dataset = out / "street" / "robot_0"
        if not dataset.exists():
            subprocess.run([build / "tessera", "simulate", "--scene", "street", "--robots", "1", "--scans", "12", "--seed", "1",
                            "--out", out / "street"], check=True, capture_output=True)
        title, stretches = "simulated street, 4 scans each, 0.1 m", [(dataset, 4 * robot, 4 * robot + 3) for robot in range(3)]
    once = ["--seconds", 10]
    for robot, (folder, first, last) in enumerate(stretches):
        path = out / f"robot_{robot}.tsm"
        subprocess.run([build / "tessera", "map", "--dataset", folder, "--first", str(first), "--last", str(last), "--robot",
                        str(robot), "--out", path], check=True, capture_output=True)
        once += ["--map", path]
    return title, {"once": once, "drive": ["--dataset", dataset, "--scan-ms", 1000]}


def cpu_name():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--dataset", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    network_space.enter("nft")
    build = options.build.resolve()
    os.environ["TESSERA_MEMBER"] = str(build / "tests/processes/team_member")
    publish_s, rest_s = (2, 2) if options.quick else (10, 10)
    found = {"circumstances": {"cpu": cpu_name(), "cores": os.cpu_count(), "commit": sources.commit(),
                               "date": datetime.date.today().isoformat(), "load": os.getloadavg()[0]},
             "loss": LOSS, "blocks_per_s": BLOCKS_PER_S, "namespaces": [], "simulated": [], "by_loss": {}}
    for robots in SIZES[:2] if options.quick else SIZES:
        print(f"{robots} robots in namespaces", flush=True)
        found["namespaces"].append(in_namespaces(robots, publish_s, rest_s))
    for robots in SIMULATED_SIZES[:4] if options.quick else SIMULATED_SIZES:
        print(f"{robots} simulated robots", flush=True)
        found["simulated"].append(costs(build, "--robots", robots, "--loss", LOSS, "--blocks-per-s", BLOCKS_PER_S))
    found["scene"], workloads = scene(build, options.out, options.dataset)
    for name, words in workloads.items():
        found["by_loss"][name] = []
        for loss in LOSSES[:4] if options.quick else LOSSES:
            print(f"{name}: loss of {loss:.0%} on every link", flush=True)
            found["by_loss"][name].append(costs(build, *words, "--loss", loss, "--rest", 1))
    (options.out / "team.json").write_text(json.dumps(found, indent=1) + "\n")


main()
