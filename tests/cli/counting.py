# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What is computed by hand: counting mode, in which a point adds one to its voxel."""

COMPONENTS = 21  # free, 19 classes, occupied but unlabelled
PRIOR = 0.001
COUNTING = ("--inference", "counting", "--free-space", "off", "--downsample", "off", "--prior", PRIOR)


def probability(count, evidence):
    """Paper eq. 8."""
    return (PRIOR + count) / (COMPONENTS * PRIOR + evidence)


def variance(p, evidence):
    """Paper eq. 17."""
    return p * (1 - p) / (COMPONENTS * PRIOR + evidence + 1)
