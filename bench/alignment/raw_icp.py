#!/usr/bin/python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""raw_icp.py pcd|kitti SCANS POSES CALIB FIRST LAST FIRST LAST: T_a_b, 16 numbers, that point-to-plane ICP gives between the points of
two ranges of scans, begun where the poses put them. CALIB need not be there. Needs numpy and scipy.
raw_icp.py pcd|kitti SCANS POSES CALIB FIRST LAST FILE: writes the points of one range, of cells of 0.1 m, as float32 x, y, z.

It tells by how much the poses of the two halves disagree: an error against these poses cannot fall under that."""
import pathlib
import sys

import numpy
from scipy.spatial import cKDTree

from transforms import read_calibration, read_poses

NEAR_M, FAR_M = 0.5, 60.0
CELLS_M = (0.05, 0.1)  # A keeps more points, of which planes are made.
ROUNDS_M = (1.0,) * 5 + (0.3,) * 7 + (0.15,) * 18
NEIGHBOURS = 15
FLAT = 0.05  # Smallest over middle eigenvalue of a plane.
SCALE_M = 0.05
MOST = 20_000


def read_pcd(path):
    data = path.read_bytes()
    end = data.index(b"\n", data.index(b"DATA ")) + 1
    head = {line.split()[0]: line.split()[1:] for line in data[:end].decode().splitlines() if line and line[0] != "#"}
    count = int(head["POINTS"][0])
    if head["FIELDS"][:3] != ["x", "y", "z"] or head["SIZE"][:3] != ["4"] * 3:
        sys.exit(f"raw_icp.py: {path} does not begin with x, y, z as float32")
    if head["DATA"] == ["ascii"]:
        return numpy.loadtxt(data[end:].decode().splitlines()[:count])[:, :3]
    if head["DATA"] != ["binary"]:
        sys.exit(f"raw_icp.py: {path} is neither binary nor ascii")
    bytes_each = sum(int(size) * int(times) for size, times in zip(head["SIZE"], head.get("COUNT", ["1"] * len(head["SIZE"]))))
    rows = numpy.frombuffer(data, numpy.uint8, count * bytes_each, end).reshape(count, bytes_each)
    return rows[:, :12].copy().view(numpy.float32)


def read_kitti(path):
    return numpy.fromfile(path, numpy.float32).reshape(-1, 4)[:, :3]


def cloud(kind, scans, poses, first, last, cell_m):
    """The points of these scans in the frame of the map, one a cell."""
    files = sorted(scans.glob("*.pcd" if kind == "pcd" else "*.bin"))
    parts = []
    for scan in range(first, last + 1):
        points = (read_pcd if kind == "pcd" else read_kitti)(files[scan]).astype(float)
        points = points[numpy.isfinite(points).all(1)]
        ranges = numpy.linalg.norm(points, axis=1)
        points = points[(ranges > NEAR_M) & (ranges < FAR_M)]
        parts.append(points @ poses[scan][:3, :3].T + poses[scan][:3, 3])
    points = numpy.concatenate(parts)
    return points[numpy.unique(numpy.floor(points / cell_m).astype(int), axis=0, return_index=True)[1]]


def small_motion(x, about):
    """As 4 x 4: moved by x[:3], turned by x[3:] about a point."""
    angle = numpy.linalg.norm(x[3:])
    a, b, c = x[3:] / max(angle, 1e-12)
    K = numpy.array([[0, -c, b], [c, 0, -a], [-b, a, 0]])
    T = numpy.eye(4)
    T[:3, :3] += numpy.sin(angle) * K + (1 - numpy.cos(angle)) * K @ K
    T[:3, 3] = about - T[:3, :3] @ about + x[:3]
    return T


def icp(a, b):
    tree, T = cKDTree(a), numpy.eye(4)
    drawn = numpy.random.default_rng(0)
    for within_m in ROUNDS_M:
        points = b @ T[:3, :3].T + T[:3, 3]
        distances, nearest = tree.query(points, distance_upper_bound=within_m)
        chosen = numpy.nonzero(numpy.isfinite(distances))[0]
        if len(chosen) > MOST:
            chosen = drawn.choice(chosen, MOST, False)
        around = a[tree.query(a[nearest[chosen]], k=NEIGHBOURS)[1]]
        off = around - around.mean(1, keepdims=True)
        values, vectors = numpy.linalg.eigh(numpy.einsum("nki,nkj->nij", off, off))
        flat = values[:, 0] < FLAT * values[:, 1]
        normals, points = vectors[flat, :, 0], points[chosen][flat]
        distance = numpy.einsum("ni,ni->n", points - around.mean(1)[flat], normals)
        about = points.mean(0)
        J = numpy.concatenate([normals, numpy.cross(points - about, normals)], 1)
        weighted = J * (1 / (1 + (distance / SCALE_M) ** 2) ** 2)[:, None]
        T = small_motion(numpy.linalg.solve(weighted.T @ J, -weighted.T @ distance), about) @ T
    return T


def main():
    kind, scans, poses, calib = sys.argv[1], *map(pathlib.Path, sys.argv[2:5])
    Tr = numpy.array(read_calibration(calib) or numpy.eye(4))
    in_map = [numpy.linalg.inv(Tr) @ numpy.array(pose) @ Tr for pose in read_poses(poses)]
    if len(sys.argv) == 8:
        cloud(kind, scans, in_map, *map(int, sys.argv[5:7]), CELLS_M[1]).astype(numpy.float32).tofile(sys.argv[7])
        return
    bounds = [int(word) for word in sys.argv[5:9]]
    a, b = (cloud(kind, scans, in_map, *bounds[2 * half:2 * half + 2], CELLS_M[half]) for half in (0, 1))
    print(*(repr(float(number)) for number in icp(a, b).ravel()))


if __name__ == "__main__":
    main()
