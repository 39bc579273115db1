# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What found frames cost a fused map: the mean IoU over the points of all scans, of the halves in exact frames, in found ones, and in frames
that were off by 10 degrees and 5 m at first."""
import math
import random

from datasets import IDENTITY, inverse, write_transform
from transforms import draw, turn

OFF_DEG, OFF_M = 10.0, 5.0


def off(seed):
    """10 degrees to one side, 5 m in a level direction, both of the seed."""
    drawn = random.Random(seed)
    toward = drawn.uniform(-math.pi, math.pi)
    T = turn(2, math.radians(OFF_DEG) * drawn.choice((-1.0, 1.0)))
    T[0][3], T[1][3] = OFF_M * math.cos(toward), OFF_M * math.sin(toward)
    return T


def judged(workshop, scene, name, maps, fuse):
    last = scene.halves[1][1]
    return 100.0 * workshop.fuse_and_judge(name, maps, scene.folder, fuse, {"last": last})["eval"]["mean_iou"]


def measure(workshop, scene, seeds):
    """The second half is mapped anew in a frame that seed draws, so that exact and found frames are resampled alike."""
    first = scene.map(0)
    identity, exact_T = workshop.out / "identity.txt", workshop.out / "exact.txt"
    write_transform(identity, IDENTITY)
    at_first = ["--transform", f"{first}={identity}"]

    def fused_with(name, seed, T):
        """With the exact frame, and with the one that is found; name: what is known of it, nothing or that it is near the identity."""
        moved = scene.map_half(1, T, scene.moved_path(seed))
        write_transform(exact_T, inverse(T))
        key = f"{scene.name}_{name}_{seed}"
        exact = judged(workshop, scene, f"{key}_exact", [first, moved, *at_first, "--transform", f"{moved}={exact_T}"], {})
        said = ["--transform", f"{moved}={identity}"] if name == "near" else []
        found = judged(workshop, scene, key, [first, moved, *at_first, *said], {"align": True})
        moved.unlink()
        print(f"  {name} {seed}: exact {exact:.2f}, found {found:.2f}", flush=True)
        return {"exact": exact, "found": found}

    return {"title": scene.title,
            "trials": [{"seed": seed, "found": fused_with("found", seed, draw(seed)), "near": fused_with("near", seed, off(seed))} for seed in seeds]}
