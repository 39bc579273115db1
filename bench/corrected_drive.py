#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""corrected_drive.py --build FOLDER --drive FOLDER [--resolution M] [--submap-length M] [--out FILE]: what a map in submaps
is worth after its poses were corrected.

The drive is a folder with scans (PCD), odom_poses.txt and optimized_poses.txt. It is mapped with the odometry, in submaps,
and corrected in ten steps. Compared with it, by occupied cells of 0.4 m: the map made with the optimised poses in one; and
the same poses in submaps of the same scans, whose own frames are turned alike. Takes some minutes, and needs NumPy.
"""
import argparse
import json
import pathlib
import struct
import subprocess
import sys
import tempfile

import numpy as np

CELL_M = 0.4
STEPS = 10
ROW = struct.Struct("<4Id22s6Q")


def crc32c(data):
    table = []
    for i in range(256):
        for _ in range(8):
            i = i >> 1 ^ (0x82F63B78 if i & 1 else 0)
        table.append(i)
    crc = 0xFFFFFFFF
    for byte in data:
        crc = crc >> 8 ^ table[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF


class Drive:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.command = options.build / "tessera"

    def run(self, *arguments):
        return subprocess.run([self.command, *map(str, arguments)], cwd=self.folder, check=True, text=True, capture_output=True).stdout

    def map(self, poses, out, *options):
        report = self.folder / "report.json"
        self.run("map", "--pcd", self.options.drive / "scans", "--poses", poses, "--free-space", "off", "--memory", "6G", "--resolution",
                 self.options.resolution, "--out", out, "--report", report, *options)
        return json.loads(report.read_text())

    def cells(self, map_file):
        self.run("export", "--map", map_file, "--format", "npy", "--out", "voxels.npy")
        voxels = np.load(self.folder / "voxels.npy", mmap_mode="r")
        keys = np.zeros(len(voxels), np.int64)
        for axis in "xyz":
            keys = keys << 21 | (np.floor(voxels[axis].astype(np.float64) / CELL_M).astype(np.int64) + (1 << 20))
        return np.unique(keys)

    def poses(self, name):
        rows = np.loadtxt(self.options.drive / name).reshape(-1, 3, 4)
        whole = np.zeros((len(rows), 4, 4))
        whole[:, :3], whole[:, 3, 3] = rows, 1.0
        return whole

    def cut_alike(self, submaps, source, out):
        """The optimised poses in submaps of the same scans, in frames that are turned as those of a file."""
        optimised = self.poses("optimized_poses.txt")
        data = (self.folder / source).read_bytes()
        table, count = struct.unpack_from("<QI", data, len(data) - 24)
        rows = [list(ROW.unpack_from(data, table + i * ROW.size)) for i in range(count)]
        whole = bytearray(data[:rows[0][6]])
        for row, submap in zip(rows, submaps):
            frame = np.eye(4)
            frame[:3] = np.array(submap["T_map_submap"]).reshape(3, 4)
            np.savetxt(self.folder / "turned.txt", (np.linalg.inv(frame) @ optimised)[:, :3].reshape(-1, 12), fmt="%.17g")
            report = self.map("turned.txt", "part.tsm", "--first", submap["first_scan"], "--last", submap["last_scan"])
            part = (self.folder / "part.tsm").read_bytes()
            file = report["file"]
            row[6:] = [len(whole), len(part), int(report["digest"], 16), file["label_voxels"], file["free_voxels"], file["occupied_state"]]
            whole += part
        packed = b"".join(ROW.pack(*row) for row in rows)
        end = struct.pack("<QIII", len(whole), count, crc32c(packed), 0x53424D54)
        (self.folder / out).write_bytes(whole + packed + end + struct.pack("<I", crc32c(end)))


def near(cells, others):
    """The share of cells that have one of the others in the same place or a neighbouring one."""
    found = np.zeros(len(cells), bool)
    for x in (-1, 0, 1):
        for y in (-1, 0, 1):
            for z in (-1, 0, 1):
                found |= np.isin(cells, others - ((x << 42) + (y << 21) + z), assume_unique=True)
    return float(found.mean())


def compared(a, b):
    common = len(np.intersect1d(a, b, assume_unique=True))
    return {"near": min(near(a, b), near(b, a)), "iou": common / (len(a) + len(b) - common)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=lambda p: pathlib.Path(p).resolve(), help="folder that CMake built in")
    parser.add_argument("--drive", required=True, type=lambda p: pathlib.Path(p).resolve(), help="folder of the drive")
    parser.add_argument("--resolution", type=float, default=0.2)
    parser.add_argument("--submap-length", type=float, default=20.0)
    parser.add_argument("--out", type=pathlib.Path, help="JSON file to write")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        drive = Drive(options, pathlib.Path(name))
        odometry, optimised = (options.drive / f"{kind}_poses.txt" for kind in ("odom", "optimized"))
        rows = optimised.read_text().splitlines(keepends=True)
        corrections = []
        for step in range(1, STEPS + 1):
            path = drive.folder / f"until_{step}.txt"
            path.write_text("".join(rows[:round(len(rows) * step / STEPS)]))
            corrections += ["--corrections", path]
        drive.map(optimised, "one.tsm")
        one = drive.cells("one.tsm")
        drive.map(odometry, "uncorrected.tsm")
        found = {"uncorrected": compared(drive.cells("uncorrected.tsm"), one)}
        report = drive.map(odometry, "submaps.tsm", "--submap-length", options.submap_length, *corrections)
        corrected = drive.cells("submaps.tsm")
        found["corrected"] = compared(corrected, one)
        drive.cut_alike(report["submaps"], "submaps.tsm", "alike.tsm")
        found["corrected, against submaps cut alike"] = compared(corrected, drive.cells("alike.tsm"))
        print(f"{len(report['submaps'])} submaps, {options.resolution} m; cells of {CELL_M} m, the lesser of both ways")
    print(f"{'':40}{'same or next cell':>20}{'IoU':>8}")
    for case, figures in found.items():
        print(f"{case:40}{figures['near']:>20.4f}{figures['iou']:>8.3f}")
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
