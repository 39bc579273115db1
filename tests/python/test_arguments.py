# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What may be given, what it is taken for, and what is refused, with which words."""
import itertools
import resource

import numpy as np
import pytest

import tessera


def digest_of(classes, *arguments):
    made = tessera.LocalMap(classes, memory_bytes=32 << 20, max_points=4096)
    made.integrate(*arguments)
    return made.digest()


def test_any_layout_with_x_y_z_together_is_the_same(small, wall):
    points, labels = wall
    expected = digest_of(small.classes, points, labels)
    wide = np.full((len(points), 6), np.nan, np.float32)
    wide[:, :3] = points
    every_other = np.full((2 * len(points), 4), np.nan, np.float32)
    every_other[::2, :3] = points
    gaps = np.zeros(2 * len(labels), np.uint8)
    gaps[::2] = labels
    read_only = points.copy()
    read_only.flags.writeable = False
    for layout in (wide, wide[:, :3], every_other[::2], read_only):
        assert digest_of(small.classes, layout, labels) == expected
        assert digest_of(small.classes, layout, gaps[::2].astype(np.uint32)) == expected
    assert digest_of(small.classes, points, gaps[::2]) == expected
    assert digest_of(small.classes, points, labels[::-1].copy()[::-1]) == expected
    assert digest_of(small.classes, points[:1][::-1]) == digest_of(small.classes, points[:1])


def test_what_is_given_is_not_written_to(small, wall):
    points, labels = wall
    before = points.copy(), labels.copy()
    small.integrate(points, labels)
    assert np.array_equal(points, before[0]) and np.array_equal(labels, before[1])


def test_points_are_not_copied(small):
    # A view of one row, a million million times, for which there is no memory anywhere: it is refused for its number alone.
    one = np.array([[3, 0, 0, 0]], np.float32)
    many = np.broadcast_to(one, (1 << 40, 4))
    with pytest.raises(tessera.InputError, match="at most"):
        small.integrate(many)
    within = np.broadcast_to(one, (1 << 24, 4))
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    report = small.integrate(within)
    # A copy would be 256 MiB.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib < 64 << 10
    assert (report.points, report.over_capacity) == (1 << 24, (1 << 24) - 4096)


@pytest.mark.parametrize("name", ["points", "labels", "weights", "truth"])
def test_types_are_refused_with_the_remedy(small, wall, name):
    points, labels = wall
    weights = np.ones(len(points), np.float32)
    given = {"points": points, "labels": labels, "weights": weights, "truth": labels}
    wrong = {"points": np.float64, "weights": np.float64, "labels": np.int64, "truth": np.int64}[name]
    given[name] = given[name].astype(wrong)
    with pytest.raises(TypeError, match=rf"{name} is of .*64; give .*{name}.astype\(numpy"):
        if name == "truth":
            tessera.Evaluation(small).add(points, given["truth"])
        else:
            del given["truth"]
            small.integrate(**given)
    if name == "labels":
        with pytest.raises(TypeError, match=r"labels.astype\(numpy.uint8\) if they are classes 1 .. C, labels.astype\(numpy.uint32\) if they are raw ids"):
            small.integrate(points, given["labels"])
    with pytest.raises(TypeError):
        small.integrate(given["points"].astype(">f4"), labels)
    assert len(small.voxels()) == 0


def test_the_remedy_for_labels_gives_their_classes(wall):
    points, labels = wall
    kitti = tessera.ClassTable.semantic_kitti()
    wide = {np.uint8: np.where(labels == 1, 9, 13).astype(np.int64), np.uint32: np.where(labels == 1, 40, 50).astype(np.int64)}
    for remedy, numbers in wide.items():
        made = tessera.LocalMap(kitti, memory_bytes=32 << 20, max_points=4096)
        with pytest.raises(TypeError, match=rf"labels.astype\(numpy.{remedy.__name__}\)"):
            made.integrate(points, numbers)
        made.integrate(points, numbers.astype(remedy))
        assert {kitti.names[label - 1] for label in np.unique(made.voxels(occupied_only=True).label) if label} == {"road", "building"}


def test_shapes_are_refused(small, wall):
    points, labels = wall
    bad_points = (points[:, :2], points[0], points.reshape(2, -1, 3), np.zeros((3, 0), np.float32),
                  np.ascontiguousarray(points.T))
    for bad in bad_points:
        with pytest.raises(tessera.InputError, match=r"points has the shape .*give \(N, 3\)"):
            small.integrate(bad)
    for bad in (labels[:-1], np.zeros((len(labels), 1), np.uint8), np.zeros(0, np.uint8)):
        with pytest.raises(tessera.InputError, match="labels has the shape"):
            small.integrate(points, bad)
    with pytest.raises(tessera.InputError, match="weights has the shape"):
        small.integrate(points, labels, weights=np.ones(3, np.float32))
    assert len(small.voxels()) == 0


def test_layouts_that_cannot_be_read_are_refused(small, wall):
    points, labels = wall
    unaligned = np.frombuffer(b"-" + points.tobytes(), np.float32, offset=1).reshape(-1, 3)
    packed = np.zeros(len(points), np.dtype([("p", np.float32, 3), ("c", np.uint8)]))["p"]
    for bad in (np.asfortranarray(points), points[::-1], points[:, ::-1], unaligned, packed):
        with pytest.raises(tessera.InputError, match=r"ascontiguousarray\(points\)"):
            small.integrate(bad, labels)
    with pytest.raises(tessera.InputError, match=r"ascontiguousarray\(weights\)"):
        small.integrate(points, labels, weights=np.ones(2 * len(points), np.float32)[::2])


def test_what_is_in_points_is_counted(small):
    points = np.array([[3, 0, 0], [np.nan, 0, 0], [np.inf, 0, 0], [0.1, 0, 0], [3e38, 3e38, 3e38], [100, 0, 0]], np.float32)
    report = small.integrate(points, np.array([1, 1, 1, 1, 1, 200], np.uint8))
    assert (report.points, report.non_finite, report.too_near, report.beyond_range, report.out_of_grid) == (6, 2, 1, 1, 1)
    assert report.admitted == 1


def test_nothing_is_a_scan_too(small):
    for empty in (np.zeros((0, 3), np.float32), np.zeros((0, 4), np.float32)):
        assert small.integrate(empty, np.zeros(0, np.uint32)).points == 0
        assert small.integrate(empty).points == 0


def test_absurd_poses_are_refused_and_change_nothing(small, wall):
    good = np.eye(4)
    poses = []
    for value, place in itertools.product((np.nan, np.inf, 2.0), ((0, 0), (1, 2), (3, 0))):
        pose = good.copy()
        pose[place] = value
        poses.append(pose)
    mirrored = np.diag([1.0, 1.0, -1.0, 1.0])
    far = good.copy()
    far[0, 3] = 1e9
    nowhere = good.copy()
    nowhere[0, 3] = np.nan
    for pose in (*poses, mirrored, far, nowhere, np.zeros((4, 4)), np.eye(3), np.zeros((3, 4)), [1, 2, 3]):
        with pytest.raises(tessera.InputError, match="T_map_sensor"):
            small.integrate(*wall, pose)
    with pytest.raises((TypeError, ValueError)):
        small.integrate(*wall, "north")
    assert len(small.voxels()) == 0


def test_poses_of_other_types_and_shapes(small, wall):
    T = np.eye(4)
    T[:3, 3] = [1, 2, 3]
    digests = {digest_of(small.classes, *wall, pose)
               for pose in (T, T[:3], T.tolist(), T.astype(np.float32), T.astype(np.int64), np.asfortranarray(T))}
    assert len(digests) == 1


@pytest.mark.parametrize("arguments, words", [
    ({"resolution_m": 0}, "resolution_m 0"), ({"resolution_m": float("nan")}, "resolution_m"), ({"prior": -1}, "prior -1"),
    ({"inference": "magic"}, "inference magic"), ({"inference": "counting", "kernel_length_m": 0.5}, "kernel_length_m applies to"),
    ({"inference": "kernel", "kernel_length_m": 99}, "kernel_length_m 99"), ({"max_range_m": -1}, "max_range_m -1"),
    ({"min_range_m": -1}, "min_range_m"), ({"downsample_m": -2}, "downsample_m -2"), ({"counts": "many"}, "counts many"),
    ({"thinning_weight": "some"}, "thinning_weight some"), ({"min_weight": 2}, "min_weight"),
    ({"max_evidence": 1e9}, "max_evidence"), ({"free_weight": 0}, "free_weight 0"), ({"memory_bytes": 4096}, r"memory_bytes 4096 bytes is too little for a map; take carving rays, which needs 16777216 bytes less, or give at least [0-9]+ bytes$"),
    ({"memory_bytes": 1 << 51}, r"memory_bytes.*give bytes, at most 10\^15$"), ({"downsample_m": -1}, "or 0 for none$"),
    ({"deadline_ms": -1}, "deadline_ms"), ({"max_points": 0}, "max_points 0"), ({"max_points": 1 << 30}, "max_points"),
    ({"T_global_map": np.zeros((4, 4))}, "T_global_map")])
def test_settings_out_of_range_are_refused_by_their_names(arguments, words):
    with pytest.raises(tessera.InputError, match=words) as refused:
        tessera.LocalMap(**{"memory_bytes": 32 << 20, **arguments})
    assert "--" not in str(refused.value)


def test_what_no_system_gives_is_an_error():
    with pytest.raises((tessera.Error, MemoryError)):
        tessera.LocalMap(memory_bytes=1 << 49)


def test_errors_are_what_python_expects():
    assert issubclass(tessera.InputError, tessera.Error) and issubclass(tessera.InputError, ValueError)
    assert issubclass(tessera.Error, RuntimeError)
    assert tessera.Error.__doc__ and tessera.InputError.__module__ == "tessera"


def test_files_that_are_none(tmp_path):
    with pytest.raises(tessera.InputError, match="none.tsm"):
        tessera.load(tmp_path / "none.tsm")
    damaged = tmp_path / "damaged.tsm"
    tessera.LocalMap(memory_bytes=32 << 20, max_points=64).save(damaged)
    whole = damaged.read_bytes()
    for content in (b"", b"x" * 100, whole[:-3], whole[:40] + b"!" + whole[41:]):
        damaged.write_bytes(content)
        for load in (tessera.load, tessera.LocalMap.load):
            with pytest.raises(tessera.InputError, match="damaged.tsm"):
                load(damaged)
    with pytest.raises(tessera.Error):
        tessera.LocalMap(memory_bytes=32 << 20, max_points=64).save(tmp_path / "no" / "folder.tsm")
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(tessera.InputError):
            tessera.Dataset(folder)


def test_class_tables(small):
    table = tessera.ClassTable(["a", "b"], colors=np.array([[1, 2, 3], [4, 5, 6]], np.uint8))
    assert (table.names, table.num_classes, table.num_components, table.unlabelled, len(table)) == (["a", "b"], 2, 4, 3, 2)
    assert table.colors.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert table.components(np.array([0, 1, 2, 3, 65536 + 1], np.uint32)).tolist() == [3, 1, 2, 3, 1]
    assert table != small.classes and table != 1 and small.classes == tessera.ClassTable(["road", "wall"], colors=small.classes.colors)
    assert tessera.ClassTable(["car", "wall"]).moves == [True, False]
    assert tessera.ClassTable(["car", "wall"], moves=[False, True]).moves == [False, True]
    with pytest.raises(tessera.InputError, match="moves is not a truth value for each name"):
        tessera.ClassTable(["car", "wall"], moves=[True])
    many = tessera.ClassTable([f"c{i}" for i in range(62)])
    assert len({tuple(color) for color in many.colors}) == 62
    assert len(tessera.ClassTable.semantic_kitti()) == 19
    for names in ([], ["a"] * 2, [""], ["a" * 32], ["a\0b"], [f"c{i}" for i in range(63)]):
        with pytest.raises(tessera.InputError):
            tessera.ClassTable(names)
    with pytest.raises(tessera.InputError, match="colors"):
        tessera.ClassTable(["a"], colors=np.zeros((2, 3), np.uint8))
    with pytest.raises(tessera.InputError, match="line"):
        tessera.ClassTable.parse("[[class]]\nid = 2\n")
    with pytest.raises(TypeError):
        table.components(np.array([1], np.uint8))


BIG = [[0.0, 1.0, 2.0]] * 1000


@pytest.mark.parametrize("call, says", [
    (lambda m: m.integrate(BIG), "points is of type list; give a numpy array"),
    (lambda m: m.integrate(np.zeros((1, 3), np.float32), labels=[1]), "labels is of type list; give a numpy array or None"),
    (lambda m: m.integrate(np.zeros((1, 3), np.float32), None, "here"), "T_map_sensor is of type str; give a numpy array or None"),
    (lambda m: m.integrate(np.zeros((1, 3), np.float32), pose=1), "tessera.LocalMap.integrate has no argument pose; help(tessera.LocalMap.integrate) lists them"),
    (lambda m: m.integrate(1, 2, 3, 4, 5), "tessera.LocalMap.integrate takes 4 arguments without their names; help(tessera.LocalMap.integrate) lists them"),
    (lambda m: m.query(BIG), "points is of type list; give a numpy array"),
    (lambda m: m.save(5), "path is of type int; give a path"),
    (lambda m: tessera.LocalMap(["road"]), "classes is of type list; give a ClassTable or None"),
    (lambda m: tessera.LocalMap(max_points="many"), "max_points is of type str; give a whole number"),
    (lambda m: tessera.ClassTable(["road", 2]), "names has an item of type int; give a list, each of it text"),
    (lambda m: tessera.Sharer(BIG), "map is of type list; give a LocalMap"),
    (lambda m: tessera.Sharer(m, epoch="first"), "epoch is of type str; give a whole number"),
    (lambda m: tessera.Evaluation(BIG), "map is of type list; give a Map"),
    (lambda m: tessera.fuse([m, 2]), "maps has an item of type int; give a list, each of it a Map or a path"),
])
def test_a_wrong_type_gets_one_sentence_and_no_data(call, says, small):
    with pytest.raises(TypeError) as error:
        call(tessera.LocalMap(small.classes, memory_bytes=32 << 20, max_points=64))
    assert str(error.value) == says
    assert error.value.__cause__ is None and error.value.__suppress_context__ is False and error.value.__context__ is None


@pytest.mark.parametrize("call, kind, says", [
    (lambda m: tessera.Sharer(), TypeError, "tessera.Sharer needs map; help(tessera.Sharer) lists its arguments"),
    (lambda m: tessera.Sharer(epoch=2), TypeError, "tessera.Sharer needs map; help(tessera.Sharer) lists its arguments"),
    (lambda m: m.cast_rays(np.zeros(3)), TypeError, "tessera.Map.cast_rays needs directions and max_range_m; help(tessera.Map.cast_rays) lists its arguments"),
    (lambda m: tessera.load(), TypeError, "tessera.load needs path; help(tessera.load) lists its arguments"),
    (lambda m: m.integrate(np.zeros((1, 3), np.float32), points=1), TypeError, "points is given twice, once without its name; give it once"),
    (lambda m: m.box((0, 0), (1, 1, 1)), tessera.InputError, "low has 2 items; give 3"),
    (lambda m: tessera.LocalMap(max_points=-3), tessera.InputError, "max_points -3 is not allowed; give a whole number from 1 to 16777216"),
    (lambda m: tessera.LocalMap.load("none.tsm", max_points=0), tessera.InputError, "max_points 0 is not allowed; give a whole number from 1 to 16777216"),
    (lambda m: tessera.LocalMap(max_points=1 << 70), tessera.InputError, f"max_points {1 << 70} is not allowed; give a whole number from 1 to 16777216"),
    (lambda m: tessera.Sharer(m, epoch=-1), tessera.InputError, "epoch -1 is not allowed; give 0 to 4294967295"),
    (lambda m: tessera.Sharer(m, epoch=1 << 32), tessera.InputError, "epoch 4294967296 is not allowed; give 0 to 4294967295"),
    (lambda m: tessera.Sharer(m, fusion_memory_bytes=32 << 20).exclude(-1), tessera.InputError, "robot -1 is not allowed; give 0 to 4294967295"),
    (lambda m: tessera.Sharer(m, fusion_memory_bytes=32 << 20).set_frame(np.eye(4), -1), tessera.InputError, "submap -1 is not allowed; give 0 to 4294967295"),
    (lambda m: tessera.Sharer(m, fusion_memory_bytes=32 << 20).tick(1 << 63), tessera.InputError, f"now_us {1 << 63} is not allowed; give a whole number from -2^63 to 2^63 - 1"),
    (lambda m: m.nearest_occupied(np.zeros((1, 3)), 1.0, max_work=-1), tessera.InputError, "max_work -1 is not allowed; give 1 to 1073741824"),
    (lambda m: m.nearest_occupied(np.zeros((1, 3)), 1.0, labels=[1, 1 << 40]), tessera.InputError, f"labels has {1 << 40}; give classes from 1 to 2"),
    (lambda m: tessera.Dataset("none", first=-1), tessera.InputError, "first -1 is not allowed; give 0 to 2147483647"),
    (lambda m: tessera.Dataset("none", last=1 << 40), tessera.InputError, f"last {1 << 40} is not allowed; give 0 to 2147483647"),
])
def test_what_is_missing_or_out_of_range_is_named(call, kind, says, small):
    with pytest.raises((TypeError, tessera.Error)) as error:
        call(small)
    assert (error.type, str(error.value)) == (kind, says)
