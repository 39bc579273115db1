# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A map of arrays is the command's map, to the last bit; and it goes to a file and back."""
import os
import shutil
import subprocess
import warnings

import numpy as np
import pytest
from conftest import MEMORY_BYTES, OPTIONS, RESOLUTION_M, map_of

import tessera

# Of the command's report of a scan, with the same names.
COUNTERS = ("points", "voxel_updates", "left_out", "thinned", "admitted", "non_finite", "too_near", "beyond_range",
            "out_of_grid", "unlabelled", "unknown_ids", "refused_storage", "refused_tiles", "refused_ray_blocks",
            "refused_work", "over_capacity", "rays", "ray_steps", "tiles", "ray_blocks", "work_spent", "work_limit")


def test_the_digest_is_the_commands(maps, files):
    for made, (report, _) in zip(maps, files, strict=True):
        assert made.digest() == report["digest"]


def test_the_counters_are_the_commands(street, files):
    dataset = tessera.Dataset(street / "robot_0")
    made, reports = map_of(dataset, max_points=max(len(scan.points) for scan in dataset))
    for found, expected in zip(reports, files[0][0]["scans"], strict=True):
        assert {name: found.as_dict()[name] for name in COUNTERS} == {name: expected[name] for name in COUNTERS}
        assert found.as_dict()["admitted"] == found.admitted > 0
    usage, memory = made.usage(), files[0][0]["memory"]
    for name in ("budget_bytes", "used_bytes", "peak_bytes", "scratch_bytes", "label_voxels", "free_voxels", "refused",
                 "bytes_per_label_voxel", "blocks", "blocks_refused", "storage_refused"):
        assert usage[name] == memory[name], name


@pytest.mark.parametrize("arguments, options", [
    ({"inference": "counting", "carving": "image"}, ("--inference", "counting", "--carving", "image")),
    ({"inference": "counting", "free_space": False}, ("--inference", "counting", "--free-space", "off")),
    ({"inference": "kernel", "kernel_length_m": 0.4}, ("--inference", "kernel", "--kernel-length", "0.4")),
    ({"inference": "lattice"}, ("--inference", "lattice")),
    ({"inference": "lattice", "kernel_length_m": 0.4}, ("--inference", "lattice", "--kernel-length", "0.4")),
    ({"inference": "lattice", "kernels": "KERNELS"}, ("--inference", "lattice", "--kernels", "KERNELS")),
    ({"downsample_m": 0, "max_range_m": 15.0, "counts": "dense"},
     ("--downsample", "off", "--max-range", "15", "--counts", "dense")),
    ({"prior": 0.01, "min_weight": 0.01, "max_evidence": 50.0, "free_weight": 0.5, "thinning_weight": "sum"},
     ("--prior", "0.01", "--min-weight", "0.01", "--max-evidence", "50", "--free-weight", "0.5", "--thinning-weight", "sum")),
    ({"body": [2.0, -4.0, -3.0, 8.0, 4.0, 1.0], "no_return_range_m": 30}, ("--body=2,-4,-3,8,4,1", "--no-return-range", "30")),
    ({"work_budget": 200_000, "min_range_m": 2.0}, ("--work-budget", "200000", "--min-range", "2"))])
def test_every_option_is_the_commands(command, street, tmp_path, arguments, options):
    folder = street / "robot_0"
    kernels = tmp_path / "kernels.toml"
    kernels.write_text('[[kernel]]\nclass = "road"\nreach_m = 3.0\n')
    arguments = {name: kernels if value == "KERNELS" else value for name, value in arguments.items()}
    options = [kernels if option == "KERNELS" else option for option in options]
    report = command("map", "--dataset", folder, "--first", 0, "--last", 0, "--out", tmp_path / "a.tsm", *OPTIONS, *options,
                     report=tmp_path / "a.json")
    assert map_of(tessera.Dataset(folder, first=0, last=0), **arguments)[0].digest() == report["digest"]


def test_defaults_are_the_commands(command, street, tmp_path):
    folder = street / "robot_0"
    report = command("map", "--dataset", folder, "--first", 0, "--last", 0, "--out", tmp_path / "a.tsm", report=tmp_path / "a.json")
    scan = tessera.Dataset(folder, first=0, last=0)[0]
    made = tessera.LocalMap()
    made.integrate(scan.points, scan.components, scan.T_map_sensor)
    assert made.digest() == report["digest"]
    config = report["config"]
    for name in ("resolution", "prior", "max_range", "min_range", "downsample", "thinning_weight", "inference", "free_space", "carving",
                 "memory", "counts", "min_weight", "max_evidence", "free_weight", "work_budget", "deadline", "robot"):
        assert made.settings.get(name, config[name]) == config[name], name
    assert made.usage()["budget_bytes"] == config["memory"]


def test_raw_ids_are_learned_by_the_table(street):
    folder = street / "robot_0"
    dataset = tessera.Dataset(folder, first=0, last=0)
    scan = dataset[0]
    raw = np.fromfile(folder / "predictions/000000.label", np.uint32)
    assert np.array_equal(dataset.classes.components(raw), scan.components)
    digests = set()
    for labels in (scan.components, raw, raw | np.uint32(5 << 16), raw.astype(np.uint16)):
        made = tessera.LocalMap(dataset.classes, resolution_m=RESOLUTION_M, memory_bytes=MEMORY_BYTES)
        assert made.integrate(scan.points, labels, scan.T_map_sensor).unknown_ids == 0
        digests.add(made.digest())
    assert len(digests) == 1


def test_arrays_of_a_scan_are_views_that_outlive_it(street):
    scan = tessera.Dataset(street / "robot_0")[0]
    points, components = scan.points, scan.components
    assert np.shares_memory(points, scan.points) and np.shares_memory(components, scan.components)
    assert (points.dtype, points.shape[1], components.dtype) == (np.float32, 4, np.uint8) and points.flags.c_contiguous
    before = points.copy()
    del scan
    others = [one.points for one in tessera.Dataset(street / "robot_0")]
    assert np.array_equal(points, before) and np.array_equal(others[0], before) and not np.shares_memory(points, others[0])


def test_a_scan_of_lost_tracking_says_so(street, tmp_path):
    shutil.copytree(street / "robot_0", tmp_path / "lost")
    rows = (tmp_path / "lost" / "poses.txt").read_text().splitlines()
    rows[0] = " ".join(["nan"] * 12)
    (tmp_path / "lost" / "poses.txt").write_text("\n".join(rows) + "\n")
    dataset = tessera.Dataset(tmp_path / "lost")
    assert [scan.has_pose for scan in dataset] == [False] + [True] * (len(dataset) - 1)
    made = tessera.LocalMap(dataset.classes, resolution_m=RESOLUTION_M, memory_bytes=MEMORY_BYTES)
    with pytest.raises(tessera.InputError, match="T_map_sensor is not a rigid transform"):
        made.integrate(dataset[0].points, dataset[0].components, dataset[0].T_map_sensor)


def test_ids_of_no_class_are_counted_and_unlabelled(small, wall):
    points, labels = wall
    raw = labels.astype(np.uint32)
    raw[:5] = 7
    report = small.integrate(points, raw)
    assert (report.unknown_ids, report.unknown_id_examples, report.unlabelled) == (5, [7], 5)
    assert report.as_dict()["unknown_ids"] == 5
    assert small.integrate(points).unlabelled == len(points)


def warned(call, *arguments):
    """What a call says."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        call(*arguments)
    assert all(one.category is UserWarning and one.filename == __file__ for one in found)
    return [str(one.message) for one in found]


def test_scans_of_which_nothing_is_mapped_are_warned_about_once(small, wall):
    points, labels = wall
    says = {
        "nothing was mapped: the scan has no points; check the input": points[:0],
        "no point was mapped: all 800 points are beyond max_range_m; give a larger one, or points in metres": 1000 * points,
        "no point was mapped: all 800 points are nearer to the sensor than min_range_m; give a smaller one, or points in metres":
            1e-3 * points}
    for expected, given in says.items():
        scan = (given.astype(np.float32), labels[:len(given)])
        assert warned(small.integrate, *scan) == [expected]
        assert warned(small.integrate, *scan) == []
    assert warned(small.integrate, *wall) == []
    other = tessera.LocalMap(small.classes, memory_bytes=32 << 20, max_points=4096)
    assert warned(other.integrate, points[:0]) == ["nothing was mapped: the scan has no points; check the input"]


def test_labels_of_no_class_are_warned_about_once(small, wall):
    points, labels = wall
    unlabelled = small.classes.unlabelled
    raw = np.full(len(points), 7, np.uint32)
    assert warned(small.integrate, points, raw) == ["800 points with class ids that are in no class (7); taken as unlabelled"]
    assert warned(small.integrate, points, raw) == []
    high = labels.copy()
    high[:3] = [unlabelled + 1, 255, unlabelled]
    assert warned(small.integrate, points, high) == [
        "2 points with uint8 labels above 3; taken as unlabelled: give 1 to 2, or 3 for unlabelled; raw ids as uint16 or uint32"]
    assert warned(small.integrate, points, high[::-1]) == []


def test_the_commands_sentence_has_its_own_names(street, tmp_path):
    done = subprocess.run([os.environ["TESSERA_COMMAND"], "map", "--dataset", street / "robot_0", "--out", tmp_path / "a.tsm", "--max-range", "1",
                           "--min-range", "0.5", *OPTIONS], capture_output=True, text=True, timeout=120, check=True)
    assert "are beyond --max-range; give a larger one, or points in metres" in done.stderr


def test_weights_count(small, wall):
    points, labels = wall
    made = [tessera.LocalMap(small.classes, memory_bytes=32 << 20, max_points=4096, inference="counting", free_space=False,
                             downsample_m=0) for _ in range(3)]
    ones = np.ones(len(points), np.float32)
    for one, weights in zip(made, (None, ones, 2 * ones), strict=True):
        one.integrate(points, labels, None, weights)
    total = [one.voxels().evidence.sum() for one in made]
    assert total[0] == len(points)
    assert made[0].digest() == made[1].digest()
    assert total[2] == 2 * len(points)
    bad = ones.copy()
    bad[:3] = [np.nan, -1, 2e6]
    assert made[0].integrate(points, labels, weights=bad).non_finite == 3


def test_save_and_load(maps, command, tmp_path):
    path = tmp_path / "made.tsm"
    maps[1].save(path)
    info = command("info", path, report=tmp_path / "info.json")
    assert (info["digest"], info["robot"], info["kind"]) == (maps[1].digest(), 1, "local")
    loaded = tessera.load(path)
    assert (loaded.digest(), loaded.kind, loaded.robot) == (maps[1].digest(), "local", 1)
    assert loaded.classes == maps[1].classes and not loaded.classes.has_raw_ids
    assert np.array_equal(loaded.T_global_map, maps[1].T_global_map)
    assert loaded.settings == maps[1].settings and loaded.settings["max_range"] == 40.0
    again = tmp_path / "again.tsm"
    loaded.save(again)
    assert again.read_bytes() == path.read_bytes()
    assert sorted(tmp_path.glob("*.part")) == []


def test_a_file_goes_on(street, files, command, tmp_path):
    dataset = tessera.Dataset(street / "robot_0")
    first = tmp_path / "first.tsm"
    half, _ = map_of(tessera.Dataset(street / "robot_0", first=0, last=0))
    half.save(first)
    gone_on = tessera.LocalMap.load(first, dataset.classes, memory_bytes=MEMORY_BYTES)
    scan = dataset[1]
    raw = np.fromfile(street / "robot_0/predictions/000001.label", np.uint32)
    gone_on.integrate(scan.points, raw, scan.T_map_sensor)
    assert gone_on.digest() == files[0][0]["digest"]
    without = tessera.LocalMap.load(first, memory_bytes=MEMORY_BYTES)
    with pytest.raises(tessera.InputError, match="raw ids"):
        without.integrate(scan.points, raw, scan.T_map_sensor)
    without.integrate(scan.points, scan.components, scan.T_map_sensor)
    assert without.digest() == files[0][0]["digest"]


def test_what_a_file_fixes_is_on_record_when_it_goes_on(wall, tmp_path):
    fixed = {"resolution_m": 0.2, "prior": 0.01, "counts": "dense", "max_evidence": 200.0, "free_weight": 1.0, "robot": 3}
    first = tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, max_points=4096, **fixed)
    first.integrate(*wall)
    first.save(tmp_path / "first.tsm")
    gone_on = tessera.LocalMap.load(tmp_path / "first.tsm", memory_bytes=32 << 20, max_points=4096)
    assert gone_on.settings == first.settings
    assert [gone_on.settings[key] for key in ("resolution", "prior", "counts", "max_evidence", "free_weight", "robot")] \
        == list(fixed.values())
    assert (gone_on.prior, gone_on.robot) == (0.01, 3)
    gone_on.save(tmp_path / "again.tsm")
    assert tessera.load(tmp_path / "again.tsm").settings == first.settings
    with pytest.warns(UserWarning, match="first.tsm was made with inference lattice and continues with counting"):
        tessera.LocalMap.load(tmp_path / "first.tsm", memory_bytes=32 << 20, max_points=4096, inference="counting")


def test_a_map_goes_on_in_the_lattice_mode(wall, tmp_path):
    first = tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, max_points=4096, inference="lattice")
    first.integrate(*wall)
    first.save(tmp_path / "first.tsm")
    gone_on = tessera.LocalMap.load(tmp_path / "first.tsm", memory_bytes=32 << 20, max_points=4096, inference="lattice")
    assert gone_on.integrate(*wall).admitted > 0
    assert len(gone_on.voxels()) == len(first.voxels()) > 0


def test_clear_forgets_all(small, wall):
    empty = small.digest()
    small.integrate(*wall)
    assert small.digest() != empty
    small.clear()
    assert small.digest() == empty and len(small.voxels()) == 0


def test_the_budget_holds(wall):
    points, labels = wall
    tight = tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=26 << 20, max_points=64)
    with pytest.warns(UserWarning, match=f"{len(points)} points are more than max_points 64"):
        report = tight.integrate(points, labels)
    assert report.over_capacity == report.left_out == len(points) - 64
    usage = tight.usage()
    assert usage["refused"] == len(points) - 64
    assert usage["used_bytes"] + usage["scratch_bytes"] <= usage["budget_bytes"] == 26 << 20


def test_refused_is_what_the_command_counts(command, street, tmp_path):
    folder = street / "robot_0"
    memory = command("map", "--dataset", folder, "--first", 0, "--last", 0, "--out", tmp_path / "a.tsm", "--resolution", "0.05",
                     "--memory", 24 << 20, "--window", 100, report=tmp_path / "a.json")["memory"]
    dataset = tessera.Dataset(folder, first=0, last=0)
    made, reports = map_of(dataset, resolution_m=0.05, memory_bytes=24 << 20, max_points=max(len(scan.points) for scan in dataset))
    usage = made.usage()
    assert usage["refused"] == memory["refused"] == sum(r.over_capacity + r.refused_memory + r.rays_refused_memory for r in reports)
    assert usage["refused"] > usage["blocks_refused"] + usage["storage_refused"]
    made.clear()
    assert made.usage()["refused"] == 0


def test_the_text_of_a_map_counts_its_voxels(small, wall):
    assert repr(small) == "<tessera map, local, 0 voxels labelled or occupied>"
    small.integrate(wall[0])
    assert repr(small) == f"<tessera map, local, {small.usage()['label_voxels']} voxels labelled or occupied>"


def test_clouds_are_read(small, wall, tmp_path):
    points, labels = wall
    rows = "".join(f"{x:.9g} {y:.9g} {z:.9g} {l}\n" for (x, y, z), l in zip(points, labels, strict=True))
    header = (f"VERSION 0.7\nFIELDS x y z label\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\n"
              f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA ascii\n")
    (tmp_path / "0.pcd").write_text(header + rows)
    (tmp_path / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    (tmp_path / "classes.toml").write_text("".join(
        f'[[class]]\nid = {i}\nname = "{n}"\ncolor = [0, 0, {i}]\nraw = [{i}]\n' for i, n in ((1, "road"), (2, "wall"))))
    xyzi, ids = tessera.read_cloud(tmp_path / "0.pcd")
    assert np.array_equal(xyzi[:, :3], points) and np.array_equal(ids, labels)
    clouds = tessera.Clouds(tmp_path, tmp_path / "poses.txt")
    assert len(clouds) == 1 and clouds.classes.names == ["road", "wall"]
    assert np.array_equal(clouds[0].points[:, :3], points) and np.array_equal(clouds[-1].components, labels)
    with pytest.raises(IndexError):
        clouds[1]
    (tmp_path / "1.pcd").write_text(header.replace("POINTS 800", "POINTS 4000000000"))
    with pytest.raises(tessera.InputError, match="1.pcd"):
        tessera.read_cloud(tmp_path / "1.pcd")
