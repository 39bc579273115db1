# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The transform between two maps: found as the command finds it, or not accepted, with a reason."""
import json
import os
import subprocess

import numpy as np
import pytest
from conftest import sharer_of

import tessera

T_A_B = np.array([[0.6, -0.8, 0, 3], [0.8, 0.6, 0, -2], [0, 0, 1, 0.4], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def apart(street):
    """Maps of one street, of a scan each, in frames that are T_A_B apart."""
    dataset = tessera.Dataset(street / "robot_0")
    made = []
    for robot, T in enumerate((np.eye(4), T_A_B)):
        one = tessera.LocalMap(dataset.classes, resolution_m=0.2, memory_bytes=64 << 20, max_range_m=15.0, robot=robot)
        one.integrate(dataset[robot].points, dataset[robot].components, np.linalg.inv(T) @ dataset[robot].T_map_sensor)
        made.append(one)
    return made


@pytest.fixture(scope="module")
def saved(apart, tmp_path_factory):
    folder = tmp_path_factory.mktemp("apart")
    paths = [folder / "a.tsm", folder / "b.tsm"]
    for one, path in zip(apart, paths):
        one.save(path)
    return paths


def aligned_by_command(tmp_path, *arguments):
    """The exit status and the report."""
    words = [os.environ["TESSERA_COMMAND"], "align", *map(str, arguments), "--report", str(tmp_path / "report.json")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    report = json.loads((tmp_path / "report.json").read_text())
    del report["config"]
    return done.returncode, report


def test_it_is_found_without_a_guess(apart):
    found = tessera.align(*apart)
    assert found.accepted is True and found.reason is None
    at_middle = np.linalg.inv(found.transform) @ [*found.middle, 1.0] - np.linalg.inv(T_A_B) @ [*found.middle, 1.0]
    assert np.linalg.norm(at_middle) < 0.1
    turn = found.transform[:3, :3] @ T_A_B[:3, :3].T
    assert np.degrees(np.arccos((np.trace(turn) - 1) / 2)) < 0.5
    assert [(a.dtype, a.shape) for a in (found.transform, found.covariance, found.middle)] == [
        (np.float64, shape) for shape in ((4, 4), (6, 6), (3,))]
    assert np.array_equal(found.transform[3], [0, 0, 0, 1])
    assert np.array_equal(found.covariance, found.covariance.T) or np.allclose(found.covariance, found.covariance.T, rtol=1e-9)
    assert np.linalg.eigvalsh(found.covariance).min() > 0
    assert found.agreement["share"] > 0.95 > found.agreement_before["share"]
    assert "found: moved by" in repr(found)


def test_the_answer_is_the_commands_to_the_bit(apart, saved, tmp_path):
    guess = T_A_B.copy()
    guess[:2, 3] += 1.0
    np.savetxt(tmp_path / "guess.txt", guess)
    for given, words in (((), ()), ((guess,), ("--guess", tmp_path / "guess.txt"))):
        status, report = aligned_by_command(tmp_path, *saved, *words)
        found = tessera.align(*apart, *given)
        assert status == 0 and found.report == report
        assert found.transform.ravel().tolist() == report["transform"]
        assert found.covariance.ravel().tolist() == report["covariance"]
        assert found.middle.tolist() == report["covariance_about"]
        assert (found.agreement, found.agreement_before) == (report["agreement"], report["agreement_before"])
        # From files, and from one of each.
        assert tessera.align(*saved, *given).report == tessera.align(apart[0], str(saved[1]), *given).report == report
    assert tessera.align(*apart, guess=guess[:3]).report == report


def test_frames_of_both_maps_are_the_middle_of_the_search(apart, street, tmp_path):
    """Seen by what agreed there, before the search."""
    dataset = tessera.Dataset(street / "robot_0")
    placed = []
    for robot, T in enumerate((np.eye(4), T_A_B)):
        one = tessera.LocalMap(dataset.classes, resolution_m=0.2, memory_bytes=64 << 20, max_range_m=15.0, robot=robot, T_global_map=T)
        one.integrate(dataset[robot].points, dataset[robot].components, np.linalg.inv(T) @ dataset[robot].T_map_sensor)
        one.save(tmp_path / f"{robot}.tsm")
        placed.append(one)
    found = tessera.align(*placed)
    assert found.accepted and found.agreement_before["share"] > 0.9
    assert tessera.align(placed[0], apart[1]).agreement_before["share"] < 0.9
    assert aligned_by_command(tmp_path, tmp_path / "0.tsm", tmp_path / "1.tsm") == (0, found.report)


def test_what_is_not_sure_is_no_exception(apart, small, wall, tmp_path):
    small.integrate(*wall)
    small.save(tmp_path / "small.tsm")
    refused = tessera.align(small, tmp_path / "small.tsm")
    assert refused.accepted is False and refused.report["accepted"] is False
    assert refused.reason == refused.report["reason"] and "too few" in refused.reason
    assert refused.transform.shape == (4, 4) and not refused.covariance.any()
    status, report = aligned_by_command(tmp_path, *2 * [tmp_path / "small.tsm"])
    assert (status, report) == (2, refused.report)
    far = np.eye(4)
    far[0, 3] = 500.0
    assert tessera.align(*apart, far).accepted is False


def test_any_map_may_be_given(apart):
    fused = tessera.fuse(apart, [np.eye(4), T_A_B], diffusion="none")
    assert tessera.align(fused, apart[1]).accepted
    itself = tessera.align(apart[0], apart[0])
    assert itself.accepted and np.allclose(itself.transform, np.eye(4), atol=1e-3)
    sharer = sharer_of(apart[0])
    for tick in range(100):
        sharer.tick(50_000 * tick)
    sharer.finish()
    assert tessera.align(sharer.global_map, apart[0]).accepted
    assert tessera.align(apart[0], sharer.global_map).accepted


def test_what_cannot_be_aligned(apart, saved, small, tmp_path):
    turned = np.eye(4)
    turned[0, 0] = 2.0
    for guess in (np.eye(3), np.zeros(16), np.full((4, 4), np.nan), turned, np.ones((4, 4))):
        with pytest.raises(ValueError, match="guess"):
            tessera.align(*apart, guess)
    window = tessera.LocalMap(small.classes, memory_bytes=32 << 20, window_m=20.0)
    parts = tessera.LocalMap(small.classes, memory_bytes=32 << 20, submap_m=20.0)
    for a, b, words in ((window, small, "a has a window or is in submaps"), (small, parts, "b has a window or is in submaps"),
                        (small, tmp_path / "none.tsm", "none.tsm")):
        with pytest.raises(tessera.InputError, match=words):
            tessera.align(a, b)
    for arguments, words in (((small, None), "b is of type NoneType; give a Map or a path"), ((7, small), "a is of type int; give a Map or a path"),
                             ((small,), "tessera.align needs b"), ((small, small, "T.txt"), "guess is of type str")):
        with pytest.raises(TypeError, match=words):
            tessera.align(*arguments)
