# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Datasets in the KITTI layout, small enough to write anew for every test. Seeded; the same on every machine."""
import pathlib
import struct

IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
# Raw ids of SemanticKITTI.
CAR, ROAD, BUILDING, POLE, UNLABELLED = 10, 40, 50, 80, 0
# The same as labels of the map, 1 .. 19; 20 is the occupied but unlabelled component.
CAR_LABEL, ROAD_LABEL, BUILDING_LABEL, UNLABELLED_COMPONENT = 1, 9, 13, 20


class Random:
    """splitmix64."""

    def __init__(self, seed):
        self.state = seed

    def uniform(self, low, high):
        mask = (1 << 64) - 1
        self.state = (self.state + 0x9E3779B97F4A7C15) & mask
        x = self.state
        x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & mask
        x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & mask
        x ^= x >> 31
        return low + (high - low) * (x >> 11) / float(1 << 53)


class Scan:
    """points: (x, y, z) in metres, sensor frame. predicted, true: raw class ids, one a point."""

    def __init__(self, points, predicted, true=None, pose=IDENTITY):
        self.points = list(points)
        self.predicted = list(predicted)
        self.true = list(predicted if true is None else true)
        self.pose = pose


def corner_scan(seed, count=300, pose=IDENTITY):
    """A piece of road and a wall behind it."""
    random = Random(seed)
    points, ids = [], []
    for i in range(count):
        if i % 2 == 0:
            points.append((random.uniform(2, 6), random.uniform(-2, 2), -1.55))
            ids.append(ROAD)
        else:
            points.append((6.05, random.uniform(-2, 2), random.uniform(-1.5, 1)))
            ids.append(BUILDING)
    return Scan(points, ids, pose=pose)


def scattered_scan(seed, count=2000, reach=35.0):
    """Points far from one another, so that nearly each one needs blocks of its own."""
    random = Random(seed)
    points = [(random.uniform(3, reach), random.uniform(-reach, reach) / 2, random.uniform(-8, 8)) for _ in range(count)]
    return Scan(points, [ROAD] * count)


def moved(x, y=0.0, z=0.0):
    return (1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z)


def points_bytes(points):
    return b"".join(struct.pack("<4f", x, y, z, 0.5) for x, y, z in points)


def labels_bytes(ids):
    return struct.pack(f"<{len(ids)}I", *ids)


def write_dataset(folder, scans):
    """Writes velodyne, predictions, labels and poses.txt; without calib.txt, so that the pose is the LiDAR's."""
    root = pathlib.Path(folder)
    for part in ("velodyne", "predictions", "labels"):
        (root / part).mkdir(parents=True, exist_ok=True)
    for number, scan in enumerate(scans):
        (root / "velodyne" / f"{number:06d}.bin").write_bytes(points_bytes(scan.points))
        (root / "predictions" / f"{number:06d}.label").write_bytes(labels_bytes(scan.predicted))
        (root / "labels" / f"{number:06d}.label").write_bytes(labels_bytes(scan.true))
    write_poses(root, [scan.pose for scan in scans])
    return root


def write_poses(folder, poses):
    rows = (" ".join(str(value) for value in pose) for pose in poses)
    (pathlib.Path(folder) / "poses.txt").write_text("".join(row + "\n" for row in rows))
