# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Datasets made of others: scans of several robots in one frame, labels that are wrong on purpose, frames that are."""
import array
import math
import os
import random
import shutil

FOLDERS = {"velodyne": ".bin", "labels": ".label", "predictions": ".label"}
# Raw ids of SemanticKITTI, one for each class that is learned.
RAW_IDS = (10, 11, 15, 18, 20, 30, 31, 32, 40, 44, 48, 49, 50, 51, 70, 71, 72, 80, 81)
IDENTITY = [[1.0 if i == j else 0.0 for j in range(4)] for i in range(4)]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def inverse(T):
    """Of a rigid transform."""
    R = [[T[j][i] for j in range(3)] for i in range(3)]
    t = [-sum(R[i][k] * T[k][3] for k in range(3)) for i in range(3)]
    return [[*R[i], t[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def read_transform(path):
    numbers = [float(word) for word in path.read_text().split()]
    return [numbers[4 * i:4 * i + 4] for i in range(4)]


def write_transform(path, T):
    path.write_text("".join(" ".join(repr(number) for number in row) + "\n" for row in T))
    return path


def read_poses(dataset):
    """T_map_sensor of each scan, as 4 x 4 rows; for datasets without calib.txt."""
    rows = [[float(word) for word in line.split()] for line in (dataset / "poses.txt").read_text().splitlines()]
    return [[row[0:4], row[4:8], row[8:12], [0.0, 0.0, 0.0, 1.0]] for row in rows]


def place_of(dataset):
    """T_global_map."""
    path = dataset / "T_global_map.txt"
    return read_transform(path) if path.exists() else IDENTITY


def name_of(scan, suffix):
    return f"{scan:06d}{suffix}"


def join(folder, parts):
    """A dataset in the global frame of the scans of several: parts are (dataset, scan numbers)."""
    shutil.rmtree(folder, ignore_errors=True)
    for name in FOLDERS:
        (folder / name).mkdir(parents=True)
    poses = []
    for dataset, scans in parts:
        T_global_map, all_poses = place_of(dataset), read_poses(dataset)
        for scan in scans:
            for name, suffix in FOLDERS.items():
                os.symlink((dataset / name / name_of(scan, suffix)).resolve(), folder / name / name_of(len(poses), suffix))
            T = product(T_global_map, all_poses[scan])
            poses.append(" ".join(repr(number) for row in T[:3] for number in row))
    (folder / "poses.txt").write_text("\n".join(poses) + "\n")
    return folder


def subset(folder, dataset, scans):
    """A dataset of some scans of another, in its frame."""
    shutil.rmtree(folder, ignore_errors=True)
    for name in FOLDERS:
        (folder / name).mkdir(parents=True)
    lines = (dataset / "poses.txt").read_text().splitlines()
    for number, scan in enumerate(scans):
        for name, suffix in FOLDERS.items():
            if (dataset / name).exists():
                os.symlink((dataset / name / name_of(scan, suffix)).resolve(), folder / name / name_of(number, suffix))
    (folder / "poses.txt").write_text("\n".join(lines[scan] for scan in scans) + "\n")
    if (dataset / "calib.txt").exists():
        os.symlink((dataset / "calib.txt").resolve(), folder / "calib.txt")
    return folder


def read_ids(path):
    return array.array("I", path.read_bytes())


def confusion(dataset):
    """What the predictions of a dataset take each true id for: a list of ids by id, one for each point."""
    taken = {}
    for path in sorted((dataset / "labels").glob("*.label")):
        for truth, found in zip(read_ids(path), read_ids(dataset / "predictions" / path.name)):
            taken.setdefault(truth & 0xFFFF, []).append(found)
    return taken


def confuse(folder, dataset, taken, seed, cell_m=0.4, run=4, single=0.1):
    """The dataset, of a sensor that stands, with predictions drawn from a confusion: one draw for each cell, class and run of
    scans, and for that share of the points a draw of their own."""
    subset(folder, dataset, range(len((dataset / "poses.txt").read_text().splitlines())))
    for path in sorted((dataset / "labels").glob("*.label")):
        scan = int(path.stem)
        points, draw = array.array("f", (dataset / "velodyne" / f"{path.stem}.bin").read_bytes()), random.Random(f"{seed} {scan}")
        drawn, ids = {}, array.array("I")
        for i, truth in enumerate(read_ids(path)):
            known = taken.get(truth & 0xFFFF)
            if known is None:
                ids.append(truth & 0xFFFF)
            elif draw.random() < single:
                ids.append(draw.choice(known))
            else:
                key = (*(math.floor(x / cell_m) for x in points[4 * i:4 * i + 3]), truth & 0xFFFF, scan // run)
                if key not in drawn:
                    drawn[key] = random.Random(f"{seed} {key}").choice(known)
                ids.append(drawn[key])
        target = folder / "predictions" / path.name
        target.unlink(missing_ok=True)  # a link to those of the dataset
        target.write_bytes(ids.tobytes())
    return folder


def thin(folder, dataset, raw_ids, share, seed):
    """The dataset with that share of the points alone that truly are of some ids."""
    subset(folder, dataset, range(len((dataset / "poses.txt").read_text().splitlines())))
    for path in sorted((dataset / "labels").glob("*.label")):
        draw = random.Random(f"{seed} {path.stem}")
        kept = [truth & 0xFFFF not in raw_ids or draw.random() < share for truth in read_ids(path)]
        for name, suffix in FOLDERS.items():
            size = 16 if suffix == ".bin" else 4
            held = (dataset / name / (path.stem + suffix)).read_bytes()
            written = folder / name / (path.stem + suffix)
            written.unlink()
            written.write_bytes(b"".join(held[size * i:size * (i + 1)] for i, keep in enumerate(kept) if keep))
    return folder


def relabel(folder, dataset, scans, change):
    """The dataset with predictions[i] = change(prediction); files that do not change are links. Made once."""
    if (folder / "complete").exists():
        return folder
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for entry in dataset.iterdir():
        if entry.name != "predictions":
            os.symlink(entry.resolve(), folder / entry.name)
    (folder / "predictions").mkdir()
    for path in sorted((dataset / "predictions").glob("*.label")):
        target = folder / "predictions" / path.name
        if int(path.stem) not in scans:
            os.symlink(path.resolve(), target)
            continue
        ids = read_ids(path)
        target.write_bytes(array.array("I", map(change, ids)).tobytes())
    (folder / "complete").touch()
    return folder


def noise(share, seed):
    """Replaces that share of all labels by a class drawn evenly from all."""
    draw = random.Random(seed)
    return lambda raw: draw.choice(RAW_IDS) if draw.random() < share else raw


# Of things that move, those of what they are.
STANDING_IDS = {252: 10, 253: 31, 254: 30, 255: 32, 256: 18, 257: 18, 258: 18, 259: 20}


def permute(raw):
    """Each class taken for another one, no two for the same."""
    known = STANDING_IDS.get(raw & 0xFFFF, raw & 0xFFFF)
    return RAW_IDS[(RAW_IDS.index(known) + 7) % len(RAW_IDS)] if known in RAW_IDS else raw


def half_permuted(seed):
    """Half of the labels as permute() has them."""
    draw = random.Random(seed)
    return lambda raw: permute(raw) if draw.random() < 0.5 else raw


# Both ways: moving ones too.
SWAPPED = {10: 70, 252: 70, 70: 10, 40: 48, 48: 40}


def swap(raw):
    """Car and vegetation, road and sidewalk taken for each other."""
    return SWAPPED.get(raw & 0xFFFF, raw)


def direction(draw):
    """Evenly from all directions."""
    while True:
        v = [draw.uniform(-1.0, 1.0) for _ in range(3)]
        length = math.sqrt(sum(x * x for x in v))
        if 0.1 < length <= 1.0:
            return [x / length for x in v]


def wrong_place(T_global_map, metres, degrees, seed):
    """T_global_map moved by so much and then turned in place by so much, directions by the seed."""
    draw = random.Random(seed)
    shift, (x, y, z) = direction(draw), direction(draw)
    a = math.radians(degrees)
    c, s, d = math.cos(a), math.sin(a), 1.0 - math.cos(a)
    R = [[c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0.0],
         [y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0.0],
         [z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0.0], [0.0, 0.0, 0.0, 1.0]]
    T = product(T_global_map, R)
    for i in range(3):
        T[i][3] += metres * shift[i]
    return T
