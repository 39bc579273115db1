# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Places to which a robot is going: what others have published there is held before it is there."""
import numpy as np
import pytest
from conftest import sharer_of

import tessera


def stations(robot, count, **settings):
    """The sharer of a robot that has seen a wall at each of so many places, 40 m apart, each in a submap of its own if there are more."""
    one = tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, max_points=4096, robot=robot, resolution_m=0.2,
                           submap_m=20 if count > 1 else None)
    sharer = sharer_of(one, **settings)
    y, z = np.meshgrid(np.arange(-1, 1, 0.2) + 0.1, np.arange(-1, 1, 0.2) + 0.1)
    points = np.stack([np.full(y.size, 5.1), y.ravel(), z.ravel()], axis=1).astype(np.float32)
    pose = np.eye(4)
    for i in range(count):
        pose[0, 3] = 40.0 * i
        for _ in range(3):
            one.integrate(points, np.full(y.size, 2, dtype=np.uint8), pose)
        for tick in range(20):
            sharer.tick(50_000 * (20 * i + tick))
    return sharer


def test_what_lies_at_the_route_is_held_before_the_robot_is_there():
    count = 8
    driver = stations(1, count, contributions=40)
    small = stations(2, 1, contributions=6, contributions_per_robot=6, reach_m=10.0, far_contributions=32)
    places = np.array([[40.0 * i + 5.1, 0.1, 0.1] for i in range(count)], np.float32)
    now_us = [100_000_000]

    def run(ticks):
        for _ in range(ticks):
            now_us[0] += 50_000
            for one, other in ((driver, small), (small, driver)):
                for datagram in one.tick(now_us[0]):
                    other.receive(datagram, now_us[0])
        small.finish()
        return small.global_map.query(places).state != tessera.State.UNKNOWN

    known = run(600)
    assert known[0] and not known.all() and small.report()["far_contributions"] > 0
    far = int(np.flatnonzero(~known)[-1])
    for route, words in (([[1.0, 2.0]], "p_global"), ([[1.0, 2.0, np.nan]], "p_global"), ([1.0], "p_global")):
        with pytest.raises(tessera.InputError, match=words):
            small.set_route(route)
    assert not run(200)[far]
    small.set_route(places[far:far + 1])
    known = run(200)
    assert known[far] and known[0]
    small.set_route(np.zeros((0, 3)))
