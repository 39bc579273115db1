# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What is computed by hand: counting mode, in which a point adds one to its voxel."""

COMPONENTS = 21  # free, 19 classes, occupied but unlabelled
PRIOR = 0.001
COUNTING = ("--inference", "counting", "--free-space", "off", "--downsample", "off", "--prior", PRIOR)


def probability(count, evidence):
    """Paper eq. 8."""
    return (PRIOR + count) / (COMPONENTS * PRIOR + evidence)


def effective_number(sigma, around):
    """Of independent observations, at 0.1 m: docs/design/theory.md, Probabilities. around: 0.9 in a map with votes, else 0."""
    d = (sum(sigma) + around) ** 0.75
    return 4.2 * d / (1 + 0.28 * d)


def effective_probability(label, sigma, worth, around):
    """Of counts that have no rest. worth: of each component."""
    each = effective_number(sigma, around) / sum(sigma)
    weights = [78 * PRIOR + (1 + each * h * count / 8) ** 8 - 1 for h, count in zip(worth, sigma, strict=True)]
    return weights[label] / sum(weights)


def variance(p, evidence):
    """Paper eq. 17."""
    return p * (1 - p) / (COMPONENTS * PRIOR + evidence + 1)
