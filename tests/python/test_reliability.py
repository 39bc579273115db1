# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Whom to believe: one of three robots takes two classes for each other; by fuse, and by all three when they share."""
import numpy as np
import pytest
from conftest import sharer_of

import tessera

TICK_US = 50_000
CLASSES = ["road", "building", "car"]


def robot(number, swapped):
    """A floor of 8 by 8 m, half of it road (label 1) and half building (label 2), or the other way."""
    one = tessera.LocalMap(tessera.ClassTable(CLASSES), memory_bytes=32 << 20, max_points=8192, robot=number, resolution_m=0.2, inference="counting")
    x, y = np.meshgrid(np.arange(2.1, 12, 0.2), np.arange(-4.9, 5, 0.2))
    points = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.1)], axis=1).astype(np.float32)
    labels = np.where((points[:, 0] < 7) != swapped, 1, 2).astype(np.uint8)
    pose = np.eye(4)
    pose[2, 3] = 2.0
    points[:, 2] -= 2.0
    for _ in range(5 if swapped else 1):
        one.integrate(points, labels, T_map_sensor=pose)
    return one


@pytest.fixture
def three():
    return [robot(0, False), robot(1, True), robot(2, False)]


def labels_of(a_map):
    return list(a_map.query(np.array([(4.1, 0.1, 0.1), (10.1, 0.1, 0.1)], np.float32)).label)


def test_fuse_names_who_is_contradicted_and_counts_it_less(three):
    with pytest.warns(UserWarning, match="most other robots contradict robot 1"):
        fused = tessera.fuse(three)
    first, liar, last = fused.report["reliability"]
    assert set(liar["named"]) == {"road", "building"} and not first["named"] and not last["named"]
    assert labels_of(fused) == [1, 2]
    with pytest.warns(UserWarning):
        assert labels_of(tessera.fuse(three, reliability=False)) == [2, 1]
    assert not tessera.fuse(three[:2]).report["reliability"][1]["named"]
    with pytest.raises(tessera.InputError):
        tessera.fuse(three, reliability_alarm=2.0)


def test_robots_that_share_all_name_the_same(three):
    sharers = [sharer_of(one) for one in three]
    for tick in range(60):
        for i, sharer in enumerate(sharers):
            for datagram in sharer.tick(1_000_000 + tick * TICK_US):
                for j, other in enumerate(sharers):
                    if i != j:
                        other.receive(datagram, 1_000_000 + tick * TICK_US)
    for sharer in sharers:
        sharer.finish()
        named = {one["robot"]: set(one["named"]) for one in sharer.report()["reliability"]}
        assert named == {0: set(), 1: {"road", "building"}, 2: set()}
        assert labels_of(sharer.global_map) == [1, 2]
    assert sharers[0].report()["reliability"] == sharers[2].report()["reliability"]
