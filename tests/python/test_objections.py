# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The team clears together: what one robot has and another sees through later goes from both global maps."""
import numpy as np
from conftest import sharer_of

import tessera

BOX = np.array([(8.1, 0.1, 0.1), (8.1, -0.1, 0.1)], np.float32)
WALL = np.array([(12.1, 0.1, 0.1), (12.1, -0.1, 0.1)], np.float32)
TICK_US = 50_000


def scan(has_box):
    """A wall (label 1) 12 m ahead, and if has_box a car (label 2) 8 m ahead, 1 m wide and high."""
    elevation, azimuth = np.meshgrid(np.radians(np.arange(-5, 5, 0.4)), np.radians(np.arange(-8, 8, 0.15)))
    y, z = np.tan(azimuth).ravel(), np.tan(elevation).ravel()
    is_box = has_box & (np.abs(8 * y) < 0.5) & (np.abs(8 * z) < 0.5)
    x = np.where(is_box, 8.0, 12.0)
    return np.stack([x + 0.05, x * y, x * z], axis=1).astype(np.float32), np.where(is_box, 2, 1).astype(np.uint8)


def robot(number):
    one = tessera.LocalMap(tessera.ClassTable(["wall", "car"]), memory_bytes=32 << 20, max_points=4096, robot=number, resolution_m=0.2)
    return one, sharer_of(one)


def talk(robots, tick, ticks):
    """Each robot has a clock of its own."""
    for tick in range(tick, tick + ticks):
        for i, (_, sharer) in enumerate(robots):
            for datagram in sharer.tick(1_000_000 + tick * TICK_US + i * 3_600_000_000):
                for j, (_, other) in enumerate(robots):
                    if i != j:
                        other.receive(datagram, 1_000_000 + tick * TICK_US + j * 3_600_000_000)
    for _, sharer in robots:
        sharer.finish()
    return tick + 1


def occupied(sharer, points):
    return int((sharer.global_map.query(points).state == tessera.State.OCCUPIED).sum())


def test_what_one_has_and_another_sees_through_later_is_gone_for_both():
    robots = [robot(0), robot(1)]
    for _ in range(4):
        robots[0][0].integrate(*scan(True))
    tick = talk(robots, 0, 60)
    assert [occupied(sharer, BOX) for _, sharer in robots] == [2, 2]
    for _ in range(12):
        robots[1][0].integrate(*scan(False))
        tick = talk(robots, tick, 2)
    tick = talk(robots, tick, 60)
    for _, sharer in robots:
        assert occupied(sharer, BOX) == 0
        assert occupied(sharer, WALL) == 2
    reports = [sharer.report() for _, sharer in robots]
    assert reports[1]["objections"]["objections"] > 0
    assert reports[0]["objections"]["objected_voxels"] == 0
    assert all(report["global"]["objected_voxels"] > 0 for report in reports)
    assert [c["robot"] for c in reports[0]["contributions_by_id"] if c.get("objections")] == [1]
    # Robot 0 sees it again.
    for _ in range(4):
        robots[0][0].integrate(*scan(True))
        tick = talk(robots, tick, 2)
    talk(robots, tick, 60)
    assert [occupied(sharer, BOX) for _, sharer in robots] == [2, 2]
