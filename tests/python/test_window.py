# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A map with a window and an archive is the map without, to the last bit; alone and shared."""
import gc

import numpy as np
import pytest
from test_sharing import exchange, sharer_of

import tessera

REACH_M = 8.0
STATIONS_M = [*range(0, 60, 4), *range(60, -1, -6)]


def scan_at(number):
    """A ring of points around the robot, at another place with another class each time."""
    random = np.random.default_rng(number)
    angle = random.uniform(-np.pi, np.pi, 1500)
    reach_m = random.uniform(2.0, REACH_M - 0.5, angle.size)
    points = np.column_stack([reach_m * np.cos(angle), reach_m * np.sin(angle), random.uniform(-1.5, 0.5, angle.size)])
    return points.astype(np.float32), random.integers(1, 4, angle.size).astype(np.uint8)


def drive(made, stations_m=STATIONS_M, each=lambda: None):
    for number, x_m in enumerate(stations_m):
        T = np.eye(4)
        T[0, 3] = x_m
        assert made.integrate(*scan_at(number), T).left_out == 0
        each()


def made_with(**arguments):
    classes = tessera.ClassTable(["road", "wall", "tree"])
    return tessera.LocalMap(classes, **{"resolution_m": 0.1, "memory_bytes": 64 << 20, "max_range_m": REACH_M, **arguments})


@pytest.fixture(scope="module")
def whole():
    made = made_with()
    drive(made)
    return made


@pytest.mark.parametrize("window_m", [None, 10.0])
def test_the_map_is_that_without_a_window(whole, tmp_path, window_m):
    made = made_with(window_m=window_m, archive=tmp_path / "spill")
    drive(made)
    window = made.window()
    assert window["radius_m"] == (window_m or REACH_M)
    assert window["evicted"] > 300 and window["reloaded"] > 100
    assert window["lost_blocks"] == 0 and window["archived_blocks"] > 0
    assert made.usage()["blocks"] < whole.usage()["blocks"] / 2
    assert made.digest() == whole.digest()
    made.save(tmp_path / "made.tsm")
    whole.save(tmp_path / "whole.tsm")
    assert (tmp_path / "made.tsm").read_bytes() == (tmp_path / "whole.tsm").read_bytes()
    assert tessera.load(tmp_path / "made.tsm").digest() == whole.digest()
    # It goes on after that.
    made.integrate(*scan_at(99))
    assert made.digest() != whole.digest()
    made.clear()
    assert made.window()["archived_blocks"] == 0 and made.digest() == made_with().digest()


def test_a_file_goes_on_with_a_window(whole, tmp_path):
    half = len(STATIONS_M) // 2
    first = made_with()
    for number in range(half):
        T = np.eye(4)
        T[0, 3] = STATIONS_M[number]
        first.integrate(*scan_at(number), T)
    first.save(tmp_path / "first.tsm")
    made = tessera.LocalMap.load(tmp_path / "first.tsm", memory_bytes=64 << 20, max_range_m=REACH_M, window_m=10, archive=tmp_path / "spill")
    for number in range(half, len(STATIONS_M)):
        T = np.eye(4)
        T[0, 3] = STATIONS_M[number]
        made.integrate(*scan_at(number), T)
    assert made.window()["evicted"] > 100
    assert made.digest() == whole.digest()


def test_the_archive_goes_with_the_map_and_no_earlier_one_is_used(tmp_path):
    made = made_with(archive=tmp_path / "spill")
    file = tmp_path / "spill" / "blocks.tsa"
    drive(made, range(0, 40, 4))
    with pytest.raises(tessera.InputError, match="blocks.tsa"):
        made_with(archive=tmp_path / "spill")
    del made
    gc.collect()
    assert not file.exists()
    assert made_with(archive=tmp_path / "spill").window()["archived_blocks"] == 0


def test_without_an_archive_what_is_lost_is_counted():
    made = made_with(window_m=10)
    drive(made)
    assert made.window()["lost_blocks"] == made.window()["evicted"] > 300
    assert made_with().window() is None


def test_what_is_refused(tmp_path):
    for arguments, saying in (({"window_m": -1.0}, "window_m"), ({"window_m": 1e9}, "window_m"), ({"archive": ""}, "archive"),
                              ({"archive": tmp_path, "max_range_m": 0.0}, "archive needs window_m")):
        with pytest.raises(tessera.InputError, match=saying):
            made_with(**arguments)
    made = made_with(archive=tmp_path / "spill")
    with pytest.raises(tessera.InputError, match="window"):
        tessera.fuse([made, made_with(robot=1)])


def test_a_sharer_keeps_what_has_left(tmp_path):
    """What others have at the end is what the map without a window has published."""
    maps = [made_with(), made_with(window_m=10, archive=tmp_path / "spill")]
    published = []
    for made in maps:
        sharer = sharer_of(made)
        now_us = [0]

        def tick(sharer=sharer, now_us=now_us):
            for _ in range(10):
                now_us[0] += 50_000
                sharer.tick(now_us[0])

        drive(made, each=tick)
        exchange([sharer])
        published.append(sharer.global_map.voxels().index)
    assert maps[1].window()["evicted"] > 300 and maps[1].window()["unpublished_blocks"] == 0
    assert maps[0].digest() == maps[1].digest()
    assert np.array_equal(*published)


def test_one_sharer_at_a_time_has_a_map_with_a_window(tmp_path):
    made = made_with(window_m=10, archive=tmp_path / "spill")
    drive(made, range(0, 40, 4))
    sharer = sharer_of(made)
    with pytest.raises(tessera.InputError, match="sharer"):
        sharer_of(made)
    del sharer
    gc.collect()
    sharer = sharer_of(made, epoch=2)
    exchange([sharer])
    with pytest.raises(tessera.InputError, match="submap_m"):
        sharer.new_submap()
