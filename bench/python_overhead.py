#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""python_overhead.py --build FOLDER [--dataset FOLDER] [--pairs N]: what integrating a full scan from Python takes beyond the
same call in C++.

Both integrate the same scan into an emptied map with the same settings, in turns on one processor, which of them first changing
from pair to pair; the figures are medians of the pairs' ratios, by the clock and by the processor's time, which is less disturbed
by what else runs. Without a data set the scan is simulated. Run it with the Python that the module is for."""
import argparse
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time


def first_scan(options, folder):
    """A data set's folder with at least one scan."""
    if options.dataset:
        return options.dataset
    subprocess.run([options.build / "tessera", "simulate", "--robots", "1", "--scans", "1", "--out", folder / "street"], check=True,
                   capture_output=True)
    return folder / "street" / "robot_0"


def measure(tessera, np, options, folder, scan, free_space):
    (folder / "points").write_bytes(np.ascontiguousarray(scan.points).tobytes())
    (folder / "components").write_bytes(scan.components.tobytes())
    program = [options.build / "bench" / "python_overhead", folder / "points", folder / "components", free_space]
    local = tessera.LocalMap(free_space=free_space == "on")
    raw = scan.components.astype(np.uint32)
    points, components, T = scan.points, scan.components, np.eye(4)
    ids = tessera.LocalMap(tessera.ClassTable([f"class {i}" for i in range(1, 20)]), free_space=free_space == "on")

    def in_python(made, labels):
        made.clear()
        busy, start = time.thread_time_ns(), time.perf_counter_ns()
        report = made.integrate(points, labels, T)
        return time.perf_counter_ns() - start, time.thread_time_ns() - busy, report.admitted

    with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        def in_cpp():
            other.stdin.write("\n")
            other.stdin.flush()
            return tuple(map(int, other.stdout.readline().split()))

        kinds = {"uint8 components": lambda: in_python(local, components), "uint32 raw ids": lambda: in_python(ids, raw)}
        found = {kind: [] for kind in kinds}
        for pair in range(options.pairs + 2):
            for kind, call in kinds.items():
                own, cpp = (call(), in_cpp()) if pair % 2 else (in_cpp(), call())[::-1]
                if own[2] != cpp[2]:
                    sys.exit(f"python_overhead: {own[2]} points from Python, {cpp[2]} in C++")
                if pair >= 2:  # Memory was touched for the first time before.
                    found[kind].append((*own[:2], *cpp[:2]))
        other.stdin.close()
    print(f"{len(points)} points, free space {free_space}, {options.pairs} pairs each")
    for kind, rows in found.items():
        wall, cpu = (statistics.quantiles([row[i] / row[i + 2] - 1 for row in rows], n=4) for i in (0, 1))
        own, cpp = (statistics.median(row[i] for row in rows) / 1e6 for i in (0, 2))
        shares = [f"{100 * q[1]:+.2f} % ({100 * q[0]:+.2f} .. {100 * q[2]:+.2f})" for q in (wall, cpu)]
        print(f"  {kind}: Python {own:.2f} ms, C++ {cpp:.2f} ms; by the clock {shares[0]}, by the processor {shares[1]}")


def instructions(command, lines=""):
    done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *map(str, command)], input=lines,
                          env={**os.environ, "PYTHONHASHSEED": "0"}, capture_output=True, text=True, check=True)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def count(options, folder):
    """Instructions of a call: what four of them in a process take more than two, emptying the map included on both sides."""
    program = [options.build / "bench" / "python_overhead", folder / "points", folder / "components", "off"]
    own = [sys.executable, __file__, "--build", options.build, "--dataset", folder, "--calls"]
    cpp = (instructions(program, 4 * "\n") - instructions(program, 2 * "\n")) / 2
    python = (instructions([*own, 4]) - instructions([*own, 2])) / 2
    print(f"instructions, free space off, uint8 components: Python {python:,.0f}, C++ {cpp:,.0f}: {100 * (python / cpp - 1):+.3f} %")


def call(tessera, np, options):
    """What is counted."""
    points = np.fromfile(options.dataset / "points", np.float32).reshape(-1, 4)
    components = np.fromfile(options.dataset / "components", np.uint8)
    made, T = tessera.LocalMap(free_space=False), np.eye(4)
    for _ in range(options.calls):
        made.clear()
        made.integrate(points, components, T)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, type=pathlib.Path, help="folder that CMake built in")
    parser.add_argument("--dataset", type=pathlib.Path, help="folder in the KITTI layout; its first scan is taken")
    parser.add_argument("--pairs", type=int, default=50)
    parser.add_argument("--instructions", action="store_true", help="count them too, under valgrind: some minutes")
    parser.add_argument("--calls", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    sys.path.insert(0, str(options.build / "python"))
    import numpy as np
    import tessera

    if options.calls:
        return call(tessera, np, options)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scan = tessera.Dataset(first_scan(options, folder), last=None)[0]
        for free_space in ("off", "on"):
            measure(tessera, np, options, folder, scan, free_space)
        if options.instructions:
            count(options, folder)
        local = tessera.LocalMap(memory_bytes=32 << 20, max_points=64)
        one = np.full((1, 3), 3, np.float32)
        took = []
        for _ in range(2000):
            start = time.perf_counter_ns()
            local.query(one)
            took.append(time.perf_counter_ns() - start)
        print(f"the smallest call, a query of one point: {statistics.median(took) / 1e3:.1f} us")


if __name__ == "__main__":
    main()
