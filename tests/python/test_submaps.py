# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Maps in submaps, and corrections that move them: in files, and at others."""
import numpy as np
import pytest
from conftest import map_of, sharer_of

import tessera

TICK_US = 50_000


def test_submaps_begin_with_an_empty_map(street):
    dataset = tessera.Dataset(street / "robot_0", first=0, last=0)
    robot = map_of(dataset, max_range_m=8.0, submap_m=1000)[0]
    sharer = sharer_of(robot)
    voxels = len(robot.voxels())
    sharer.new_submap()
    with pytest.raises(tessera.Error, match="pending"):
        sharer.new_submap()
    robot.integrate(np.zeros((0, 3), np.float32))
    assert len(robot.voxels()) == 0 < voxels
    for tick in range(200):
        sharer.tick(TICK_US * (tick + 1))
    assert sharer.report()["submap"] == 1 and sharer.report()["lost_blocks"] == 0
    sharer.finish()
    assert len(sharer.global_map.voxels()) > 0
    with pytest.raises(tessera.InputError, match="submap_m"):
        sharer_of(map_of(dataset, max_range_m=8.0)[0]).new_submap()


def shifted(x):
    T = np.eye(4)
    T[0, 3] = x
    return T


def test_a_corrected_trajectory_moves_submaps_in_files_and_at_others(street, tmp_path):
    scan = tessera.Dataset(street / "robot_0")[0]
    robot = tessera.LocalMap(resolution_m=0.4, max_range_m=20.0, memory_bytes=64 << 20, submap_m=2)
    sharer = sharer_of(robot)
    poses = [shifted(0.7 * i) @ scan.T_map_sensor for i in range(9)]
    for i, T in enumerate(poses):
        robot.integrate(scan.points, scan.components, T, stamp_us=1_000_000 * i)
        for tick in range(40):
            sharer.tick(10_000_000 * (i + 1) + TICK_US * tick)
    count = len(robot.submaps())
    assert count >= 3 and sharer.report()["submap"] == count - 1
    stamps = 1_000_000 * np.arange(len(poses))
    moved = np.array([shifted(4.0) @ T for T in poses])
    result = sharer.correct(stamps, moved, 1)
    assert result["moved"] == count and result["revision"] == 1 and abs(result["most_m"] - 4.0) < 1e-3
    assert sharer.report()["revision"] == 1
    for submap in robot.submaps():
        assert submap["revision"] >= 2 and np.allclose(submap["T_world_map"], shifted(4.0), atol=1e-3)
    robot.save(tmp_path / "moved.tsm")
    sharer.finish()
    # Read as one map, it is where the global map is.
    local, fused = tessera.load(tmp_path / "moved.tsm").voxels(), sharer.global_map.voxels()
    assert np.allclose(local.index.min(axis=0), fused.index.min(axis=0), atol=2)
    with pytest.raises(tessera.InputError, match="revision"):
        sharer.correct(stamps, moved, 1)
    with pytest.raises(tessera.InputError, match="ascend"):
        robot.correct(stamps[::-1], moved, 2)
    with pytest.raises(tessera.InputError, match="T_world_sensor"):
        robot.correct(stamps, moved[1:], 2)
    with pytest.raises(tessera.InputError, match="one shares it at a time"):
        sharer_of(robot)
    with pytest.raises(tessera.InputError, match="submap_m"):
        tessera.LocalMap(memory_bytes=32 << 20).correct(stamps, moved, 1)


def test_a_map_in_submaps_without_a_sharer(street, tmp_path):
    scan = tessera.Dataset(street / "robot_0")[0]
    options = dict(resolution_m=0.4, max_range_m=20.0, memory_bytes=64 << 20)
    whole, parts = tessera.LocalMap(**options), tessera.LocalMap(submap_m=2, archive=tmp_path / "parts", **options)
    for i in range(9):
        for robot in (whole, parts):
            robot.integrate(scan.points, scan.components, shifted(0.7 * i) @ scan.T_map_sensor)
    assert len(list((tmp_path / "parts").iterdir())) == len(parts.submaps()) - 1 >= 2
    parts.save(tmp_path / "parts.tsm")
    assert abs(len(tessera.load(tmp_path / "parts.tsm").voxels()) / len(whole.voxels()) - 1) < 0.1
    del parts, robot
    assert not list((tmp_path / "parts").iterdir())
