// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map's occupancy as OctoMap's files, written by its own library.
#pragma once

#include <cstdint>
#include <string>

#include "posix/outcome.hpp"
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
  double min_evidence = 0.0;  ///< Voxels with less are unknown.
};

struct OctreeReport {
  std::uint64_t occupied = 0;  ///< Voxels.
  std::uint64_t free = 0;
  std::uint64_t nodes = 0;  ///< Of the tree, pruned.
};

/// Whether this build has OctoMap's library, without which write_octree() only fails.
[[nodiscard]] bool can_write_octrees() noexcept;

/// Writes every observed voxel of the map as occupied or free, just as its state is (an OcTree with
/// OctoMap's threshold of 0.5), replacing what was at path only when the file is complete. The
/// lattice is the map's: the origins are the same. Log-odds are within those of 1e-6 and 1 - 1e-6.
/// Eight voxels of one value are one leaf. Fails with kUsage iff this build has no OctoMap, a voxel
/// is beyond kOctreeVoxelLimit, or path cannot be written to; with kFailure iff there is no memory
/// for the tree or writing breaks off. On failure path is as it was. Shows its progress on stderr.
/// O(16 voxels); memory some 60 bytes a node of the pruned tree.
Outcome<OctreeReport> write_octree(const LocalMap& map, const OctreeOptions& options,
                                   const std::string& path);

}  // namespace tessera
