// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rays through a map that another thread writes to, and through whatever else answers for a voxel.
// cast_ray does the same for a map that nobody writes to, box by box and so faster.
#pragma once

#include "tessera/grid/internal/segment.hpp"
#include "tessera/map/cast_ray.hpp"

namespace tessera {

/// What a ray through a reader met, and what that cost.
struct ReaderRay {
  /// As cast_ray's; kMaxRange too where the ray was broken off.
  RayHit hit{};
  bool broken_off = false;  ///< max_voxels were read, or the reader was busy at one.
  bool busy = false;        ///< It was that.
  int voxels = 0;           ///< Read.
};

/// As cast_ray, for a Reader with Result<Estimate> query(VoxelCoord): MapReader, GlobalReader.
/// Voxels are of the moments when they were read. Breaks off, with hit.distance_m up to where all
/// was looked at, after max_voxels. As many queries as voxels on the way, at most max_range_m /
/// resolution * sqrt(3) + 4.
template <class Reader>
[[nodiscard]] ReaderRay cast_ray(Reader& reader, const Lattice& lattice, const Point3f& origin_map,
                                 const Point3f& direction, double max_range_m, bool stop_at_unknown,
                                 int max_voxels) noexcept {
  ReaderRay ray;
  const Point3d d = direction.cast<double>();
  const double length = norm(d);
  if (!(length > 0.0) || !(length < 1e30) || !(max_range_m > 0.0)) return ray;
  const Point3d from = origin_map.cast<double>();
  const Point3d to = from + d * (max_range_m / length);
  if (!lattice.voxel_of(origin_map).ok() || !lattice.voxel_of(round_to_float(to)).ok()) return ray;
  ray.hit.end = RayHit::End::kMaxRange;
  ray.hit.distance_m = max_range_m;
  const auto visit = [&](std::int32_t x, std::int32_t y, std::int32_t z, double t) {
    const auto break_off = [&] {
      ray.broken_off = true;
      ray.hit.distance_m = t * max_range_m;
      return false;
    };
    if (ray.voxels >= max_voxels) return break_off();
    ++ray.voxels;
    const Result<Estimate> estimate = reader.query(VoxelCoord{x, y, z});
    if (!estimate.ok()) {
      ray.busy = true;
      return break_off();
    }
    const bool unknown = estimate->state == VoxelState::kUnknown;
    if (estimate->state == VoxelState::kFree || (unknown && !stop_at_unknown)) return true;
    ray.hit = {.end = unknown ? RayHit::End::kUnknown : RayHit::End::kOccupied,
               .voxel = {x, y, z},
               .distance_m = t * max_range_m,
               .estimate = *estimate};
    return false;
  };
  static_cast<void>(
      walk_segment(from / lattice.resolution_m(), to / lattice.resolution_m(), visit));
  return ray;
}

}  // namespace tessera
