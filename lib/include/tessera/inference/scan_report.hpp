// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What integrating a scan did, and what it left out. Every refusal has its counter.
#pragma once

#include <cstdint>

#include "tessera/base/counters.hpp"
#include "tessera/base/status.hpp"
#include "tessera/inference/scan_counters.h"

namespace tessera {

/// Every return is in one counter, and so is every thinned point. Where pose is kOk,
/// points = non_finite + too_near + on_body + on_teammate + no_return + out_of_grid + over_capacity
/// + beyond_range + in_range + returns_cut; thinned = admitted + refused_memory() + refused_work +
/// refused_deadline.
struct ScanReport {
  /// kOk, or kInvalidArgument iff the pose is not rigid or its origin is out of the grid, or
  /// InferenceConfig::body does not allow T_body_sensor: then nothing else was done.
  Status pose = Status::kOk;
  TESSERA_SCAN_COUNTERS(TESSERA_COUNTER_MEMBER)

  /// Thinned points left out because map storage or scratch was full.
  [[nodiscard]] std::uint32_t refused_memory() const noexcept {
    return refused_storage + refused_tiles + refused_ray_blocks;
  }
  /// Rays beyond the range limit left out.
  [[nodiscard]] std::uint32_t rays_refused() const noexcept {
    return rays_refused_memory + rays_refused_work + rays_refused_deadline;
  }
  /// Kernel evaluations and ray steps done.
  [[nodiscard]] std::uint64_t work_spent() const noexcept { return evaluations + ray_steps; }
  /// Returns, thinned points and rays left out by the deadline.
  [[nodiscard]] std::uint32_t left_out_deadline() const noexcept {
    return refused_deadline + rays_refused_deadline + returns_cut + rays_cut + points_cut;
  }
  /// Thinned points whose evidence is in the map.
  [[nodiscard]] std::uint32_t points_kept() const noexcept { return admitted - points_cut; }
  /// Rays of all thinned points, and of all thinned directions beyond the range limit. Of these,
  /// `rays` were traced. 0 without free space, where no ray is traced, cut or left
  /// out: so also where every point of a scan is refused and none is beyond the range limit.
  [[nodiscard]] std::uint32_t rays_wanted() const noexcept {
    const std::uint32_t others = rays + rays_cut + rays_refused();
    return others == 0 ? 0 : others + thinned - admitted;
  }
  /// Returns, thinned points and rays that could have been integrated but were not.
  [[nodiscard]] std::uint32_t left_out() const noexcept {
    return over_capacity + refused_memory() + refused_work + rays_refused_memory +
           rays_refused_work + left_out_deadline();
  }
};
TESSERA_COUNTER_TABLE(ScanReport, TESSERA_SCAN_COUNTERS(TESSERA_COUNTER_ROW))
/// Over scans.
TESSERA_COUNTER_SUMS(ScanTotals, ScanReport, TESSERA_SCAN_COUNTERS)

}  // namespace tessera
