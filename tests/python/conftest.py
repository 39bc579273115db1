# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python package share: the command, a simulated street, and maps made of it both ways.

TESSERA_COMMAND is the command's path; the package is found by PYTHONPATH."""
import json
import os
import pathlib
import subprocess

import numpy as np
import pytest

import tessera

RESOLUTION_M = 0.2
MEMORY_BYTES = 144 << 20
# As the command is told.
OPTIONS = ("--resolution", str(RESOLUTION_M), "--memory", str(MEMORY_BYTES))


@pytest.fixture(scope="session")
def command():
    """Runs the command, which must succeed; a report is returned if one is asked for."""
    path = os.environ["TESSERA_COMMAND"]

    def run(*arguments, report=None):
        words = [path, *map(str, arguments), *(("--report", str(report)) if report else ())]
        done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr
        return json.loads(pathlib.Path(report).read_text()) if report else done.stdout

    return run


@pytest.fixture(scope="session")
def street(command, tmp_path_factory):
    """A folder with robot_0 and robot_1: two scans each."""
    folder = tmp_path_factory.mktemp("street")
    command("simulate", "--robots", 2, "--scans", 2, "--seed", 3, "--topk", 3, "--out", folder)
    return folder


def map_of(dataset, **arguments):
    """A map of all scans, and the reports."""
    chosen = {"classes": dataset.classes, "resolution_m": RESOLUTION_M, "memory_bytes": MEMORY_BYTES, **arguments}
    made = tessera.LocalMap(**chosen)
    return made, [made.integrate(scan.points, scan.components, scan.T_map_sensor, label_weights=scan.label_weights)
                  for scan in dataset]


def sharer_of(robot, **arguments):
    return tessera.Sharer(robot, **{"fusion_memory_bytes": 64 << 20, "bytes_per_s": 50_000_000, "burst_bytes": 10_000_000,
                                    **arguments})


@pytest.fixture(scope="session")
def frame(street):
    return tessera.read_transform(street / "robot_0" / "T_global_map.txt")


# Scans of two robots that see one place: all of the folder, and its second alone.
FIRST = (0, 1)


@pytest.fixture(scope="session")
def maps(street, frame):
    """Of both robots, from arrays. Not to be written to."""
    return [map_of(tessera.Dataset(street / "robot_0", first=first), robot=robot, T_global_map=frame)[0]
            for robot, first in enumerate(FIRST)]


@pytest.fixture(scope="session")
def files(command, street, tmp_path_factory):
    """The same by the command: a report and a file for each robot."""
    folder = tmp_path_factory.mktemp("files")
    made = []
    for robot, first in enumerate(FIRST):
        path = folder / f"{robot}.tsm"
        report = command("map", "--dataset", street / "robot_0", "--first", first, "--out", path, "--robot", robot, *OPTIONS,
                         report=folder / f"{robot}.json")
        made.append((report, path))
    return made


@pytest.fixture
def wall():
    """A piece of road and a wall behind it: points (N, 3) and components, of classes of two names."""
    random = np.random.default_rng(7)
    n = 400
    road = np.column_stack([random.uniform(2, 6, n), random.uniform(-2, 2, n), np.full(n, -1.55)])
    bricks = np.column_stack([np.full(n, 6.05), random.uniform(-2, 2, n), random.uniform(-1.5, 1, n)])
    points = np.concatenate([road, bricks]).astype(np.float32)
    return points, np.repeat(np.array([1, 2], np.uint8), n)


@pytest.fixture
def small():
    """An empty map of two classes, in little memory."""
    return tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, max_points=4096)
