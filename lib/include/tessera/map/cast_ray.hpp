// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rays through a map: what a sensor would see of it.
#pragma once

#include "tessera/map/local_map.hpp"

namespace tessera {

/// What a ray met.
struct RayHit {
  /// Why the ray ended.
  enum class End : std::uint8_t {
    kMaxRange,  ///< Nothing but free (and, unless stop_at_unknown, unknown) voxels up to the range.
    kOccupied,
    kUnknown,  ///< Only with stop_at_unknown.
    kInvalid,  ///< Origin not in the grid, or direction or range not finite and positive, or the
               ///< ray leaves the grid.
  };
  End end = End::kInvalid;
  VoxelCoord voxel{};
  double distance_m = 0.0;  ///< From the origin to where the ray enters the voxel.
  Estimate estimate{};
};

/// "max range", "occupied", "unknown" or "invalid".
constexpr const char* to_string(RayHit::End end) noexcept {
  switch (end) {
    case RayHit::End::kMaxRange:
      return "max range";
    case RayHit::End::kOccupied:
      return "occupied";
    case RayHit::End::kUnknown:
      return "unknown";
    case RayHit::End::kInvalid:
      return "invalid";
  }
  return "invalid";
}

/// The first occupied voxel from origin_map along direction (any length > 0), up to max_range_m.
/// Steps through at most max_range_m / resolution * sqrt(3) + 4 voxels, with a look-up for each
/// block that they are in. Unless stop_at_unknown, only voxels with label evidence are read (and
/// those with free evidence where LocalMap::only_labels_occupy() is false).
[[nodiscard]] RayHit cast_ray(const LocalMap& map, const Point3f& origin_map,
                              const Point3f& direction, double max_range_m,
                              bool stop_at_unknown = false) noexcept;

}  // namespace tessera
