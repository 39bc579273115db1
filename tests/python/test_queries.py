# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Queries on arrays: what the command says, what is in a box, along a ray, and near."""
import csv

import numpy as np
import pytest

import tessera
from tessera import RayEnd, State


@pytest.fixture(scope="module")
def places(maps):
    """Points of all kinds: in voxels of each state, on their faces, out of the grid, not finite."""
    random = np.random.default_rng(1)
    around = random.uniform([-30, -30, -3], [30, 30, 5], (3000, 3))
    seen = maps[0].voxels()
    return np.concatenate([around, seen.center[::97], seen.index[::89] * maps[0].resolution_m,
                           [[1e9, 0, 0], [np.nan, 0, 0], [0, -np.inf, 0]]])


def test_answers_are_the_commands(maps, files, command, places, tmp_path):
    # As the command reads what is printed with all digits.
    text = "x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in places.tolist())
    (tmp_path / "points.csv").write_text(text)
    command("query", "--map", files[0][1], "--points", tmp_path / "points.csv", "--out", tmp_path / "states.csv")
    rows = list(csv.DictReader((tmp_path / "states.csv").open()))
    found = maps[0].query(places, sigma=True)
    assert len(found) == len(rows) == len(places)
    assert [State(s).name.lower() for s in found.state] == [row["state"] for row in rows]
    assert found.label.tolist() == [int(row["label"]) for row in rows]
    assert {State.UNKNOWN, State.FREE, State.OCCUPIED} == set(found.state)
    for name in ("probability", "variance", "evidence"):
        assert [f"{v:.9g}" for v in getattr(found, name)] == [row[name] for row in rows], name
    for l in range(maps[0].classes.num_components):
        assert [f"{v:.9g}" for v in found.sigma[:, l]] == [row[f"sigma_{l}"] for row in rows]


def test_probabilities_of_components(maps, files, command, places, tmp_path):
    found = maps[0].query(places, sigma=True, probabilities=True)
    p, n = found.probabilities, maps[0].classes.num_components
    assert (p.dtype, p.shape) == (np.float64, (len(places), n))
    labelled, unknown = found.label != 0, found.state == State.UNKNOWN
    assert labelled.any() and unknown.any()
    assert np.array_equal(p[labelled, found.label[labelled]], found.probability[labelled])
    assert np.allclose(p[unknown], 1 / n)
    # What is missing to one is in the rest of a few voxels with more than three classes.
    total = p.sum(axis=1)
    assert np.all(p >= 0) and np.all(total < 1 + 1e-9) and np.mean(total > 1 - 1e-9) > 0.9
    # Of all components those without evidence have the least.
    least = np.broadcast_to(p.min(axis=1, keepdims=True), p.shape)
    assert np.array_equal(p[found.sigma == 0], least[found.sigma == 0])
    (tmp_path / "points.csv").write_text("x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in places.tolist()))
    command("query", "--probabilities", "--map", files[0][1], "--points", tmp_path / "points.csv", "--out", tmp_path / "states.csv")
    rows = list(csv.DictReader((tmp_path / "states.csv").open()))
    for l in range(n):
        assert [f"{v:.9g}" for v in p[:, l]] == [row[f"probability_{l}"] for row in rows]
    seen = maps[0].voxels(probabilities=True)
    again = maps[0].query(seen.center, sigma=True, probabilities=True).as_dict()
    assert np.array_equal(seen.probabilities, again["probabilities"])
    assert maps[0].query(places).probabilities is None and seen.sigma is None
    box = maps[0].box((-1e9, -1e9, -1e9), (1e9, 1e9, 1e9), sigma=True, probabilities=True).as_dict()
    assert np.array_equal(box["sigma"], again["sigma"]) and np.array_equal(box["probabilities"], again["probabilities"])
    assert maps[0].box((0, 0, 0), (1, 1, 1), sigma=True).probabilities is None


def test_types_and_shapes_of_answers(maps, places):
    n, L = len(places), maps[0].classes.num_components
    found = maps[0].query(places, sigma=True)
    expected = {"state": (np.uint8, (n,)), "label": (np.uint8, (n,)), "probability": (np.float64, (n,)),
                "variance": (np.float64, (n,)), "evidence": (np.float64, (n,)), "occupancy": (np.float64, (n,)),
                "sigma": (np.float32, (n, L))}
    assert {name: (a.dtype, a.shape) for name, a in found.as_dict().items()} == expected
    assert maps[0].query(places).sigma is None
    assert all(a.flags.c_contiguous and a.flags.writeable for a in found.as_dict().values())
    assert found.state is found.state


@pytest.mark.parametrize("layout", [np.asfortranarray, lambda p: p[::-1][::-1], lambda p: np.c_[p, p], lambda p: p.astype(">f8")
                                    .astype(np.float64)])
def test_any_layout_of_places(maps, places, layout):
    expected, found = maps[0].query(places).as_dict(), maps[0].query(layout(places)).as_dict()
    assert all(np.array_equal(expected[name], found[name]) for name in expected)


def test_single_precision_places(maps, places):
    single = places.astype(np.float32)
    expected, found = maps[0].query(single.astype(np.float64)).as_dict(), maps[0].query(single).as_dict()
    assert all(np.array_equal(expected[name], found[name]) for name in expected)
    one = maps[0].query(single[0])
    assert len(one) == 1 and one.state[0] == found["state"][0]


def test_places_that_are_none(maps):
    for bad in (np.zeros((3, 2)), np.zeros(2), np.zeros((2, 3, 3))):
        with pytest.raises(tessera.InputError, match="points has the shape"):
            maps[0].query(bad)
    for bad in (np.zeros((3, 3), np.int64), np.zeros((3, 3), ">f8")):
        with pytest.raises(TypeError, match="float32 or float64"):
            maps[0].query(bad)
    assert len(maps[0].query(np.zeros((0, 3)))) == 0


def test_the_whole_map(maps, files):
    memory = files[0][0]["memory"]
    seen = maps[0].voxels(sigma=True)
    assert len(seen) == memory["label_voxels"] + memory["free_voxels"]
    assert (seen.index.dtype, seen.index.shape, seen.resolution_m) == (np.int32, (len(seen), 3), 0.2)
    assert len(np.unique(seen.index, axis=0)) == len(seen)
    again = maps[0].query(seen.center, sigma=True).as_dict()
    assert all(np.array_equal(again[name], value) for name, value in seen.as_dict().items())
    blocks = seen.index >> 3
    order = np.lexsort(blocks.T)
    assert np.array_equal(blocks[order], blocks)
    occupied = maps[0].voxels(occupied_only=True)
    assert np.array_equal(occupied.index, seen.index[seen.state == State.OCCUPIED])
    assert occupied.sigma is None and np.all(occupied.state == State.OCCUPIED)


def test_boxes(maps):
    seen = maps[0].voxels()
    low, high = np.array([-3.0, -2.5, -2.0]), np.array([5.1, 4.0, 0.9])
    first, last = np.floor(low / 0.2 + 1e-9), np.floor(high / 0.2 + 1e-9)
    within = np.all((seen.index >= first) & (seen.index <= last), axis=1)
    box = maps[0].box(low, high)
    assert within.any() and np.array_equal(box.index, seen.index[within]) and np.array_equal(box.label, seen.label[within])
    assert len(maps[0].box((-np.inf,) * 3, (np.inf,) * 3)) == len(seen)
    assert len(maps[0].box(high, low)) == 0
    assert len(maps[0].box(low, high, occupied_only=True)) < len(box)
    with pytest.raises(tessera.InputError, match="low"):
        maps[0].box((np.nan, 0, 0), high)


def test_rays(small, wall):
    small.integrate(*wall)
    ahead = np.array([[1, 0, 0], [2, 0, 0], [0, 0, -5], [-1, 0, 0], [0, 0, 0], [np.nan, 0, 0]], np.float64)
    rays = small.cast_rays(np.zeros(3), ahead, 10.0)
    assert rays.end.tolist()[:2] == [RayEnd.OCCUPIED] * 2 and rays.end.tolist()[3:] == [RayEnd.MAX_RANGE, RayEnd.INVALID, RayEnd.INVALID]
    assert rays.label[:2].tolist() == [2, 2] and abs(rays.distance_m[0] - 6.0) < 0.15
    assert rays.distance_m[0] == rays.distance_m[1] and rays.voxel[0].tolist() == rays.voxel[1].tolist()
    hit = small.query((rays.voxel[:1] + 0.5) * 0.1)
    assert hit.state[0] == State.OCCUPIED and hit.probability[0] == rays.probability[0]
    assert small.cast_rays(np.zeros(3), ahead[3:4], 10.0, stop_at_unknown=True).end[0] == RayEnd.UNKNOWN
    lengths = np.array([[1e300, 0, 0], [1e39, 0, 0], [1e-46, 0, 0], [5e-324, 0, 0]])
    assert small.cast_rays(np.zeros(3), lengths, 10.0).distance_m.tolist() == [rays.distance_m[0]] * 4
    own = small.cast_rays(np.zeros((2, 3), np.float32), ahead[:2].astype(np.float32), 3.0)
    assert own.end.tolist() == [RayEnd.MAX_RANGE] * 2 and own.distance_m.tolist() == [3.0, 3.0]
    with pytest.raises(tessera.InputError, match="origins has 3 rows for 6 directions"):
        small.cast_rays(np.zeros((3, 3)), ahead, 10.0)
    for bad in (0.0, -1.0, np.nan, np.inf, 1e6):
        with pytest.raises(tessera.InputError, match="max_range_m"):
            small.cast_rays(np.zeros(3), ahead, bad)


def test_the_nearest_by_hand(small, wall):
    small.integrate(*wall)
    occupied = small.voxels(occupied_only=True)
    points = np.array([[5.0, 0, 0], [3.0, 0, 0], [200.0, 0, 0], [1e9, 0, 0], [np.nan, 0, 0]])
    near = small.nearest_occupied(points, 5.0)
    low = occupied.index * 0.1
    for i in (0, 1):
        gap = np.maximum(0, np.maximum(low - points[i], points[i] - (low + 0.1)))
        assert near.distance_m[i] == pytest.approx(np.sqrt((gap ** 2).sum(axis=1)).min(), abs=1e-6)
    assert near.found.tolist() == [True, True, False, False, False] and near.found.dtype == np.bool_
    assert near.complete.tolist() == [True, True, True, False, False]
    assert np.isnan(near.distance_m[2:]).all() and near.searched_m[2] == 5.0
    walls = small.nearest_occupied(points[1:2], 20.0, labels=[2])
    assert walls.label[0] == 2 and walls.distance_m[0] >= near.distance_m[1]
    assert not small.nearest_occupied(points[:1], 20.0, max_work=1).complete[0]
    for arguments in ({"radius_m": 0.0}, {"radius_m": 1e9}, {"radius_m": 1.0, "labels": [3]}, {"radius_m": 1.0, "labels": []},
                      {"radius_m": 1.0, "max_work": 0}):
        with pytest.raises(tessera.InputError):
            small.nearest_occupied(points, **arguments)
