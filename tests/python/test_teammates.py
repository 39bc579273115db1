# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Robots that say where they are: listed for planners, and left out of maps."""
import numpy as np
import pytest
from conftest import sharer_of

import tessera

BOX = [-1.0, -0.5, -0.4, 1.0, 0.5, -0.1]
TICK_US = 100_000


def moved(x, y=0.0):
    T = np.eye(4)
    T[:3, 3] = [x, y, 0.0]
    return T


def robot(number, frame=None, body=BOX):
    one = tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, max_points=4096, robot=number, resolution_m=0.2, body=body)
    return one, sharer_of(one, T_global_map=frame)


def other_and_wall():
    """Seen by robot 0: the side of the other one, and a wall beside it."""
    y, z = np.meshgrid(np.arange(-0.4, 0.4, 0.1), np.arange(-0.35, -0.1, 0.1))
    side = np.stack([np.full(y.size, 4.1), y.ravel(), z.ravel()], axis=1)
    return np.concatenate([side, side + [5.0, 4.0, 0.0]]).astype(np.float32), len(side)


def meet(first, second, ticks, x=5.0):
    """The second one stands there, and says so."""
    points, _ = other_and_wall()
    for tick in range(ticks):
        now_us = 1_000_000 + tick * TICK_US
        second[0].integrate(points, np.full(len(points), 2, np.uint8), moved(x))
        for datagram in second[1].tick(now_us):
            first[1].receive(datagram, now_us)
    return 1_000_000 + (ticks - 1) * TICK_US


def test_a_robot_that_is_heard_is_listed_and_left_out():
    first, second = robot(0, moved(2.0, 1.0)), robot(1)
    assert first[1].teammates(0) == []
    now_us = meet(first, second, 5)
    one, = first[1].teammates(now_us)
    assert one["robot"] == 1 and one["speed_m_per_s"] == 0 and one["velocity"] == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(one["T_global_body"], moved(5.0)[:3], atol=2e-3)
    np.testing.assert_allclose(one["T_map_body"], moved(3.0, -1.0)[:3], atol=2e-3)
    np.testing.assert_allclose([*one["low"], *one["high"]], BOX, atol=0.011)
    assert one["margin_m"] == pytest.approx(0.2) and now_us < one["until_us"] <= now_us + 3_000_000
    points, side = other_and_wall()
    pose = np.linalg.inv(moved(2.0, 1.0))
    report = first[0].integrate(points, np.full(len(points), 2, np.uint8), pose, teammates=first[1].teammates(now_us))
    assert (report.teammates, report.on_teammate, report.in_range) == (1, side, len(points) - side)
    # Once it is not heard any more, it is met as anything else is.
    gone = first[1].teammates(now_us + 3_000_001)
    assert gone == []
    report = first[0].integrate(points, np.full(len(points), 2, np.uint8), pose, teammates=gone)
    assert (report.teammates, report.on_teammate, report.in_range) == (0, 0, len(points))


def test_a_robot_without_a_body_or_with_too_large_a_one_says_nothing():
    for body in (None, [-9.0, -0.5, -0.4, 9.0, 0.5, -0.1]):
        first, second = robot(0), robot(1, body=body)
        assert first[1].teammates(meet(first, second, 5)) == []


def test_boxes_that_are_none_are_refused():
    one, _ = robot(0)
    points, _ = other_and_wall()
    good = {"T_map_body": moved(5.0), "low": [-1, -1, -1], "high": [1, 1, 1], "margin_m": 0.2}
    assert one.integrate(points, teammates=[good]).teammates == 1
    for changes in ({"low": [1, -1, -1]}, {"high": [float("nan"), 1, 1]}, {"high": [101, 1, 1]}, {"margin_m": -0.1}, {"margin_m": float("nan")},
                    {"T_map_body": 2 * np.eye(4)}):
        with pytest.raises(tessera.InputError):
            one.integrate(points, teammates=[{**good, **changes}])
