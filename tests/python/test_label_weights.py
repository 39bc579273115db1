# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Labels with weights: the command's maps from arrays of any layout, and what is refused."""
import numpy as np
import pytest

import tessera
from conftest import MEMORY_BYTES, OPTIONS, RESOLUTION_M, map_of


def test_labels_with_weights_are_the_commands(command, street, tmp_path):
    folder = street / "robot_0"
    report = command("map", "--dataset", folder, "--labels", "topk", "--out", tmp_path / "a.tsm", *OPTIONS, report=tmp_path / "a.json")
    dataset = tessera.Dataset(folder, labels="topk")
    made, reports = map_of(dataset)
    assert made.digest() == report["digest"]
    assert sum(one.weighted_labels for one in reports) == report["totals"]["weighted_labels"] > 0
    scan = dataset[0]
    assert scan.components.shape == scan.label_weights.shape == (len(scan.points), 3)
    assert scan.label_weights.dtype == np.uint8 and tessera.Dataset(folder)[0].label_weights is None
    best = scan.components[np.arange(len(scan.points)), scan.label_weights.argmax(1)]
    assert np.array_equal(best, tessera.Dataset(folder)[0].components)
    # As a network gives them, in any layout; and as raw ids.
    raw = np.fromfile(folder / "topk/000000.topk", np.uint32).reshape(-1, 3)
    probabilities = scan.label_weights / np.float32(255)
    digests = set()
    for labels, weights in ((scan.components, scan.label_weights), (scan.components, probabilities), (raw, probabilities),
                            (scan.components, probabilities.astype(np.float64)), (raw & 0xFFFF, scan.label_weights),
                            (np.asfortranarray(scan.components), np.asfortranarray(probabilities)),
                            (scan.components[:, ::-1], np.asfortranarray(scan.label_weights)[:, ::-1]),
                            (scan.components.repeat(2, 0)[::2], probabilities.repeat(2, 0)[::2])):
        one = tessera.LocalMap(dataset.classes, resolution_m=RESOLUTION_M, memory_bytes=MEMORY_BYTES)
        one.integrate(scan.points, labels, scan.T_map_sensor, label_weights=weights)
        digests.add(one.digest())
    assert len(digests) == 1


def test_one_label_of_weight_one_is_a_label_without(street):
    scan = tessera.Dataset(street / "robot_0")[0]
    n = len(scan.points)
    digests = set()
    for labels, weights in ((scan.components, None), (scan.components, np.ones(n, np.float32)),
                            (scan.components[:, None], np.full((n, 1), 255, np.uint8)),
                            (np.stack([scan.components, scan.components * 0 + 1], 1), np.tile(np.float32([1, 0]), (n, 1)))):
        one = tessera.LocalMap(resolution_m=RESOLUTION_M, memory_bytes=MEMORY_BYTES)
        one.integrate(scan.points, labels, scan.T_map_sensor, label_weights=weights)
        digests.add(one.digest())
    assert len(digests) == 1


def test_wrong_label_weights_are_refused_or_counted(small, wall):
    points, labels = wall
    table = np.stack([labels, labels], 1)
    half = np.full(table.shape, 0.5, np.float32)
    for value in (-0.1, np.nan, np.inf, 0.7):
        wrong = half.copy()
        wrong[3, 1] = value
        with pytest.raises(tessera.InputError, match="label_weights of point 3 are negative, not finite or sum to more than one"):
            small.integrate(points, table, label_weights=wrong)
    with pytest.raises(TypeError, match="label_weights is of int64"):
        small.integrate(points, table, label_weights=half.astype(np.int64))
    for weights in (half[:, 0], half[:-1], np.zeros((), np.float32), half[:, 0].copy(), np.full((len(points), 3), 0.1, np.float32)):
        with pytest.raises(tessera.InputError, match="label_weights has the shape"):
            small.integrate(points, table, label_weights=weights)
    with pytest.raises(tessera.InputError, match="label_weights has the shape"):
        small.integrate(points, None, label_weights=half)
    with pytest.raises(tessera.InputError, match="labels has the shape"):
        small.integrate(points, table)
    with pytest.raises(tessera.InputError, match="labels has the shape"):
        small.integrate(points, np.stack([labels] * 4, 1), label_weights=np.full((len(points), 4), 0.1, np.float32))
    # Broadcast arrays have a step of 0.
    wide = np.broadcast_to(labels[:, None], (len(labels), 3))
    with pytest.raises(tessera.InputError, match="label_weights has the shape"):
        small.integrate(points, wide, label_weights=np.zeros(len(points), np.uint8))
    assert small.integrate(points, wide, label_weights=np.full(wide.shape, 85, np.uint8)).weighted_labels == 0
    # What has no weight may be anything.
    raw = np.stack([np.full(len(points), 10, np.uint32), np.full(len(points), 0xFFFF, np.uint32)], 1)
    none = np.tile(np.uint8([255, 0]), (len(points), 1))
    assert small.integrate(points, raw, label_weights=none).unknown_ids == 0
    small.integrate(points, np.stack([labels, labels * 0 + 255], 1), label_weights=none)
    over = np.full(table.shape, 128, np.uint8)
    over[2:] = 127
    report = small.integrate(points, table, label_weights=over)
    assert (report.wrong_labels, report.unlabelled) == (2, 2)
