#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""node_start.py --build FOLDER [--archive BYTES] [--starts N] [--resolution M]: how long does a node take from the start of its process until
the first scan is in its map, if its state has a drive of 1 GiB in submaps?

A node maps a simulated street in submaps. One of the files of its state is copied to as many submaps as make the archive; the next start
writes their frames, and maps the whole street as one submap more. Then the node is started again and again at the street's end, after an
orderly end and after a kill, with the files in the page cache and without them; and with an empty state. Sensors run all the time: clouds
at 10 Hz, poses at 100 Hz. In a network namespace of its own.
"""
import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path += [str(ROOT / "tests/support"), str(ROOT / "tests/cli")]
import own_network  # noqa: E402  after the place of it
from running_node import RunningNode, until, write_config  # noqa: E402

LIMIT_S = 120
REQUIRED_S = 1.0


class Starts:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.state, self.player = folder / "state", None

    def play(self, *scans):
        """Ends what was played before."""
        if self.player and self.player.poll() is None:
            self.player.kill()
            self.player.wait()
        command = [os.environ["TESSERA_COMMAND"], "play", "--dataset", self.folder / "street/robot_0", *map(str, scans)]
        self.player = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def drive(self, config):
        """A node while its robot drives along the street once."""
        node = RunningNode(self.folder, config)
        node.says("mapping: ")
        self.play("--rate", 5)
        node.says("mapping: integrated the first scan", limit_s=LIMIT_S)
        self.player.wait(LIMIT_S)
        return node

    def config(self, name, submap_m, **changes):
        places = {"contributions": 4096, "contributions_per_robot": 4000}
        return write_config(self.folder, name, {
            "robot": {"id": 0, "state": str(self.state)}, "map": {"resolution_m": self.options.resolution, "submap_m": submap_m},
            "sensors": {"points": 150000, "max_pose_gap_ms": 1000, "max_wait_ms": 1000},
            # The robot turns round at once.
            "vehicle": {"pose_timeout_ms": 1000, "max_acceleration_mps2": 1000, "jump_m": 5},
            "network": {"url": "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=400000", "interface": "lo", **places},
            "realtime": {"priority": 0}, "service": {"queries": False}, "output": {"report": f"{name}.json"}}, **changes)

    def node(self, config):
        node = RunningNode(self.folder, config)
        node.says("mapping: integrated the first scan", limit_s=LIMIT_S)
        return node

    def submap(self):
        """A node maps until a submap is in its file. Its path, and the journal after it."""
        node = self.drive(self.config("first", self.options.submap_length))
        until(lambda: sorted(self.state.glob("*.submap-*.tsm")), "a submap in its file", LIMIT_S)
        node.end()
        node.close()
        return sorted(self.state.glob("*.submap-*.tsm"))[-1], sorted(self.state.glob("*.submap-*.tsj"))[-1]

    def make_archive(self):
        """How many submaps, and how many bytes they have."""
        file, journal = self.submap()
        data, stem = file.read_bytes(), re.sub(r"\d+\.tsm$", "", str(file))
        count = -(-self.options.archive // len(data))
        for other in self.state.glob("*.submap-*.ts[mj]"):
            if other != journal:
                other.unlink()
        journal.rename(f"{stem}{count}.tsj")
        for number in range(count):
            pathlib.Path(f"{stem}{number}.tsm").write_bytes(data)
        # Without the frames of before, a start makes them of what it finds.
        for frames in self.state.glob("*.frames"):
            frames.unlink()
        # Its submap does not end meanwhile.
        self.config_of_starts = self.config("start", 100_000)
        node = self.drive(self.config_of_starts)
        kept = node.end()["submaps"]["kept"]
        node.close()
        if len(kept) < count:
            sys.exit(f"{count} submaps were written, and the node has found {len(kept)}: {node.said}")
        # Where the drive has ended.
        self.play("--first", self.options.scans - 3, "--last", self.options.scans - 1, "--loop")
        return len(kept), sum(row["bytes"] for row in kept)

    def forget_pages(self):
        """Of all files of the state; they are read from the disk next time."""
        os.sync()
        for path in self.state.iterdir():
            with open(path, "rb") as file:
                os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)

    @staticmethod
    def processor_ms(node):
        """Of all threads of the process, up to now."""
        words = pathlib.Path(f"/proc/{node.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return 1000 * (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    @staticmethod
    def waited_ms(node):
        """For a processor, of the thread that starts the others, up to now."""
        return 1e-6 * int(pathlib.Path(f"/proc/{node.process.pid}/schedstat").read_text().split()[1])

    def measure(self, before, in_cache):
        """A row for each of several starts."""
        found = []
        for _ in range(self.options.starts):
            if before == "kill":
                node = self.node(self.config_of_starts)
                time.sleep(3)
                node.kill()
                node.close()
            config = self.config_of_starts
            if before == "empty":
                config = self.config("empty", 100_000, robot={"state": str(self.folder / f"empty_{time.monotonic_ns()}")})
            elif not in_cache:
                self.forget_pages()
            journal_bytes = 0 if before == "empty" else sum(path.stat().st_size for path in self.state.glob("*.tsj"))
            begin = time.monotonic()
            node = self.node(config)
            outside_ms, processor_ms, waited_ms = 1000 * (time.monotonic() - begin), self.processor_ms(node), self.waited_ms(node)
            time.sleep(2)
            report = node.end()
            node.close()
            found.append({"first_scan_ms": report["realtime"]["first_scan_ms"], "outside_ms": outside_ms, "processor_ms": processor_ms,
                          "waited_ms": waited_ms, "blocks": report["state"]["resumed_blocks"], "journal_bytes": journal_bytes})
        return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--archive", type=int, default=1 << 30, help="bytes of submaps")
    parser.add_argument("--starts", type=int, default=5, help="of each kind")
    parser.add_argument("--resolution", type=float, default=0.1)
    parser.add_argument("--scans", type=int, default=30, help="of the street, 0.87 m apart")
    parser.add_argument("--submap-length", type=float, default=10.0, help="of the one that is copied, metres")
    parser.add_argument("--out", type=pathlib.Path, help="JSON file to write")
    options = parser.parse_args()
    command = str(options.build.resolve() / "tessera")
    os.environ["TESSERA_COMMAND"] = command
    if not own_network.enter():
        sys.exit("no network namespaces are permitted here (unshare -rn)")
    rows = {}
    with tempfile.TemporaryDirectory(prefix="tessera-start-") as name:
        folder = pathlib.Path(name)
        subprocess.run([command, "simulate", "--robots", "1", "--scans", str(options.scans), "--sweep", "on", "--out", folder / "street"], check=True,
                       capture_output=True)
        starts = Starts(options, folder)
        try:
            count, total = starts.make_archive()
            print(f"{count} submaps, {total / 2**20:.0f} MiB, voxels of {options.resolution:g} m; required {1000 * REQUIRED_S:.0f} ms", flush=True)
            for before, in_cache in (("empty", True), ("end", True), ("end", False), ("kill", True), ("kill", False)):
                row = rows[f"after {before}, {'in the page cache' if in_cache else 'from the disk'}"] = starts.measure(before, in_cache)
                times = {key: sorted(one[key] for one in row) for key in ("first_scan_ms", "outside_ms", "processor_ms", "waited_ms")}
                middle = {key: statistics.median(values) for key, values in times.items()}
                most_mb = max(one["journal_bytes"] for one in row) / 1e6
                print(f"{list(rows)[-1]:32}: first scan in the map after {middle['first_scan_ms']:6.0f} ms ({times['first_scan_ms'][0]:.0f} to "
                      f"{times['first_scan_ms'][-1]:.0f}), from outside {middle['outside_ms']:6.0f} ms, waited for a processor "
                      f"{middle['waited_ms']:5.0f} ms, all threads on processors {middle['processor_ms']:4.0f} ms; "
                      f"{row[-1]['blocks']} blocks continued from a journal of up to {most_mb:.1f} MB; load {os.getloadavg()[0]:.1f}", flush=True)
        finally:
            starts.player.kill()
            starts.player.wait()
    if options.out:
        options.out.write_text(json.dumps(rows, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
