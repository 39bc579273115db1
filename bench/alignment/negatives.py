# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of maps of different places: whatever transform is accepted is false."""
import itertools
import random

from judging import outcome

SEED = 1  # Of the order of the pairs.
KINDS = ("street and street", "recorded and recorded", "recorded and street")


def pairs_of(streets, recorded):
    """(kind, scene of A, scene of B): map 0 of A against map 1 of B, all ordered pairs, in an order that SEED draws, so that the first
    of them are a fair sample."""
    pairs = [(KINDS[0], a, b) for a, b in itertools.permutations(streets, 2)]
    pairs += [(KINDS[1], a, b) for a, b in itertools.permutations(recorded, 2)]
    pairs += [(KINDS[2], *pair) for scene in recorded for street in streets for pair in ((scene, street), (street, scene))]
    random.Random(SEED).shuffle(pairs)
    return pairs


def measure(workshop, streets, recorded, most):
    """The first of all pairs, as many as asked for."""
    found, pairs = [], pairs_of(streets, recorded)
    for number, (kind, a, b) in enumerate(pairs[:most], 1):
        name = f"negative_{a.name}_{b.name}"
        trial = {"kind": kind, "a": a.name, "b": b.name, **outcome(workshop.align(name, a.map(0), b.map(1)))}
        found.append(trial)
        if trial["accepted"]:
            print(f"  ACCEPTED: {a.name} and {b.name}, support {trial['support']:.0f}", flush=True)
        if number % 50 == 0 or number == min(most, len(pairs)):
            print(f"  {number} of {min(most, len(pairs))}, {sum(trial['accepted'] for trial in found)} accepted", flush=True)
    return {"of": len(pairs), "order_seed": SEED, "pairs": found}
