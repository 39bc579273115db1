# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The voxels of a map, read from what `tessera export --format ply` writes."""
import math
import struct

VERTEX = struct.Struct("<3f4B3f")  # x y z, red green blue label, probability variance evidence
BLOCK = 8  # voxels a side


def read(path):
    """Rows (x, y, z, red, green, blue, label, probability, variance, evidence)."""
    data = path.read_bytes()
    return VERTEX.iter_unpack(data[data.index(b"end_header\n") + len(b"end_header\n"):])


def labelled(workshop, name, map_file):
    """By the voxel's centre in the map's frame: its label's variance."""
    path = workshop.out / f"{name}.ply"
    workshop.call("export", "--map", map_file, "--format", "ply", "--out", path)
    found = {row[0:3]: row[8] for row in read(path) if row[6]}
    path.unlink()
    return found


def states(workshop, map_file, places):
    """How many of the places are unknown, free and occupied in the map."""
    points, answers = workshop.out / "points.csv", workshop.out / "states.csv"
    points.write_text("x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in places))
    workshop.call("query", "--map", map_file, "--points", points, "--out", answers)
    found = {"unknown": 0, "free": 0, "occupied": 0}
    for line in answers.read_text().splitlines()[1:]:
        found[line.split(",")[3]] += 1
    return found


def by_block(voxels, T_global_map, resolution_m):
    """By the block of the global grid: [voxels, sum of their variances]."""
    edge = BLOCK * resolution_m
    (a, b, c, u), (d, e, f, v), (g, h, i, w), _ = T_global_map
    blocks = {}
    for (x, y, z), variance in voxels.items():
        key = (math.floor((a * x + b * y + c * z + u) / edge), math.floor((d * x + e * y + f * z + v) / edge),
               math.floor((g * x + h * y + i * z + w) / edge))
        entry = blocks.setdefault(key, [0, 0.0])
        entry[0] += 1
        entry[1] += variance
    return blocks


def mean_variance(blocks, overlap):
    count = sum(blocks[key][0] for key in overlap)
    return sum(blocks[key][1] for key in overlap) / count if count else 0.0


def variances_on_overlap(maps):
    """maps: by_block() of two maps. The mean variance of each, over the blocks in which both have labels."""
    overlap = set(maps[0]) & set(maps[1])
    return [mean_variance(blocks, overlap) for blocks in maps]
