#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""corrected_drive.py --build FOLDER (--drive FOLDER | --simulated SCANS) [--resolution M] [--submap-length M] [--out FILE]
[--picture FILE]: what a map in submaps is worth after its poses were corrected.

The drive is a folder with scans (PCD), odom_poses.txt and optimized_poses.txt. It is mapped with the odometry, in submaps,
and corrected in ten steps. Compared with it, by occupied cells of 0.4 m: the map made with the optimised poses in one; and
the same poses in submaps of the same scans, whose own frames are turned alike. Takes some minutes, and needs NumPy. A picture shows
the maps from above: before, after, and the one that they are compared with; it needs Matplotlib.
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
        """(N, 4, 4), of a file of the drive."""
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


def places_of(cells):
    """x and y of cells, in metres."""
    mask = (1 << 21) - 1
    return [((cells >> shift & mask) - (1 << 20) + 0.5) * CELL_M for shift in (42, 21)]


def near_mask(cells, others):
    """Which cells have one of the others in the same place or a neighbouring one."""
    found = np.zeros(len(cells), bool)
    for x in (-1, 0, 1):
        for y in (-1, 0, 1):
            for z in (-1, 0, 1):
                found |= np.isin(cells, others - ((x << 42) + (y << 21) + z), assume_unique=True)
    return found


def draw(panels, path, source):
    """panels: (title, cells), the last one what the others are compared with. Each from above at the same extent: cells near where they
    belong are grey, others red."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    places = [places_of(cells) for _, cells in panels]
    low, high = ([f(f(place[axis]) for place in places) for axis in (0, 1)] for f in (min, max))
    # Whole cells to a pixel, so that none is empty between two of them.
    pixel_m = CELL_M * np.ceil(max(h - l for h, l in zip(high, low, strict=True)) / 340 / CELL_M)
    pixels = [int((h - l) / pixel_m) + 12 for h, l in zip(high, low, strict=True)]
    begins = [CELL_M * np.floor(l / CELL_M) - 6 * pixel_m for l in low]
    extent = (begins[0], begins[0] + pixels[0] * pixel_m, begins[1], begins[1] + pixels[1] * pixel_m)
    wide, tall = extent[1] - extent[0], extent[3] - extent[2]
    inches = 3.6 * min(1.0, wide / tall), 3.6 * min(1.0, tall / wide)
    figure, axes = plt.subplots(1, len(panels), figsize=(inches[0] * len(panels) + 0.5, inches[1] + 0.52), dpi=100)
    bar_m = 10.0 ** int(np.log10(wide / 2))
    for axis, (title, cells), (x, y) in zip(axes, panels, places, strict=True):
        near_place = near_mask(cells, panels[-1][1])
        picture = np.ones((pixels[1], pixels[0], 3))
        for chosen, colour in ((near_place, (0.35, 0.38, 0.40)), (~near_place, (0.80, 0.18, 0.12))):
            seen = np.histogram2d(y[chosen], x[chosen], bins=pixels[::-1], range=(extent[2:], extent[:2]))[0]
            share = np.clip(np.log1p(seen) / np.log(30.0), 0.0, 1.0)[..., None]
            picture = picture * (1 - share) + np.array(colour) * share
        axis.imshow(picture, origin="lower", extent=extent, interpolation="nearest", aspect="equal")
        axis.set_title(title, fontsize=8)
        axis.set_xticks([])
        axis.set_yticks([])
        begin, height = extent[0] + 0.05 * wide, extent[2] + 0.93 * tall
        axis.plot((begin, begin + bar_m), (height, height), color="black", linewidth=2, solid_capstyle="butt")
        axis.text(begin + bar_m + 0.02 * wide, height, f"{bar_m:.0f} m", fontsize=8, va="center")
    figure.text(0.005, 0.015, source, fontsize=7, color="#555555")
    edge = 0.24 / (inches[1] + 0.52)
    figure.subplots_adjust(left=0.005, right=0.995, top=1 - edge, bottom=edge, wspace=0.02)
    figure.savefig(path)
    plt.close(figure)


def simulate(options, folder):
    """A drive down a simulated street, in the files of a real one. Its odometry turns as it goes."""
    subprocess.run([options.build / "tessera", "simulate", "--robots", "1", "--scans", str(options.simulated), "--seed", "1", "--out",
                    folder / "made"], check=True, capture_output=True)
    made = folder / "made/robot_0"
    scans = sorted((made / "velodyne").glob("*.bin"))
    (folder / "scans").mkdir()
    for number, scan in enumerate(scans):
        points = scan.read_bytes()
        count = len(points) // 16
        head = ("VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
                f"WIDTH {count}\nHEIGHT 1\nPOINTS {count}\nDATA binary\n")
        (folder / "scans" / f"{number:06d}.pcd").write_bytes(head.encode() + points)
    rows = np.loadtxt(made / "poses.txt").reshape(-1, 3, 4)
    np.savetxt(folder / "optimized_poses.txt", rows.reshape(-1, 12), fmt="%.9g")
    angles = np.radians(8.0) * (np.arange(len(rows)) / len(rows)) ** 2
    turns = np.array([[[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]] for a in angles])
    np.savetxt(folder / "odom_poses.txt", (turns @ rows).reshape(-1, 12), fmt="%.9g")
    return folder


def near(cells, others):
    """The share of cells that have one of the others in the same place or a neighbouring one."""
    return float(near_mask(cells, others).mean())


def compared(a, b):
    common = len(np.intersect1d(a, b, assume_unique=True))
    return {"near": min(near(a, b), near(b, a)), "iou": common / (len(a) + len(b) - common)}


def parser_of(text, needs_drive=True):
    """Options of whatever maps a drive."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=lambda p: pathlib.Path(p).resolve(), help="folder that CMake built in")
    parser.add_argument("--drive", required=needs_drive, type=lambda p: pathlib.Path(p).resolve(), help="folder of the drive")
    parser.add_argument("--resolution", type=float, default=0.2)
    parser.add_argument("--submap-length", type=float, default=20.0)
    parser.add_argument("--out", type=pathlib.Path, help="JSON file to write")
    return parser


def main():
    parser = parser_of(__doc__, needs_drive=False)
    parser.add_argument("--picture", type=pathlib.Path, help="PNG file to write")
    parser.add_argument("--source", default="", help="whose drive it is, for the line below the picture")
    parser.add_argument("--simulated", type=int, metavar="SCANS", help="a simulated drive instead of one from a folder")
    options = parser.parse_args()
    if (options.drive is None) == (options.simulated is None):
        parser.error("give --drive or --simulated")
    with tempfile.TemporaryDirectory() as name:
        if options.simulated:
            (pathlib.Path(name) / "drive").mkdir()
            options.drive = simulate(options, pathlib.Path(name) / "drive")
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
        uncorrected = drive.cells("uncorrected.tsm")
        found = {"uncorrected": compared(uncorrected, one)}
        report = drive.map(odometry, "submaps.tsm", "--submap-length", options.submap_length, *corrections)
        corrected = drive.cells("submaps.tsm")
        found["corrected"] = compared(corrected, one)
        drive.cut_alike(report["submaps"], "submaps.tsm", "alike.tsm")
        found["corrected, against submaps cut alike"] = compared(corrected, drive.cells("alike.tsm"))
        print(f"{len(report['submaps'])} submaps, {options.resolution} m; cells of {CELL_M} m, the lesser of both ways")
    print(f"{'':40}{'same or next cell':>20}{'IoU':>8}")
    for case, figures in found.items():
        print(f"{case:40}{figures['near']:>20.4f}{figures['iou']:>8.3f}")
    if options.picture:
        draw([(f"as driven: {found['uncorrected']['near']:.4f} near their place", uncorrected),
              (f"submaps, corrected ten times: {found['corrected']['near']:.4f}", corrected),
              ("mapped with the corrected poses", one)], options.picture, options.source)
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
