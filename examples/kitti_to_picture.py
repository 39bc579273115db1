#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""kitti_to_picture.py FOLDER PICTURE.png [SCANS]: maps the first scans of a KITTI folder and draws the map from above."""
import sys

import matplotlib
import numpy as np

import tessera

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

dataset = tessera.Dataset(sys.argv[1])
scans = min(len(dataset), int(sys.argv[3]) if len(sys.argv) > 3 else 6)
local = tessera.LocalMap(dataset.classes, resolution_m=0.2)
for i in range(scans):
    report = local.integrate(dataset[i].points, dataset[i].components, dataset[i].T_map_sensor)
    print(f"scan {i + 1} of {scans}: {report.points} points, {report.left_out} left out")
voxels = local.voxels(occupied_only=True)
top = np.argsort(voxels.center[:, 2], kind="stable")  # The highest are drawn last.
colors = np.vstack([[127, 127, 127], dataset.classes.colors])[voxels.label] / 255
pyplot.figure(figsize=(10, 10), facecolor="white")
pyplot.scatter(*voxels.center[top, :2].T, c=colors[top], s=2, marker="s", linewidths=0)
pyplot.gca().set(aspect="equal", xlabel="x, m", ylabel="y, m", title=f"{len(voxels)} occupied voxels of {scans} scans")
pyplot.savefig(sys.argv[2], dpi=100, bbox_inches="tight")
