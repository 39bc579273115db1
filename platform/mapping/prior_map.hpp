// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What was known of a place before the first scan: an OctoMap as evidence of a new map.
#pragma once

#include <cstdint>
#include <string>

#include "octomap/octree_reader.hpp"
#include "posix/outcome.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

/// Of the map's resolution, in a prior map: so much free space takes a second and 128 MiB.
inline constexpr std::uint64_t kMostPriorVoxels = std::uint64_t{1} << 27U;
/// The file's voxel may be so many times as wide as the map's, in powers of two.
inline constexpr int kMostPriorLevels = 6;

struct PriorMapReport {
  double resolution_m = 0.0;   ///< Of the file.
  int passes = 0;              ///< That a free voxel is given.
  std::uint64_t occupied = 0;  ///< Voxels of the map that were given evidence.
  std::uint64_t free = 0;
  std::uint64_t refused = 0;  ///< Voxels for which the map has no memory.
};

/// Reads a .bt or .ot file whose lattice is to be the map's. Fails with kUsage iff Octree::read()
/// does, its voxels are not 1, 2, 4 .. 64 times as wide as resolution_m (to a part in a million),
/// or they are more than kMostPriorVoxels of that resolution.
Outcome<Octree> read_prior_map(const std::string& path, double resolution_m);

/// Gives each voxel of an occupied leaf so much evidence of being occupied and unlabelled, and each
/// of a free one the whole number of passes next to weight / free_weight, one at least; a compact
/// map rounds the evidence to what it can hold. map: new, or what is in it gets more. weight: above
/// 0, at most the map's cap. As one revision. What has no room is counted. O(voxels), and a look-up
/// for each block.
PriorMapReport add_prior_map(const Octree& octree, float weight, LocalMap& map);

}  // namespace tessera
