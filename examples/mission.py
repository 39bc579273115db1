#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""mission.py TESSERA STREET OUT [RATE_HZ]: robots in a street, each with its own process on this machine.

A player for each robot replaces its LiDAR, its cameras and its localisation: it sends its measurements over the local
network to the robot's node, which labels the points by the cameras, maps them and shares its map with the other nodes
over multicast. If there is a virtual CAN interface, poses are sent over it as by a vehicle. Ends when all nodes have
everything; writes their maps, reports and logs into OUT. With fewer than 10 scans per second it plays in slow motion.
"""
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time

READY_S, END_S = 30, 150

CONFIG = """\
[robot]
id = {robot}
state = "state"
T_global_map = "{data}/T_global_map.txt"
[sensors]
url = "{url}"
interface = "lo"
clouds = "raw"
cameras = "{data}/cameras.toml"
poses = "{poses}"
max_wait_ms = {max_wait_ms}
max_image_offset_ms = {max_image_offset_ms}
[mapping]
period_ms = {period_ms}
[map]
deadline_ms = {deadline_ms}
{vehicle}[service]
queries = false
[network]
url = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
interface = "lo"
[security]
fleet_key = "fleet.key"
robot_secret = "robot_{robot}.key"
robot_public_keys = "fleet.pub"
[output]
global_map = "global_of_{robot}.tsm"
report = "robot_{robot}.json"
{snapshots}[run]
wait_for_peers = {peers}
silence_s = 2
quiet_s = 3
"""


def can_interface():
    """A virtual bus that is up, or None."""
    shown = subprocess.run(["ip", "-o", "link", "show", "up", "type", "vcan"], capture_output=True, text=True, check=False)
    return shown.stdout.split(":")[1].strip().split("@")[0] if shown.returncode == 0 and shown.stdout else None


def sensor_url(robot):
    return f"udpm://239.255.76.68:{7668 + robot}?ttl=0&recv_buf_size=8388608"


def base_id(robot):
    """Base identifier of its messages on the bus."""
    return 0x100 + 0x20 * robot


def write_config(out, robot, peers, data, can, rate_hz):
    period_ms = round(1000 / rate_hz)
    (out / f"robot_{robot}.toml").write_text(CONFIG.format(
        robot=robot, peers=peers, data=data, url=sensor_url(robot), poses="can" if can else "lcm", period_ms=period_ms,
        # All robots and the players of their sensors share one computer here.
        deadline_ms=0.8 * period_ms,
        # A sweep ends half a period after its stamp, images are within half a period of it.
        max_wait_ms=period_ms, max_image_offset_ms=period_ms / 2,
        vehicle=f'[vehicle]\ncan = "{can}"\nbase_id = {base_id(robot)}\n' if can else "",
        # Only of one robot, as each snapshot takes part of a tick.
        snapshots='snapshots = "growing"\nsnapshot_every_s = 0.5\n' if robot == 0 else ""))


def start_node(tessera, out, robot):
    """Starts a node and waits until it reports that it is ready, as to systemd."""
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notices:
        notices.bind(f"{folder}/notify")
        notices.settimeout(1)
        with open(out / f"robot_{robot}.log", "w", encoding="utf-8") as log:
            node = subprocess.Popen([tessera, "node", "--config", f"robot_{robot}.toml"], cwd=out, stdout=log, stderr=log,
                                    stdin=subprocess.DEVNULL, env={**os.environ, "NOTIFY_SOCKET": f"{folder}/notify"})
        for _ in range(READY_S):
            try:
                if b"READY=1" in notices.recv(4096):
                    return node
            except TimeoutError:
                pass
            if node.poll() is not None:
                break
    end([node])
    sys.exit(f"the node of robot {robot} did not start: " + (out / f"robot_{robot}.log").read_text().strip())


def start_player(tessera, out, robot, data, can, rate_hz):
    words = ["--poses", "can", "--can", can, "--can-base", str(base_id(robot))] if can else []
    with open(out / f"player_{robot}.log", "w", encoding="utf-8") as log:
        return subprocess.Popen([tessera, "play", "--dataset", data, "--messages", "raw", "--url", sensor_url(robot), "--rate", str(rate_hz), *words],
                                stdout=log, stderr=log, stdin=subprocess.DEVNULL)


def end(processes):
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.wait()


def wait(process, name, log, deadline):
    try:
        if process.wait(timeout=max(1.0, deadline - time.monotonic())) == 0:
            return
    except subprocess.TimeoutExpired:
        sys.exit(f"the {name} did not end; see {log}")
    sys.exit(f"the {name} stopped: " + log.read_text().strip())


def main():
    tessera, street, out = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
    rate_hz = float(sys.argv[4]) if len(sys.argv) > 4 else 3.0
    can = can_interface()
    print(f"Poses go over the CAN interface {can}." if can else "Poses go over LCM: no virtual CAN interface is up.")
    data = {int(path.name.removeprefix("robot_")): path for path in sorted(street.glob("robot_?"))}
    running = []
    try:
        nodes, players = {}, {}
        for robot in data:
            write_config(out, robot, len(data) - 1, data[robot], can, rate_hz)
            nodes[robot] = start_node(tessera, out, robot)
            running.append(nodes[robot])
        for robot in data:
            players[robot] = start_player(tessera, out, robot, data[robot], can, rate_hz)
            running.append(players[robot])
        deadline = time.monotonic() + END_S
        for robot in data:
            wait(players[robot], f"player of robot {robot}", out / f"player_{robot}.log", deadline)
        for robot in data:
            wait(nodes[robot], f"node of robot {robot}", out / f"robot_{robot}.log", deadline)
    finally:
        end(running)


if __name__ == "__main__":
    main()
