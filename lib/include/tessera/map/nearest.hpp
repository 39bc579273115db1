// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The nearest obstacle: what a planner asks most.
#pragma once

#include "tessera/map/local_map.hpp"

namespace tessera {

struct NearestVoxel {
  bool found = false;
  VoxelCoord voxel{};
  double distance_m = 0.0;  ///< To the voxel's centre.
  Estimate estimate{};
};

/// Blocks that the radius below may reach along an axis.
inline constexpr int kMostNearestBlocks = 32;

/// The occupied voxel whose centre is nearest to p_map, of those within radius_m; of equally near
/// ones always the same. Fails with kOutOfRange iff p_map is not finite or out of the grid;
/// kInvalidArgument iff radius_m is not above 0, or over kMostNearestBlocks blocks. Work: a look-up
/// for each block up to one beyond the nearest obstacle, at most (2 radius / block + 5)^3, and 512
/// voxels in each that the map has.
[[nodiscard]] Result<NearestVoxel> nearest_occupied(const LocalMap& map, const Point3f& p_map,
                                                    double radius_m) noexcept;

}  // namespace tessera
