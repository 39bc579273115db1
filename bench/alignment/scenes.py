# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Places that two maps have in common, with the exact transform: halves of recorded drives, and streets that two simulated robots
see from both ends. Each scene has maps 0 and 1."""
import os
import pathlib
import shutil

from datasets import IDENTITY, inverse, place_of, product, read_transform, write_transform
from transforms import draw, moved, read_calibration, read_poses, write_poses

RANGE_M = 40  # of scans of turning scanners
SCANS = 20  # of each robot in a street
STREETS = {"streets": 60, "streets_near": 30}  # how far apart its robots begin, m
FAR_M = STREETS["streets"]
# Folders are below that of the data; halves are (first, last) scan; bounds are m and degrees.
RECORDED = {
    "balm_room": {"title": "halves of `balm_room`", "folder": "balm_room", "pcd": "scans", "poses": "poses.txt",
                  "halves": ((0, 29), (30, 58)), "words": ["--labels", "none"], "bounds": (0.05, 0.3)},
    "semantickitti_08": {"title": "scans 0-2 and 3-5 of 08", "folder": "semantickitti_08", "poses": "poses.txt",
                         "halves": ((0, 2), (3, 5)), "words": ["--max-range", RANGE_M], "bounds": (0.1, 0.5)},
    "livox_shack": {"title": "halves of `livox_shack`", "folder": "livox_shack", "pcd": "scans", "poses": "optimized_poses.txt",
                    "halves": ((0, 120), (121, 240)), "words": ["--labels", "none"], "bounds": (0.1, 0.5)},
    "kitti_raw_0013": {"title": "halves of `kitti_raw_0013`", "folder": "kitti_raw_0013", "poses": "poses.txt",
                       "halves": ((0, 17), (18, 35)), "words": ["--labels", "none", "--max-range", RANGE_M], "bounds": (0.1, 0.5)},
}
# For pairs of different places alone: their halves have too little or all in common.
OTHERS = {
    "mulran_riverside02": {"title": "`mulran_riverside02`", "folder": "mulran_riverside02", "pcd": "scans", "poses": "optimized_poses.txt",
                           "halves": ((0, 19), (140, 159)), "words": ["--labels", "none", "--max-range", RANGE_M], "bounds": None},
    "scanner_standing": {"title": "`scanner_standing`", "folder": "scanner_standing", "poses": "poses.txt",
                         "halves": ((0, 11), (12, 22)), "words": ["--labels", "labels", "--max-range", RANGE_M], "bounds": None},
}


class Recorded:
    def __init__(self, workshop, data, name):
        self.workshop, self.name, self.mapped = workshop, name, set()
        about = {**RECORDED, **OTHERS}[name]
        self.title, self.bounds, self.halves, self.words = (about[key] for key in ("title", "bounds", "halves", "words"))
        self.folder = data / about["folder"]
        self.poses, self.pcd = self.folder / about["poses"], about.get("pcd")
        self.out = workshop.out / name
        self.out.mkdir(exist_ok=True)

    def map_half(self, half, T, path):
        """Maps that half anew, with all poses moved by T."""
        first, last = self.halves[half]
        words = [*self.workshop.mapped, "--first", first, "--last", last, *self.words, "--out", path]
        Tr = read_calibration(self.folder / "calib.txt")
        poses = moved(read_poses(self.poses), T, Tr)
        if self.pcd:
            written = write_poses(self.out / "poses.txt", poses)
            self.workshop.call("map", "--pcd", self.folder / self.pcd, "--poses", written, *words)
            return path
        dataset = self.out / "dataset"
        shutil.rmtree(dataset, ignore_errors=True)
        dataset.mkdir()
        for entry in self.folder.iterdir():
            if entry.name != "poses.txt":
                os.symlink(entry.resolve(), dataset / entry.name)
        write_poses(dataset / "poses.txt", poses)
        self.workshop.call("map", "--dataset", dataset, *words)
        return path

    def map(self, half):
        """As the poses have it, mapped once by this program."""
        path = self.out / f"half_{half}.tsm"
        if half not in self.mapped:
            self.mapped.add(half)
            self.map_half(half, IDENTITY, path)
        return path

    def moved_path(self, seed):
        return self.out / f"moved_{seed}.tsm"

    def map_moved(self, seed):
        """The second half in the frame that seed draws."""
        return self.map_half(1, draw(seed), self.moved_path(seed))

    def exact(self):
        """T_a_b of the maps as they are."""
        return IDENTITY

    def scans_words(self):
        kind = "pcd" if self.pcd else "kitti"
        return [kind, self.folder / (self.pcd or "velodyne"), self.poses, self.folder / "calib.txt"]

    def icp_words(self):
        return [*self.scans_words(), *self.halves[0], *self.halves[1]]

    def points(self, half, write):
        """The file of the points that this half was mapped from, in the frame of map(half)."""
        path = self.out / f"half_{half}.xyz"
        if not path.exists():
            write(path, [*self.scans_words(), *self.halves[half]])
        return path


def title_of_streets(apart_m):
    return f"streets from {apart_m} m apart"


class Street:
    """Two robots of 64 and 16 beams that come towards each other; they do not know their frames. Maps take long to make, and other
    programs take them as they are: after a change of the simulator, OUT has to be another folder."""
    def __init__(self, workshop, seed, apart_m=FAR_M):
        self.workshop, self.seed, self.apart_m = workshop, seed, apart_m
        self.name = f"street_{seed}" if apart_m == FAR_M else f"street_{seed}_{apart_m}"
        self.title = title_of_streets(apart_m)
        self.out = workshop.out / ("streets" if apart_m == FAR_M else f"streets_{apart_m}")
        self.out.mkdir(exist_ok=True)
        self.T_file = self.out / f"T_{seed}.txt"
        if not self.T_file.exists():
            self.make()

    def map(self, robot):
        return self.out / f"m{self.seed}_{robot}.tsm"

    def points(self, robot, write):
        """The file of the points that this robot saw, in the frame of map(robot)."""
        paths = [self.out / f"m{self.seed}_{each}.xyz" for each in (0, 1)]
        if not all(path.exists() for path in paths):
            folder = self.simulate()
            for each, path in enumerate(paths):
                there = folder / f"robot_{each}"
                write(path, ["kitti", there / "velodyne", there / "poses.txt", there / "calib.txt", 0, SCANS - 1])
            shutil.rmtree(folder)
        return paths[robot]

    def simulate(self):
        folder = self.out / f"scans_{self.seed}"
        self.workshop.call("simulate", "--robots", 2, "--scans", SCANS, "--seed", self.seed, "--apart", self.apart_m, "--out", folder)
        return folder

    def make(self):
        folder = self.simulate()
        places = [place_of(folder / f"robot_{robot}") for robot in (0, 1)]
        for robot in (0, 1):
            (folder / f"robot_{robot}" / "T_global_map.txt").unlink()
            self.workshop.call("map", "--dataset", folder / f"robot_{robot}", *self.workshop.mapped, "--max-range", RANGE_M, "--out", self.map(robot))
        shutil.rmtree(folder)
        write_transform(self.T_file, product(inverse(places[0]), places[1]))

    def exact(self):
        return read_transform(self.T_file)


def data_of(folder):
    """The scenes that are there."""
    return [name for name, about in {**RECORDED, **OTHERS}.items() if (pathlib.Path(folder) / about["folder"]).is_dir()]
