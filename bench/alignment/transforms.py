# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Transforms that are drawn, poses that are moved by them, and how far a transform is from another."""
import math
import pathlib
import random
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "experiments"))

from datasets import inverse, product  # noqa: E402  needs the path above

REACH_XY_M, REACH_Z_M, MOST_TILT_DEG = 50.0, 5.0, 5.0
FALSE_M, FALSE_DEG = 0.3, 1.0


def turn(axis, angle_rad):
    """About an axis, 0 to 2, as 4 x 4."""
    T = [[1.0 if i == j else 0.0 for j in range(4)] for i in range(4)]
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[i][i] = T[j][j] = math.cos(angle_rad)
    T[j][i] = math.sin(angle_rad)
    T[i][j] = -T[j][i]
    return T


def draw(seed):
    """Any yaw, a tilt of at most MOST_TILT_DEG about any level axis, a translation within the reach: of the seed alone."""
    drawn = random.Random(seed)
    yaw, toward = (drawn.uniform(-math.pi, math.pi) for _ in range(2))
    tilt = math.radians(drawn.uniform(0.0, MOST_TILT_DEG))
    T = product(product(turn(2, toward), turn(0, tilt)), product(turn(2, -toward), turn(2, yaw)))
    for axis, reach_m in enumerate((REACH_XY_M, REACH_XY_M, REACH_Z_M)):
        T[axis][3] = drawn.uniform(-reach_m, reach_m)
    return T


def apply(T, point):
    return [sum(T[i][k] * point[k] for k in range(3)) + T[i][3] for i in range(3)]


def angle_deg(T):
    """By the sine too, as the cosine says little of small angles."""
    sine = math.hypot(T[2][1] - T[1][2], T[0][2] - T[2][0], T[1][0] - T[0][1]) / 2.0
    return math.degrees(math.atan2(sine, (T[0][0] + T[1][1] + T[2][2] - 1.0) / 2.0))


def offset(found, exact, about_a):
    """Where found puts a point of B, from where exact puts it: the point that found puts at about_a; along A's axes, in m."""
    there = apply(product(exact, inverse(found)), about_a)
    return [about_a[i] - there[i] for i in range(3)]


def error(found, exact, about_a):
    """(m, degrees): how far found puts that point from where exact puts it, and the angle between both."""
    return math.hypot(*offset(found, exact, about_a)), angle_deg(product(exact, inverse(found)))


def is_false(m, deg):
    return m > FALSE_M or deg > FALSE_DEG


def rows_of(numbers):
    return [list(numbers[4 * i:4 * i + 4]) for i in range(len(numbers) // 4)]


def read_poses(path):
    """T_map_sensor of each line, or what else has twelve numbers a line."""
    return [[*rows_of([float(word) for word in line.split()]), [0.0, 0.0, 0.0, 1.0]] for line in path.read_text().splitlines() if line.strip()]


def write_poses(path, poses):
    """So that they are read back exactly."""
    path.write_text("".join(" ".join(repr(number) for row in T[:3] for number in row) + "\n" for T in poses))
    return path


def moved(poses, T, Tr=None):
    """Poses of a map whose frame was moved by T; Tr is T_camera_sensor where the poses are the camera's, else None."""
    if Tr is not None:
        T = product(product(Tr, T), inverse(Tr))
    return [product(T, pose) for pose in poses]


def read_calibration(path):
    """T_camera_sensor of a calib.txt; None where there is none."""
    if not path.exists():
        return None
    line = next(line for line in path.read_text().splitlines() if line.startswith("Tr"))
    return [*rows_of([float(word) for word in line.split()[1:]]), [0.0, 0.0, 0.0, 1.0]]
