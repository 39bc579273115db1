# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What a scan sees through is taken back from the map: at once if it may move."""
import numpy as np
import pytest

import tessera

BOX = (8.05, 0.05, 0.05)


def scan(label=0):
    """A wall (label 1) 12 m ahead, and if label is not 0 a box of it 8 m ahead, 1 m wide and high."""
    elevation, azimuth = np.meshgrid(np.radians(np.arange(-5, 5, 0.4)), np.radians(np.arange(-8, 8, 0.1)))
    y, z = np.tan(azimuth).ravel(), np.tan(elevation).ravel()
    is_box = (label != 0) & (np.abs(8 * y) < 0.5) & (np.abs(8 * z) < 0.5)
    x = np.where(is_box, 8.0, 12.0)
    return np.stack([x + 0.05, x * y, x * z], axis=1).astype(np.float32), np.where(is_box, label, 1).astype(np.uint8)


def made(names=("wall", "car"), **options):
    return tessera.LocalMap(tessera.ClassTable(list(names), **options), inference="counting", carving="image",
                            memory_bytes=256 << 20, max_points=8192)


def is_occupied(local):
    return bool(local.query(np.array([BOX], np.float32)).state[0] == tessera.State.OCCUPIED)


@pytest.mark.parametrize("label, options, scans", [
    (2, {}, 1), (1, {}, 2), (2, {"moves": [False, False]}, 2), (1, {"moves": [True, False]}, 1)])
def test_it_goes_with_the_first_scan_if_it_may_move_and_else_with_the_second(label, options, scans):
    local = made(**options)
    for _ in range(5):
        local.integrate(*scan(label))
    assert is_occupied(local)
    for number in range(1, scans + 1):
        report = local.integrate(*scan())
        assert is_occupied(local) == (number < scans)
        assert (report.voxels_doubted > 50) == (number < scans)
        assert (report.voxels_cleared > 50) == (number == scans)


def test_what_is_loaded_is_contradicted_too_and_does_not_fade(tmp_path):
    first = made()
    for _ in range(5):
        first.integrate(*scan(2))
    first.save(tmp_path / "map.tsm")
    again = tessera.LocalMap.load(tmp_path / "map.tsm", inference="counting", carving="image", memory_bytes=256 << 20,
                                  max_points=8192)
    points, labels = scan(2)
    for _ in range(30):
        again.integrate(points[points[:, 1] < -0.6], labels[points[:, 1] < -0.6])
    assert is_occupied(again)
    again.integrate(*scan())
    assert not is_occupied(again)
