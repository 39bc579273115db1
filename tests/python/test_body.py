# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's own body, and directions from which nothing came back."""
import numpy as np
import pytest

import tessera

BOX = [1.0, -1.0, -2.0, 3.0, 1.0, 0.0]


def made(**arguments):
    return tessera.LocalMap(tessera.ClassTable(["a", "b"]), **{"resolution_m": 0.2, "memory_bytes": 64 << 20, **arguments})


def moved(x, y, z):
    T = np.eye(4)
    T[:3, 3] = [x, y, z]
    return T


def test_returns_on_the_body_are_left_out(wall):
    points, labels = wall
    on_body = np.all((points >= np.float32(BOX[:3])) & (points <= np.float32(BOX[3:])), axis=1)
    assert 10 < on_body.sum() < len(points)
    all_of_it, others = made(body=BOX), made()
    report = all_of_it.integrate(points, labels)
    others.integrate(points[~on_body], labels[~on_body])
    assert report.on_body == on_body.sum() and report.in_range == (~on_body).sum()
    assert all_of_it.digest() == others.digest()
    for same in (tuple(BOX), np.array(BOX), np.float32(BOX), [int(x) for x in BOX]):
        again = made(body=same)
        again.integrate(points, labels)
        assert again.digest() == others.digest()
    assert made(body=[]).integrate(points, labels).on_body == made(body=None).integrate(points, labels).on_body == 0


def test_boxes_are_in_the_frame_of_the_body(wall):
    points, labels = wall
    expected = made(body=BOX).integrate(points, labels).on_body
    shifted = [a + b for a, b in zip(BOX, [5, 6, 7, 5, 6, 7], strict=True)]
    assert made(body=shifted).integrate(points, labels).on_body == 0
    assert made(body=shifted).integrate(points, labels, T_body_sensor=moved(5, 6, 7)).on_body == expected
    robot = made(body=BOX)
    for T in (moved(2, 0, -1), moved(1, 1, 0)):
        with pytest.raises(tessera.InputError, match="^body has a box around the sensor"):
            robot.integrate(points, labels, T_body_sensor=T)
    with pytest.raises(tessera.InputError, match="T_body_sensor"):
        robot.integrate(points, labels, T_body_sensor=np.zeros((4, 4)))
    assert len(robot.voxels()) == 0


@pytest.mark.parametrize("body, error, words", [
    ([1, 2, 3], tessera.InputError, "^body has 3 numbers; give six"), (BOX * 9, tessera.InputError, "54 numbers"),
    ([1, 1, 1, 0, 2, 2], tessera.InputError, "box 1 that is empty"), ([1, 1, 1, 2, 2, np.nan], tessera.InputError, "box 1"),
    ([1, 1, 1, 2, 2, np.inf], tessera.InputError, "box 1"), ("1,1,1,2,2,2", TypeError, "^body is of type str; give a list of numbers"),
    (3, TypeError, "a list of numbers"), ([BOX], TypeError, "a list of numbers"), ([None] * 6, TypeError, "a list of numbers"),
    (["1"] * 6, TypeError, "a list of numbers")])
def test_boxes_that_are_none_are_refused(body, error, words):
    with pytest.raises(error, match=words) as refused:
        made(body=body)
    assert "--" not in str(refused.value)


def test_what_did_not_come_back_frees_space_up_to_its_range():
    angles = np.linspace(-np.pi, np.pi, 2000, endpoint=False)
    points = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(2000)]).astype(np.float32)
    for carving in ("rays", "image"):
        clearing = made(no_return_range_m=8, carving=carving)
        report = clearing.integrate(points, no_return=np.ones(2000, bool))
        assert (report.no_return, report.in_range) == (2000, 0) and report.rays > 100
        states = clearing.query(np.float32([[5.1, 0.1, 0.1], [-5.1, 0.1, 0.1], [9.1, 0.1, 0.1]])).state
        assert list(states == 1) == [True, True, False]
        kept = made(carving=carving)
        assert kept.integrate(points, no_return=np.ones(2000, np.uint8)).no_return == 2000 and len(kept.voxels()) == 0
        for bad, error in ((np.ones(3, bool), tessera.InputError), (np.ones((2000, 1), bool), tessera.InputError),
                           (np.ones(4000, bool)[::2], tessera.InputError), (np.ones(2000, np.float32), TypeError)):
            with pytest.raises(error, match="no_return"):
                kept.integrate(points, no_return=bad)
