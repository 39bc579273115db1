// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/ray_tracer.hpp"

namespace tessera {

bool RayTracer::trace(const ScanPoints& points, FreeSpace& free_space, ScanWork& work) noexcept {
  const std::size_t returns = points.admitted().size();
  if (free_space.add_returns(points.admitted()) != Status::kOk) return false;
  // Marks are a set, so with a deadline every sixteenth ray comes first, then those next to them.
  const std::size_t sweeps = work.has_deadline() ? kRaySweeps : 1;
  const std::uint64_t to_write = returns * work.foreseen_per_point();
  const std::size_t rays = returns + points.rays().size();
  std::size_t traced = 0;
  const std::size_t first = first_sweep_ % sweeps;
  for (std::size_t n = 0; n < sweeps && rays_cut_ == 0; ++n) {
    const std::size_t sweep = (first + n) % sweeps;
    // Axis by axis, so that few blocks are turned more than once.
    for (int axis = 2; axis >= 0 && rays_cut_ == 0; --axis) {
      for (std::size_t i = sweep; i < rays; i += sweeps) {
        const Point3f& end_map = points.end_of_ray(i).p_map;
        if (free_space.axis_of(end_map) != axis) continue;
        if (traced % kRayBatch == 0 &&
            !work.in_time(to_write + work.to_write(free_space.blocks().size()))) {
          rays_cut_ = rays - traced;
          first_sweep_ = sweep;
          break;
        }
        if (free_space.trace(end_map, i < returns) != Status::kOk) return false;
        ++traced;
      }
    }
  }
  free_space.finish();
  return true;
}

}  // namespace tessera
