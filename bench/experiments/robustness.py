# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What wrong frames, noisy labels and a robot that is systematically wrong do to the global map."""
import datasets
import table_two

METRES = (0.1, 0.2, 0.3, 0.5)
DEGREES = (1.0, 2.0, 5.0)
SHARES = (0.1, 0.2, 0.4)
DRAWS = (1, 2)  # seeds of directions
METHODS = {"none": {"diffusion": "none"}, "contractive": {}}


class RealPair:
    """The two halves of the real sequence behind the same calls as the simulated pair."""

    def __init__(self, workshop, dataset, halves=table_two.HALVES):
        self.workshop, self.dataset, self.halves, self.name = workshop, dataset, halves, "halves"
        self.robots, self.places = [dataset, dataset], [datasets.IDENTITY, datasets.IDENTITY]
        self.maps, _ = table_two.local_maps(workshop, dataset, "real", halves)
        self.all_scans = dataset
        self.asked = {"overlap_of": self.maps, "first": halves[0][0], "last": halves[1][1]}

    def map_all(self, folders, prefix):
        return table_two.local_maps(self.workshop, folders, prefix, self.halves)[0]

    def scans_of(self, robot):
        return range(self.halves[robot][0], self.halves[robot][1] + 1)

    def judge_local(self, robot, maps=None, prefix=None):
        return table_two.kept(self.workshop.judge(f"{prefix or self.name}_{'ab'[robot]}", (maps or self.maps)[robot],
                                                  self.dataset, **self.asked))

    def judge_global(self, name, maps=None, **options):
        found = self.workshop.fuse_and_judge(f"{self.name}_{name}", maps or self.maps, self.dataset, options, self.asked)
        return found and {"fuse": table_two.kept_fuse(found["fuse"]), **table_two.kept(found["eval"])}


def judged(pair, name, maps=None, methods=METHODS, **fuse):
    return {method: pair.judge_global(f"{name}_{method}", maps, **options, **fuse) for method, options in methods.items()}


def undisturbed(pair):
    return {"locals": [pair.judge_local(robot) for robot in (0, 1)], **judged(pair, "right")}


def wrong_places(pair, metres, degrees, draws):
    """The second robot's frame moved or turned, in a direction by each seed."""
    found = []
    for kind, amounts in (("metres", metres), ("degrees", degrees)):
        for amount in amounts:
            for seed in draws:
                error = (amount, 0.0) if kind == "metres" else (0.0, amount)
                T = datasets.wrong_place(pair.places[1], *error, seed)
                name = f"{kind}_{amount:g}_{seed}"
                path = datasets.write_transform(pair.workshop.out / f"{pair.name}_T_{name}.txt", T)
                found.append({"kind": kind, "amount": amount, "seed": seed,
                              **judged(pair, name, transform=f"{pair.maps[1]}={path}")})
    return found


def relabelled(pair, name, changes):
    """changes: what happens to each robot's labels, None: nothing."""
    folders = [dataset if change is None else
               datasets.relabel(pair.workshop.out / f"{pair.name}_{name}_{'ab'[robot]}", dataset, pair.scans_of(robot), change)
               for robot, (dataset, change) in enumerate(zip(pair.robots, changes))]
    prefix = f"{pair.name}_{name}"
    maps = pair.map_all(folders, prefix)
    return {"locals": [pair.judge_local(robot, maps, prefix) for robot in (0, 1)], **judged(pair, name, maps)}


def noisy_labels(pair, shares):
    found = []
    for share in shares:
        for who, seeds in (("one", (None, 2)), ("both", (1, 2))):
            changes = [seed and datasets.noise(share, seed) for seed in seeds]
            found.append({"share": share, "who": who, **relabelled(pair, f"noise_{share:g}_{who}", changes)})
    return found


def measure(pair, quick=False):
    errors = (METRES[1::2], DEGREES[1:2], DRAWS[:1]) if quick else (METRES, DEGREES, DRAWS)
    return {"right": undisturbed(pair), "places": wrong_places(pair, *errors),
            "noise": noisy_labels(pair, SHARES[1:2] if quick else SHARES),
            "swapped": relabelled(pair, "swapped", [None, datasets.swap])}
