// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The decisions about a block that have probabilities of their own.
#pragma once

#include "tessera/grid/centroid.hpp"

namespace tessera::detail {

/// The first of each group of probabilities, in the order of kInitialProbabilities.
enum Context : unsigned {
  kLabels = 0,
  kPasses = 1,
  kLabelled = 2,  ///< By which of the three octets before are.
  kFull = kLabelled + 8,
  kVoxel = kFull + 1,  ///< By the voxels before it in the octet, and how many of them are.
  kSame = kVoxel + 16,
  kRest = kSame + 2,
  kMore = kRest + 1,          ///< By the classes so far.
  kComponent = kMore + 3,     ///< A tree of six bits.
  kPassed = kComponent + 64,  ///< By which of the three octets before are.
  kVoxelPassed = kPassed + 8,
  kFreed = kVoxelPassed + 3,  ///< By what the three octets before are.
  kAllFreed = kFreed + 27,
  kVoxelFreed = kAllFreed + 27,  ///< By which of the three voxels before are.
  kDifference = kVoxelFreed + 8,
  kDifferenceGroups = 12,
  kDifferenceContexts = 9,
  /// By whether the last labelled voxel's is known, or there was none; and by how much evidence
  /// there is, as returns bring most of it.
  kCentroid = kDifference + kDifferenceGroups * kDifferenceContexts,
  /// By axis, and the level of the last one known on it, or that none was; a tree of three bits
  /// without what is over the highest level.
  kCentroidAmounts = 6,
  kCentroidLevel = kCentroid + 3 * kCentroidAmounts,
  kCentroidNodes = 5,
  kLastLevels = Centroid::kLevels + 1,
  kContexts = kCentroidLevel + 3 * kLastLevels * kCentroidNodes,
};

}  // namespace tessera::detail
