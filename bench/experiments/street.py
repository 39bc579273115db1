# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Two robots that pass each other in the simulated street: their maps, and every fourth of their scans as one dataset in
the global frame, to judge maps with."""
import datasets
import table_two

RESOLUTION_M = 0.2
FAR_M = 5000.0
JUDGED_EVERY = 4  # scans: those between show the same voxels again


class Pair:
    def __init__(self, workshop, seed, scans, **simulate):
        self.workshop, self.seed, self.scans = workshop, seed, scans
        self.name = "_".join(map(str, ("street", seed, scans, *simulate)))
        self.robots = workshop.simulate(seed, 2, scans, **simulate)
        self.places = [datasets.place_of(robot) for robot in self.robots]
        self.maps = self.map_all(self.robots, self.name)
        judged = [(robot, range(0, scans, JUDGED_EVERY)) for robot in self.robots]
        self.all_scans = datasets.join(workshop.out / f"{self.name}_every_{JUDGED_EVERY}", judged)
        self.asked = {"overlap_of": self.maps}

    def scans_of(self, _):
        return range(self.scans)

    def map_all(self, folders, prefix, **options):
        made = [self.workshop.map(f"{prefix}_{letter}", folder, resolution=RESOLUTION_M, robot=robot, **options)
                for robot, (letter, folder) in enumerate(zip("ab", folders))]
        self.reports = [report for _, report in made]
        return [path for path, _ in made]

    def judge_local(self, robot, maps=None, prefix=None):
        """A local map lies in its own frame: the points are brought into it."""
        path = self.workshop.out / f"{self.name}_T_map_global_{robot}.txt"
        T = datasets.write_transform(path, datasets.inverse(self.places[robot]))
        return table_two.kept(self.workshop.judge(f"{prefix or self.name}_{'ab'[robot]}", (maps or self.maps)[robot],
                                                  self.all_scans, transform=T, **self.asked))

    def judge_global(self, name, maps=None, **options):
        found = self.workshop.fuse_and_judge(f"{self.name}_{name}", maps or self.maps, self.all_scans, options, self.asked)
        return found and {"fuse": table_two.kept_fuse(found["fuse"]), **table_two.kept(found["eval"])}

    def judge_alone(self, name, path):
        """One map brought into the global frame: fused with the second one far away."""
        far = [row[:] for row in self.places[1]]
        far[0][3] += FAR_M
        T = datasets.write_transform(self.workshop.out / f"{self.name}_far.txt", far)
        return self.judge_global(name, [path, self.maps[1]], diffusion="none", transform=f"{self.maps[1]}={T}")

    def judge_resampled(self):
        return self.judge_alone("resampled", self.maps[0])

    def judge_together(self):
        """One map of all scans of both robots, in the global frame: what there would be to gain if nothing were lost on the
        way from map to map."""
        every = datasets.join(self.workshop.out / f"{self.name}_every", [(robot, range(self.scans)) for robot in self.robots])
        path, _ = self.workshop.map(f"{self.name}_all", every, resolution=RESOLUTION_M, robot=len(self.robots))
        return self.judge_alone("together", path)
