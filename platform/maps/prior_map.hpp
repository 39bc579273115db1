// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Evidence from before the first scan: an OctoMap as the start of a new map.
#pragma once

#include <cstdint>
#include <string>

#include "base/outcome.hpp"
#include "maps/octree_reader.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

/// Most voxels of the map's resolution in a prior map: this much free space takes 1 s and 128 MiB.
inline constexpr std::uint64_t kMostPriorVoxels = std::uint64_t{1} << 27U;
/// A voxel of the file may be this many times as wide as the map's, in powers of two.
inline constexpr int kMostPriorLevels = 6;

struct PriorMapReport {
  double resolution_m = 0.0;   ///< Resolution of the file.
  int passes = 0;              ///< Passes of a free voxel.
  std::uint64_t occupied = 0;  ///< Voxels of the map that got evidence.
  std::uint64_t free = 0;
  std::uint64_t refused = 0;  ///< Voxels for which the map has no memory.
};

/// Reads a .bt or .ot file with the lattice of the map. Fails with kUsage iff Octree::read()
/// does, its voxels are not 1, 2, 4 .. 64 times as wide as resolution_m (to a part in a million),
/// or they are more than kMostPriorVoxels of that resolution.
Outcome<Octree> read_prior_map(const std::string& path, double resolution_m);

/// Gives each voxel of an occupied leaf `weight` of evidence for occupied without a label, and each
/// of a free one the integer number of passes nearest to weight / free_weight, at least one; a
/// compact map rounds the evidence to what it can hold. map: new, else evidence is added. weight:
/// above 0, at most the map's cap. One revision. Counts what does not fit. O(voxels), and a look-up
/// for each block.
PriorMapReport add_prior_map(const Octree& octree, float weight, LocalMap& map);

}  // namespace tessera
