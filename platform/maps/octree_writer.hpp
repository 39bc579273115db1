// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Writes the occupancy of a map as OctoMap files, by the OctoMap library.
#pragma once

#include <cstdint>
#include <string>

#include "base/outcome.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

/// OctoMap has 16 levels: voxels from -2^15 to 2^15 - 1 on each axis.
inline constexpr std::int32_t kOctreeVoxelLimit = 1 << 15;

enum class OctreeForm : std::uint8_t {
  kBinary,  ///< .bt: free or occupied.
  kFull,    ///< .ot: log-odds of occupancy (eq. 8), as floats.
};

struct OctreeOptions {
  OctreeForm form = OctreeForm::kBinary;
  double min_evidence = 0.0;  ///< Voxels with less evidence are unknown.
};

struct OctreeReport {
  std::uint64_t occupied = 0;  ///< Voxels.
  std::uint64_t free = 0;
  std::uint64_t nodes = 0;  ///< Of the tree, pruned.
};

/// True if this build has the OctoMap library, without which write_octree() only fails.
[[nodiscard]] bool can_write_octrees() noexcept;

/// Writes every observed voxel of the map as occupied or free, exactly as its state (an OcTree with
/// OctoMap's threshold of 0.5), and replaces the file at path only when it is complete. The lattice
/// is that of the map: the origins are the same. Log-odds are within those of 1e-6 and 1 - 1e-6.
/// Eight voxels of one value are one leaf. Fails with kUsage iff this build has no OctoMap, a voxel
/// is beyond kOctreeVoxelLimit, or path cannot be written to; with kFailure iff there is no memory
/// for the tree or writing fails. On failure path is unchanged. Shows its progress on stderr.
/// O(16 voxels); memory about 60 bytes per node of the pruned tree.
Outcome<OctreeReport> write_octree(const LocalMap& map, const OctreeOptions& options,
                                   const std::string& path);

}  // namespace tessera
