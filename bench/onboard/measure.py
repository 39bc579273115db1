#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""measure.py --tessera COMMAND --seconds N --out DIR: a node as on a robot, with the recorded traffic of two peers coming in.
Writes DIR/onboard.json. To be run in a network of its own (run-onboard.sh)."""
import argparse
import json
import pathlib
import shutil
import signal
import subprocess
import sys
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from run import circumstances  # noqa: E402  needs the path above

URL = "udpm://239.255.76.67:7667?ttl=0"
SENSORS = "udpm://239.255.76.68:766{}?ttl=0&recv_buf_size=8388608"
SCANS = 60
RATE_HZ = 10
SAMPLE_S = 10


def resident_bytes(process):
    with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
        return next(1024 * int(line.split()[1]) for line in status if line.startswith("VmRSS:"))


def toml(path, tables):
    lines = []
    for table, keys in tables.items():
        lines.append(f"[{table}]")
        lines += [f"{key} = {json.dumps(value)}" for key, value in keys.items()]
    path.write_text("\n".join(lines) + "\n")


def tables(robot, street, seconds, **more):
    return {
        "robot": {"id": robot, "state": "state", "T_global_map": f"{street}/robot_{robot}/T_global_map.txt"},
        "network": {"url": URL + "&recv_buf_size=4194304", "interface": "lo"},
        "map": {"memory": "128M", **more.pop("map", {})},
        "fusion": {"memory": "192M"},
        "output": {"report": f"robot_{robot}.json"},
        "run": {"duration_s": seconds, "wait_for_peers": 0},
        **more,
    }


class Bench:
    def __init__(self, tessera, seconds, out):
        self.tessera = str(pathlib.Path(tessera).resolve())
        self.seconds = seconds
        self.out = pathlib.Path(out).resolve()
        self.street = self.out / "street"
        self.processes = []

    def start(self, *command, **options):
        process = subprocess.Popen([str(word) for word in command], cwd=self.out, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   **options)
        self.processes.append(process)
        return process

    def end_all(self):
        for process in self.processes:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                process.wait(timeout=60)

    def simulate(self):
        if not (self.street / "robot_2/poses.txt").exists():
            subprocess.run([self.tessera, "simulate", "--robots", "3", "--scans", str(SCANS), "--seed", "1", "--out", str(self.street)],
                           check=True, stdout=subprocess.DEVNULL)

    def record(self):
        """What two peers say while they map for as long as is measured."""
        log = self.out / "peers.lcm"
        log.unlink(missing_ok=True)
        logger = self.start("lcm-logger", "--quiet", "-f", "--lcm-url", URL, "-c", "TESSERA", log)
        time.sleep(0.5)
        for robot in (1, 2):
            path = self.out / f"robot_{robot}.toml"
            toml(path, tables(robot, self.street, self.seconds,
                              replay={"dataset": f"{self.street}/robot_{robot}", "rate_hz": RATE_HZ / 2, "loop": True}))
            self.start(self.tessera, "node", "--config", path, stderr=subprocess.DEVNULL)
        for process in self.processes[-2:]:
            process.wait(timeout=self.seconds + 120)
        logger.send_signal(signal.SIGTERM)
        logger.wait(timeout=30)
        return log

    def measure(self, log, name, **changes):
        path = self.out / f"{name}.toml"
        shutil.rmtree(self.out / "state", ignore_errors=True)
        found = tables(0, self.street, self.seconds, sensors={"url": SENSORS.format(8)}, realtime={"priority": 40, "lock_memory": True},
                       **changes)
        found["output"] = {"report": f"{name}.json"}
        toml(path, found)
        # Sensors run already when a robot's computer starts.
        self.start(self.tessera, "play", "--dataset", self.street / "robot_0", "--url", SENSORS.format(8), "--interface", "lo", "--rate",
                   RATE_HZ, "--loop", stderr=subprocess.DEVNULL)
        time.sleep(2)
        node = self.start(self.tessera, "node", "--config", path, stderr=subprocess.DEVNULL)
        self.start("lcm-logplayer", "--lcm-url", URL, log, stderr=subprocess.DEVNULL)
        resident = []
        for _ in range(self.seconds // SAMPLE_S - 1):
            time.sleep(SAMPLE_S)
            resident.append(resident_bytes(node))
        node.wait(timeout=self.seconds + 120)
        self.end_all()
        report = json.loads((self.out / f"{name}.json").read_text())
        report["resident_bytes_each_10_s"] = resident
        return report


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tessera", required=True)
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    bench = Bench(arguments.tessera, arguments.seconds, arguments.out)
    bench.out.mkdir(parents=True, exist_ok=True)
    try:
        bench.simulate()
        print(f"recording two peers for {arguments.seconds} s", file=sys.stderr)
        log = bench.record()
        runs = {}
        for name, changes in (("55 ms", {}), ("half of it", {"map": {"deadline_ms": 27.5}}), ("none", {"map": {"deadline_ms": 0}})):
            print(f"measuring with a deadline of {name} for {arguments.seconds} s", file=sys.stderr)
            runs[name] = bench.measure(log, name.replace(" ", "_"), **changes)
    finally:
        bench.end_all()
    found = {"circumstances": circumstances(), "seconds": arguments.seconds, "runs": runs}
    (bench.out / "onboard.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
