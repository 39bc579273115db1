// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What integrating a scan did, and what it left out. Every refusal has its counter.
#pragma once

#include <cstdint>

#include "tessera/base/status.hpp"

namespace tessera {

struct ScanReport {
  /// kOk, or kInvalidArgument iff the pose is not rigid or its origin is out of the grid: then
  /// nothing else was done.
  Status pose = Status::kOk;
  std::uint32_t points = 0;  ///< Returns handed in.
  std::uint32_t non_finite =
      0;  ///< Refused: NaN or infinite coordinates, or a weight that is not finite and >= 0.
  std::uint32_t too_near = 0;      ///< Refused: nearer than min_range_m.
  std::uint32_t beyond_range = 0;  ///< Farther than max_range_m: carve only.
  std::uint32_t out_of_grid = 0;   ///< Refused: outside the grid.
  std::uint32_t unlabelled = 0;    ///< Returns in range whose class is not known.
  std::uint32_t over_capacity =
      0;  ///< Left out: the scan has more returns than ScanCapacity::points; it was sampled evenly.
  std::uint32_t thinned = 0;   ///< Points after thinning.
  std::uint32_t admitted = 0;  ///< Thinned points that were integrated.
  std::uint32_t refused_memory =
      0;                           ///< Thinned points left out: map storage, index or scratch full.
  std::uint32_t refused_work = 0;  ///< Thinned points left out: work budget.
  std::uint32_t rays = 0;          ///< Rays carved.
  std::uint32_t rays_refused = 0;  ///< Rays beyond the range limit left out, for either reason.
  std::uint64_t voxel_updates = 0;  ///< Contributions added: pairs of a point and a voxel.
  std::uint64_t evaluations = 0;    ///< Kernel evaluations done, in or out of support.
  std::uint64_t ray_steps = 0;      ///< Voxels stepped through by rays.
  std::uint32_t label_octets = 0;   ///< Octets written.
  std::uint32_t free_blocks = 0;    ///< Blocks carved.

  /// Returns and thinned points that could have been integrated but were not.
  [[nodiscard]] std::uint32_t left_out() const noexcept {
    return over_capacity + refused_memory + refused_work + rays_refused;
  }
};

}  // namespace tessera
