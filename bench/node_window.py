#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""node_window.py --build FOLDER --drive FOLDER [--resolution M] [--memory SIZE] [--window M] [--rate HZ] [--out FILE]: a node
drives along a way and back again in little memory, with a window and an archive.

The drive is a folder with velodyne/ and poses.txt, unlabelled: its scans are given in their order, and then backwards with the same
poses. Compared with the same node and with tessera map, in 512 MiB without a window: digests of the whole maps (archive and window as
one), and what each has left out. Fails if a node that may wait (rate_hz = 0) has another digest or has left out anything. The same with
a rate, at which a node never waits, is shown beside it. In a network namespace of its own; some minutes.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import markdown

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path += [str(ROOT / "tests/support"), str(ROOT / "tests/cli")]
import own_network  # noqa: E402  after the place of it
from running_node import write_config  # noqa: E402

AMPLE = "512M"
HEAD = ("run", "memory", "left out", "digest", "left the window, of these within it", "came back", "reached at the end, m", "waited, s", "took, s")


def there_and_back(drive, folder):
    """The scans of a drive, and the same backwards."""
    scans = sorted((drive / "velodyne").glob("*.bin"))
    rows = (drive / "poses.txt").read_text().splitlines()
    order = [*range(len(scans)), *range(len(scans) - 2, -1, -1)]
    (folder / "velodyne").mkdir(parents=True)
    for number, scan in enumerate(order):
        (folder / "velodyne" / f"{number:06d}.bin").symlink_to(scans[scan])
    (folder / "poses.txt").write_text("".join(rows[scan] + "\n" for scan in order))


class Runs:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.command = options.build.resolve() / "tessera"
        self.rows = []

    def finished(self, name, *arguments):
        """The report of a run, and how long it took."""
        start = time.monotonic()
        done = subprocess.run([self.command, *map(str, arguments)], cwd=self.folder, text=True, capture_output=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{name} ended with {done.returncode}: {done.stderr}")
        return json.loads((self.folder / f"{name}.json").read_text()), time.monotonic() - start

    def add(self, name, memory, digest, left_out, window, waited_ms, seconds):
        window = window or {}
        reach_m = window.get("reach_blocks", 0) * 8 * self.options.resolution
        self.rows.append({"run": name, "memory": memory, "digest": digest, "left_out": left_out, "window": window, "waited_s": 1e-3 * waited_ms,
                          "reach_m": reach_m, "seconds": seconds})
        return digest, left_out

    def map(self, name, memory, *window):
        report, seconds = self.finished(name, "map", "--dataset", "data", "--labels", "none", "--resolution", self.options.resolution, "--memory",
                                        memory, *window, "--out", f"{name}.tsm", "--report", f"{name}.json")
        return self.add(name, memory, report["digest"], report["totals"]["left_out"], report.get("window"), 0, seconds)

    def node(self, name, memory, rate_hz=0, **window):
        config = write_config(self.folder, name, {
            "robot": {"id": 0, "state": f"{name}_state"},
            "replay": {"dataset": "data", "labels": "none", "rate_hz": rate_hz},
            "map": {"resolution_m": self.options.resolution, "memory": memory, **window},
            "network": {"url": "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=400000", "interface": "lo"},
            "realtime": {"priority": 0, "lock_memory": False}, "service": {"queries": False},
            "output": {"local_map": f"{name}.tsm", "report": f"{name}.json"},
            "run": {"wait_for_peers": 0, "quiet_s": 0.5, "linger_s": 2}})
        report, seconds = self.finished(name, "node", "--config", config)
        return self.add(name, memory, report["local_digest"], report["scans"]["left_out"], report.get("window"), report["mapping"]["waited_ms"],
                        seconds)

    def table(self):
        return markdown.table(HEAD, [
            (row["run"], row["memory"], f"{row['left_out']:,}", row["digest"],
             f"{row['window'].get('evicted', 0):,}, {row['window'].get('near_evicted', 0):,}", f"{row['window'].get('reloaded', 0):,}",
             f"{row['reach_m']:.0f}" if row["window"] else "all", f"{row['waited_s']:.1f}", f"{row['seconds']:.1f}") for row in self.rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--drive", type=lambda path: pathlib.Path(path).resolve(), required=True)
    parser.add_argument("--resolution", type=float, default=0.1)
    parser.add_argument("--memory", default="64M")
    parser.add_argument("--window", type=float, default=45.0)
    parser.add_argument("--rate", type=float, default=1.0, help="of the node that does not wait, Hz; 0: without it")
    parser.add_argument("--out", type=pathlib.Path, help="JSON file to write")
    options = parser.parse_args()
    out = options.out.resolve() if options.out else None
    if not own_network.enter():
        sys.exit("no network namespaces are permitted here (unshare -rn)")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        there_and_back(options.drive, folder / "data")
        runs = Runs(options, folder)
        window = {"window_m": options.window, "archive": "spill"}
        bounded = runs.node("node-window", options.memory, **window)
        wholes = [runs.node("node", AMPLE), runs.map("map", AMPLE)]
        runs.map("map-window", options.memory, "--window", options.window, "--archive", "map_spill")
        if options.rate > 0:
            runs.node(f"node-window-{options.rate:g}-hz", options.memory, options.rate, **window)
    print(runs.table())
    if out:
        out.write_text(json.dumps(runs.rows, indent=1) + "\n")
    return 0 if all(bounded == whole for whole in wholes) and bounded[1] == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
