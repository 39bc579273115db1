# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Table III: teams of 2, 4 and 8 robots that share a long simulated street, each mapping a part of it that borders on
its neighbours' parts.

The simulator's even robots drive towards +x and odd ones towards -x, each lane from behind the street's middle. So even
robots share the street's half of positive x, odd ones the other: of K robots each maps the scans of 2/K of its half, and
the first of its lane the far end."""
import datasets
import table_two
import voxels

RESOLUTION_M = 0.2
SCAN_S = 0.1
JUDGED_AT_BORDER = 10  # scans of each of two neighbours, those nearest to their border: 20, as in the paper
JUDGED_EVERY = 10
METHODS = {"none": {"diffusion": "none"}, "paper": {"diffusion": "paper"}, "contractive": {}}


def along(dataset):
    """Where each scan was taken, by how far it is along the lane from the street's middle."""
    T = datasets.place_of(dataset)
    heading = 1.0 if T[0][0] > 0.0 else -1.0
    return [heading * datasets.product(T, pose)[0][3] for pose in datasets.read_poses(dataset)]


def parts(robots, end_m):
    """Scan numbers (first, last) of each robot."""
    lane = len(robots) // 2
    found = []
    for robot, dataset in enumerate(robots):
        place = lane - 1 - robot // 2  # 0: next to the middle
        low, high = place * end_m / lane, (place + 1) * end_m / lane
        inside = [scan for scan, x in enumerate(along(dataset)) if low <= x <= high]
        found.append((inside[0], inside[-1]))
    return found


def neighbours(count):
    """Robots in the order in which their parts lie in the street: odd ones from the far end to the middle, then even ones."""
    order = [*range(1, count, 2), *reversed(range(0, count, 2))]
    return list(zip(order, order[1:]))


def nearest(dataset, part, x_m):
    """The scans of the part that were taken nearest to where the border lies."""
    places = along(dataset)
    scans = sorted(range(part[0], part[1] + 1), key=lambda scan: abs(places[scan] - x_m))
    return sorted(scans[:JUDGED_AT_BORDER])


class Team:
    def __init__(self, workshop, scene, robots, end_m):
        self.workshop, self.robots = workshop, robots
        self.name = f"{scene}_team{len(robots)}"
        self.end_m = end_m
        self.parts = parts(robots, end_m)
        self.maps, self.reports = [], []
        for robot, (dataset, (first, last)) in enumerate(zip(robots, self.parts)):
            path, report = workshop.map(f"{self.name}_{robot}", dataset, first=first, last=last, resolution=RESOLUTION_M,
                                        robot=robot, memory="1G")
            self.maps.append(path)
            self.reports.append(report)

    def border(self, a, b):
        """How far along the lanes the parts of two neighbours meet; 0 is the street's middle."""
        if a % 2 != b % 2:
            return 0.0
        lane = len(self.robots) // 2
        return (lane - max(a // 2, b // 2)) * self.end_m / lane

    def judge_pair(self, a, b, fused):
        """Both local maps and the global ones on what both robots have labels for, by the scans at their border."""
        x_m, pair = self.border(a, b), f"{self.name}_{a}{b}"
        chosen = [(self.robots[k], nearest(self.robots[k], self.parts[k], x_m)) for k in (a, b)]
        scans = datasets.join(self.workshop.out / f"{pair}_scans", chosen)
        asked = {"overlap_of": [self.maps[a], self.maps[b]], "max_range": 40}
        found = {"robots": (a, b)}
        for name, robot in (("local_a", a), ("local_b", b)):
            T_map_global = datasets.inverse(datasets.place_of(self.robots[robot]))
            T = datasets.write_transform(self.workshop.out / f"{pair}_T_{robot}.txt", T_map_global)
            found[name] = table_two.kept(self.workshop.judge(f"{pair}_{robot}", self.maps[robot], scans, transform=T, **asked))
        for name, path in fused.items():
            found[name] = table_two.kept(self.workshop.judge(f"{pair}_{name}", path, scans, **asked))
        return found

    def judge_all(self, fused):
        """The global maps on points of all robots, wherever they are."""
        spread = [(dataset, range(first, last + 1, JUDGED_EVERY)) for dataset, (first, last) in zip(self.robots, self.parts)]
        scans = datasets.join(self.workshop.out / f"{self.name}_scans", spread)
        return {name: table_two.kept(self.workshop.judge(f"{self.name}_{name}", path, scans)) for name, path in fused.items()}

    def local_variances(self):
        """Of two robots, over the blocks in which both have labels."""
        def make():
            blocks = [voxels.by_block(voxels.labelled(self.workshop, "local", path), datasets.place_of(robot), RESOLUTION_M)
                      for path, robot in zip(self.maps, self.robots)]
            return voxels.variances_on_overlap(blocks)
        return self.workshop.kept(f"{self.name}.variances", ["variances of", *self.maps, self.parts], make)

    def efficiency(self, fused):
        """Volume of the labelled voxels, by the seconds that the robots drove, and by those that computers worked."""
        volume = RESOLUTION_M ** 3
        driven = [SCAN_S * report["totals"]["scans"] for report in self.reports]
        worked = [sum(scan["milliseconds"] for scan in report["scans"]) / 1000.0 for report in self.reports]
        local = [volume * report["memory"]["label_voxels"] for report in self.reports]
        whole = volume * fused["voxels"]
        mean = sum(v / s for v, s in zip(local, driven)) / len(local)
        busy = max(worked) + fused["milliseconds"] / 1000.0
        return {"local_m3": local, "driven_s": driven, "local_m3_per_s": [v / s for v, s in zip(local, driven)],
                "global_m3": whole, "global_m3_per_s": whole / max(driven), "times_one_robot": whole / max(driven) / mean,
                "worked_s": worked, "fuse_s": fused["milliseconds"] / 1000.0, "global_m3_per_worked_s": whole / busy,
                "local_m3_per_worked_s": [v / s for v, s in zip(local, worked)],
                "times_one_robot_worked": whole / busy / (sum(v / s for v, s in zip(local, worked)) / len(local))}

    def measure(self):
        fused, reports = {}, {}
        for name, options in METHODS.items():
            fused[name], reports[name] = self.workshop.fuse(f"{self.name}_{name}", self.maps, **options)
        found = {"robots": len(self.robots), "parts": self.parts, "end_m": self.end_m,
                 "fused": {name: table_two.kept_fuse(report) for name, report in reports.items()},
                 "alignments": [[pair["agreement"], pair["common"]] for pair in reports["none"]["alignments"]],
                 "refused": [report["memory"]["refused"] for report in (*self.reports, *reports.values())],
                 "pairs": [self.judge_pair(a, b, fused) for a, b in neighbours(len(self.robots))],
                 "all": self.judge_all(fused), "efficiency": self.efficiency(reports["contractive"])}
        if len(self.robots) == 2:
            found["local_variances"] = self.local_variances()
        return found


def alone(scene):
    """m3/s of one robot that drives half of the street alone: the mean of the two that do in a team of two."""
    rates = scene["teams"][0]["efficiency"]["local_m3_per_s"]
    return sum(rates) / len(rates)


def measure(workshop, scenes):
    """scenes: (seed, robots, scans). Teams of 2, 4, ... up to the scene's robots."""
    found = []
    for seed, count, scans in scenes:
        robots = workshop.simulate(seed, count, scans)
        # Where the first robot of each lane, which is the farthest, ends.
        end_m = min(along(robot)[-1] for robot in robots[:2])
        teams = [Team(workshop, f"large_{seed}", robots[:size], end_m).measure() for size in (2, 4, 8) if size <= count]
        found.append({"seed": seed, "scans": scans, "street_m": 2.0 * end_m, "teams": teams})
    return found
