# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The robots of soak_nodes.py: hosts in network namespaces, each with a node, a player of a simulated street as its sensors, and a pose
graph that corrects its submaps; and what is measured of a process from outside."""
import csv
import json
import math
import os
import pathlib
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path += [str(ROOT / "tests" / folder) for folder in ("support", "processes", "attacks", "wire")]
import network_space  # noqa: E402  after the place of it
from attacker import Attacker, end_listening, inside, payloads  # noqa: E402
from running_node import RunningNode, until, write_config  # noqa: E402

ROBOTS = 3
LISTENER = ROBOTS  # The host that hears the statuses.
RATE_HZ = 2.0
THINNED_TO = 1 / 24  # Of the points of a scan, to be cheap.
SPEED_MPS = 1.74  # That the street's robots have at this rate: 0.87 m a scan.
RESOLUTION_M, RANGE_M = 0.5, 15.0
STALENESS_S, FREE_STALENESS_S = 4.0, 8.0  # Longer than usual, to be cheap.
SENSOR_GROUP = ("239.255.76.68", 7668)
CORRECTION = (0xDACC29DEE3F745CD << 1 | 1) & (1 << 64) - 1  # Its fingerprint, as lcm-gen makes it of lcmtypes/.
CHANNEL = b"TESSERA_STATUS\0"
OWN_COUNTERS_AT = 436 - 8 * 9  # Of a status.
JITTER_M, JITTER_RAD = 0.02, 0.001  # Of a corrected frame.
LIMIT_S = 120  # For what a busy machine does at last.


def make_street(command, folder, scans):
    """A thinned dataset for each robot."""
    subprocess.run([command, "simulate", "--robots", str(ROBOTS), "--scans", str(scans), "--seed", "1", "--out", folder / "whole"], check=True,
                   capture_output=True)
    step = round(1 / THINNED_TO)
    for robot in range(ROBOTS):
        whole, thinned = folder / f"whole/robot_{robot}", folder / f"robot_{robot}"
        shutil.copytree(whole, thinned, ignore=shutil.ignore_patterns("velodyne", "labels", "predictions"))
        for name, size in (("velodyne", 16), ("predictions", 4)):
            (thinned / name).mkdir()
            for path in (whole / name).iterdir():
                data = path.read_bytes()
                (thinned / name / path.name).write_bytes(b"".join(data[i:i + size] for i in range(0, len(data), size * step)))
    shutil.rmtree(folder / "whole")


def label_evidence(command, folder, map_file):
    """The sum of all labels' evidence in a map."""
    subprocess.run([command, "export", "--map", map_file, "--voxels", "observed", "--out", folder / "voxels.csv"], check=True, capture_output=True)
    with open(folder / "voxels.csv") as file:
        rows = csv.reader(file)
        first = next(rows).index("sigma_1")
        return sum(float(value) for row in rows for value in row[first:] if value != "0")


def evidence_of_a_scan(command, folder, robot):
    """On average over a pass along the street."""
    report = folder / "pass.json"
    subprocess.run([command, "map", "--dataset", folder / f"robot_{robot}", "--resolution", str(RESOLUTION_M), "--max-range", str(RANGE_M),
                    "--max-evidence", "0", "--memory", "64M", "--out", folder / "pass.tsm", "--report", report], check=True, capture_output=True)
    return label_evidence(command, folder, folder / "pass.tsm") / json.loads(report.read_text())["totals"]["scans"]


def figures_of(pid):
    """Descriptors, threads and resident KiB of a process; None if it is gone. A file that is just being written is no leak: the least
    of some samples counts."""
    found = []
    for _ in range(10):
        try:
            descriptors, threads = (len(os.listdir(f"/proc/{pid}/{what}")) for what in ("fd", "task"))
            # VmRSS of status may lag behind by some pages a processor.
            rollup = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
        except OSError:
            return None
        found.append((descriptors, threads, int(re.search(r"Rss:\s+(\d+)", rollup)[1])))
        time.sleep(0.02)
    return tuple(map(min, zip(*found)))


class Statuses:
    """What the nodes say of themselves once a second, as it is heard on a host of its own."""

    def __init__(self, network):
        self.last = {}
        self.socket = inside(network, LISTENER, lambda: Attacker.open(network.address(LISTENER)))
        self.listener = threading.Thread(target=self.listen, daemon=True)
        self.listener.start()

    def listen(self):
        for data in payloads(self.socket, CHANNEL):
            robot, = struct.unpack_from(">i", data, 12)
            scans, contributions, whole, overruns, waiting = struct.unpack_from(">5q", data, OWN_COUNTERS_AT)
            before = self.last.get(robot)
            digest = data[80:88].hex()
            self.last[robot] = {"digest": digest, "scans": scans, "contributions": contributions, "whole": whole, "overruns": overruns,
                                "waiting": waiting, "heard": time.monotonic(), "is_still": before is not None and before["digest"] == digest}

    def agree(self, since):
        found = [self.last.get(robot) for robot in range(ROBOTS)]
        return (all(one and one["heard"] > since and one["is_still"] and one["waiting"] == 0 and one["whole"] == one["contributions"]
                    for one in found) and len({one["digest"] for one in found}) == 1)

    def close(self):
        end_listening(self.socket, self.listener)


class Robot:
    """A host of the network, with its node, which may be down, and its sensors, which go on."""

    def __init__(self, network, number, folder, options):
        self.network, self.number, self.folder, self.command = network, number, folder, options.command
        self.node, self.begun_s, self.started_s, self.settled, self.player = None, 0.0, 0.0, None, None
        self.kills = self.corrections = 0
        self.up_s, self.logs = 0.0, []
        self.dataset = folder / f"robot_{number}"
        network_space.run("ip", "-netns", network.name(number), "link", "set", "lo", "multicast", "on")
        self.to_sensors = inside(network, number, self.open_sender)
        most_s = 60 * options.minutes + 600
        self.config = write_config(folder, f"node_{number}", {
            "robot": {"id": number, "state": f"state_{number}", "T_global_map": str(self.dataset / "T_global_map.txt")},
            "sensors": {"points": 20000, "max_pose_gap_ms": 2000, "max_wait_ms": 2000}, "vehicle": {"pose_timeout_ms": 2000},
            "map": {"resolution_m": RESOLUTION_M, "max_range_m": RANGE_M, "max_evidence": 0, "memory": "48M", "submap_m": options.submap_length},
            "network": {"url": "udpm://239.255.76.67:7667?ttl=1&recv_buf_size=400000", "interface": "eth0"},
            "publish": {"blocks": 16384, "staleness_s": STALENESS_S, "free_staleness_s": FREE_STALENESS_S},
            "fusion": {"memory": options.fusion_memory, "diffusion": "none"},
            "realtime": {"priority": 0, "lock_memory": True}, "service": {"queries": False},
            "output": {"global_map": f"node_{number}.global.tsm", "report": f"node_{number}.json", "keep_maps": False},
            "run": {"duration_s": most_s}})

    @staticmethod
    def open_sender():
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        return opened

    def play(self):
        command = [*self.network.inside(self.number), self.command, "play", "--dataset", self.dataset, "--loop", "--rate", str(RATE_HZ)]
        self.player = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def start(self):
        self.settled = None
        self.node = RunningNode(self.folder, self.config, *self.network.inside(self.number))
        self.begun_s = self.started_s = time.monotonic()

    def kill(self):
        self.node.kill()
        self.kills += 1
        self.put_away()

    def put_away(self):
        self.count_time()
        self.node.close()
        self.logs.append(self.node.said)
        self.node = None

    def count_time(self):
        """Adds up how long a node has run while its sensors sent."""
        now_s = time.monotonic()
        self.up_s += now_s - self.begun_s if self.player.poll() is None else 0.0
        self.begun_s = now_s

    def settle(self):
        """Notes the figures of a process that has mapped for half a minute."""
        if self.node and not self.settled and "integrated the first scan" in self.node.said and time.monotonic() - self.started_s > 30:
            self.settled = figures_of(self.node.process.pid)

    def figures(self):
        return figures_of(self.node.process.pid) if self.node else None

    def state(self):
        """Of mapping, as the log has it last."""
        if not self.node:
            return "down"
        words = re.findall(r"mapping: (paused, reasons \d+|resumes|integrated the first scan)", self.node.said)
        return {"resumes": "maps", "integrated the first scan": "maps"}.get(words[-1], words[-1]) if words else "starts"

    def kept(self):
        """Numbers of the submaps that are in their files."""
        names = (re.search(r"submap-(\d+)\.tsm$", path.name) for path in (self.folder / f"state_{self.number}").glob("*.tsm"))
        return sorted(int(found[1]) for found in names if found)

    def correct(self, chance):
        """New frames of all kept submaps, some centimetres from where they began."""
        kept = self.kept()
        if not kept or not self.node or self.state() != "maps":
            return
        self.corrections += 1
        count = len(kept)
        places = [chance.gauss(0.0, JITTER_M) for _ in range(3 * count)]
        rotations = [value for yaw in (chance.gauss(0.0, JITTER_RAD) for _ in kept) for value in (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))]
        message = struct.pack(f">4i{count}q{9 * count}d", self.number, self.corrections, 1, count, *kept, *places, *rotations, *[-1.0] * (2 * count))
        self.to_sensors.sendto(b"LC02" + struct.pack(">I", self.corrections) + b"TESSERA_CORRECTION\0" + struct.pack(">Q", CORRECTION) + message,
                               SENSOR_GROUP)

    def link(self, state):
        """Pulls the cable, or plugs it in."""
        network_space.run("ip", "link", "set", f"port{self.number}", state)

    def stop_player(self):
        self.count_time()
        self.player.terminate()
        _, error = self.player.communicate(timeout=LIMIT_S)
        return error

    def end(self):
        """Its report."""
        self.node.process.send_signal(signal.SIGTERM)
        self.node.process.wait(timeout=LIMIT_S)
        self.node.reader.join(LIMIT_S)
        status = self.node.process.returncode
        self.put_away()
        if status != 0:
            raise RuntimeError(f"node {self.number} ended with {status}: {self.logs[-1]}")
        return json.loads(self.config.with_suffix(".json").read_text())

    def evidence(self):
        """Of all submaps, as the state has them."""
        state = self.folder / f"state_{self.number}"
        return sum(label_evidence(self.command, self.folder, path) for path in sorted(state.glob("*.submap-*.ts[mj]")))

    def close(self):
        for process in (self.player, self.node and self.node.process):
            if process and process.poll() is None:
                process.kill()
                process.wait(LIMIT_S)
        self.to_sensors.close()


__all__ = ["FREE_STALENESS_S", "RATE_HZ", "ROBOTS", "SPEED_MPS", "Robot", "Statuses", "evidence_of_a_scan", "label_evidence", "make_street",
           "network_space", "until"]
