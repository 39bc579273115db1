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
      0;  ///< Refused: NaN or infinite coordinates, or a weight that is not in 0 .. kMaxWeight.
  std::uint32_t too_near = 0;      ///< Refused: nearer than min_range_m.
  std::uint32_t beyond_range = 0;  ///< Farther than max_range_m: carve only.
  /// Refused: outside the grid, or over 2^19 voxels or thinning cells (the smaller) from the
  /// sensor.
  std::uint32_t out_of_grid = 0;
  std::uint32_t unlabelled = 0;  ///< Returns in range whose class is not known.
  std::uint32_t over_capacity =
      0;  ///< Left out: the scan has more returns than ScanCapacity::points; it was sampled evenly.
  std::uint32_t thinned = 0;   ///< Points after thinning.
  std::uint32_t admitted = 0;  ///< Thinned points that were integrated.
  /// Thinned points left out, each counted once, by what to enlarge.
  std::uint32_t refused_storage = 0;     ///< MapConfig::storage_bytes.
  std::uint32_t refused_tiles = 0;       ///< ScanCapacity::tiles.
  std::uint32_t refused_ray_blocks = 0;  ///< ScanCapacity::ray_blocks.
  std::uint32_t refused_work = 0;        ///< InferenceConfig::work_budget.
  std::uint32_t rays = 0;                ///< Rays of admitted points and beyond the range limit.
  std::uint32_t rays_refused_memory =
      0;                                ///< Rays beyond the range limit left out: storage, scratch.
  std::uint32_t rays_refused_work = 0;  ///< The same: work budget.
  std::uint32_t tiles = 0;              ///< Tiles used, of ScanCapacity::tiles.
  std::uint32_t ray_blocks = 0;         ///< Ray blocks used, of ScanCapacity::ray_blocks.
  std::uint64_t voxel_updates = 0;      ///< Contributions added: pairs of a point and a voxel.
  std::uint64_t evaluations = 0;        ///< Kernel evaluations done, in or out of support.
  /// Voxels stepped through by rays: once, or up to three times where the scan did not fit as a
  /// whole (on trial, for admission, for carving).
  std::uint64_t ray_steps = 0;
  std::uint32_t label_octets = 0;  ///< Octets written.
  std::uint32_t free_blocks = 0;   ///< Blocks carved.

  /// Thinned points left out because map storage or scratch was full.
  [[nodiscard]] std::uint32_t refused_memory() const noexcept {
    return refused_storage + refused_tiles + refused_ray_blocks;
  }
  /// Returns, thinned points and rays that could have been integrated but were not.
  [[nodiscard]] std::uint32_t left_out() const noexcept {
    return over_capacity + refused_memory() + refused_work + rays_refused_memory +
           rays_refused_work;
  }
};

}  // namespace tessera
