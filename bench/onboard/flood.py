#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""flood.py --tessera FILE --flood FILE [--seconds N] [--out FILE]: what a flood of packets without a valid tag costs a node.

A node that maps a simulated street at 10 Hz is pinned to processor 0, with a fleet key and signatures; a second robot and the flood run on
processor 1. Prints a table. Counted are the datagrams that the second robot sent and that the first one's exchange did not get, mapping cycles,
and the share of a core that the receiving thread takes while the flood lasts. To be run by tests/in-own-network.sh, as root for priorities."""
import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.append(str(ROOT / "tests/support"))

from running_node import until, write_config  # noqa: E402  needs the path above

FLOODS = [("none", None), ("50,000/s of 64 B", ("forged", 64, 50_000)), ("30,000/s of 1,400 B", ("forged", 1400, 30_000)),
          ("69,000/s of 60 B, fragments", ("fragments", 60, 69_000))]
NODE_CPU, FLOOD_CPU = 0, 1
LEAD_S = 4
RESOLUTION_M = 0.1


def tables(robot, street):
    return {"robot": {"id": robot, "state": f"state_{robot}"},
            "replay": {"dataset": f"{street}/robot_{robot}", "rate_hz": 10, "loop": True},
            "map": {"resolution_m": RESOLUTION_M, "max_range_m": 40.0},
            "network": {"url": "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304", "interface": "lo", "status": False},
            "security": {"fleet_key": "fleet.key", "robot_secret": f"robot_{robot}.key", "robot_public_keys": "fleet.pub"},
            "realtime": {"priority": 40 if robot == 0 else 0, "lock_memory": robot == 0},
            "output": {"report": f"robot_{robot}.json"}}


class Robot:
    def __init__(self, tessera, folder, number, street, cpu):
        config = write_config(folder, f"robot_{number}", tables(number, street))
        self.report_path = folder / f"robot_{number}.json"
        self.said = open(folder / f"robot_{number}.log", "w+", encoding="utf-8")
        self.process = subprocess.Popen(["taskset", "-c", str(cpu), tessera, "node", "--config", str(config)], cwd=folder,
                                        stdout=subprocess.DEVNULL, stderr=self.said)
        # It listens before it locks its state.
        until((folder / f"state_{number}/robot_{number}.lock").exists, f"robot {number} starts")

    def thread_cpu_s(self, name):
        for task in pathlib.Path(f"/proc/{self.process.pid}/task").iterdir():
            if (task / "comm").read_text().strip() == name:
                return int((task / "schedstat").read_text().split()[0]) * 1e-9
        raise RuntimeError(f"no thread named {name}")

    def end(self):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(timeout=60)
        self.said.seek(0)
        return json.loads(self.report_path.read_text()), self.said.read()

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.said.close()


def run(arguments, street, keys, kind):
    with tempfile.TemporaryDirectory(prefix="tessera-flood-") as name:
        folder = pathlib.Path(name)
        for key in keys.iterdir():
            (folder / key.name).write_bytes(key.read_bytes())
            (folder / key.name).chmod(0o600)
        robots = []
        try:
            for number, cpu in ((0, NODE_CPU), (1, FLOOD_CPU)):
                robots.append(Robot(arguments.tessera, folder, number, street, cpu))
            time.sleep(LEAD_S)
            before_s, start = robots[0].thread_cpu_s("tessera-link"), time.monotonic()
            sent = {"sent": 0, "per_s": 0}
            if kind is None:
                time.sleep(arguments.seconds)
            else:
                done = subprocess.run(["taskset", "-c", str(FLOOD_CPU), "chrt", "-f", "30", arguments.flood, *map(str, kind),
                                       str(arguments.seconds)], check=True, capture_output=True, text=True)
                sent = json.loads(done.stdout)
            share = (robots[0].thread_cpu_s("tessera-link") - before_s) / (time.monotonic() - start)
            honest, _ = robots[1].end()
            time.sleep(0.5)
            node, said = robots[0].end()
        finally:
            for robot in robots:
                robot.close()
    link, mapping, exchange = node["link"], node["mapping"], node["exchange"]
    # A version whose link checks no tag leaves that to the exchange.
    received = exchange["received"] - exchange["refused_tag"] - exchange["refused_format"] - exchange["refused_size"]
    return {"flood": sent, "link_share": share, "honest_sent": honest["link"]["sent"], "honest_received": received,
            "honest_missing": honest["link"]["sent"] - received,
            "link": link, "cycles": mapping["cycles"], "missed": mapping["missed"], "cycle_times": mapping["cycle_times"],
            "overruns": node["ticks"]["overruns"], "lines": [line for line in said.splitlines() if "warning" in line]}


def make_keys(tessera, folder):
    def key(*words):
        subprocess.run([tessera, "key", "new", *words], cwd=folder, check=True, capture_output=True)
    key("--fleet", "fleet.key")
    for robot in (0, 1):
        key("--robot", str(robot), "--dir", ".")
    (folder / "fleet.pub").write_text("".join((folder / f"robot_{robot}.pub").read_text() for robot in (0, 1)))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tessera", required=True, type=os.path.abspath)
    parser.add_argument("--flood", required=True, type=os.path.abspath)
    parser.add_argument("--seconds", type=int, default=20)
    parser.add_argument("--out", type=pathlib.Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="tessera-flood-street-") as name:
        folder = pathlib.Path(name)
        (folder / "keys").mkdir()
        make_keys(arguments.tessera, folder / "keys")
        subprocess.run([arguments.tessera, "simulate", "--scans", "40", "--seed", "1", "--out", folder / "street"], check=True,
                       capture_output=True)
        results = {}
        print("| flood | packets a second | honest sent | missing | dropped by the kernel | queue full | mapping cycle p99, max, ms "
              "| missed | link thread, of a core |")
        print("|---|---|---|---|---|---|---|---|---|", flush=True)
        for title, kind in FLOODS:
            r = results[title] = run(arguments, folder / "street", folder / "keys", kind)
            times, link = r["cycle_times"], r["link"]
            print(f"| {title} | {r['flood']['per_s']:,.0f} | {r['honest_sent']} | {r['honest_missing']} | {link['kernel_dropped']} "
                  f"| {link['queue_full']} | {times['p99_ms']:.0f}, {times['max_ms']:.0f} | {r['missed']} of {r['cycles']} "
                  f"| {r['link_share']:.2f} |", flush=True)
            for line in r["lines"]:
                print("    " + line, file=sys.stderr)
    if arguments.out:
        arguments.out.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
