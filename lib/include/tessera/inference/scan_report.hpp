// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What integrating a scan did, and what it left out. Every refusal has its counter.
#pragma once

#include <cstdint>

#include "tessera/base/status.hpp"

namespace tessera {

/// Every return is in one counter, and so is every thinned point. Where pose is kOk,
/// points = non_finite + too_near + out_of_grid + over_capacity + beyond_range + in_range +
/// returns_cut; thinned = admitted + refused_memory() + refused_work + refused_deadline.
struct ScanReport {
  /// kOk, or kInvalidArgument iff the pose is not rigid or its origin is out of the grid: then
  /// nothing else was done.
  Status pose = Status::kOk;
  std::uint32_t points = 0;  ///< Returns handed in.
  std::uint32_t non_finite =
      0;  ///< Refused: NaN or infinite coordinates, or a weight that is not in 0 .. kMaxWeight.
  std::uint32_t too_near = 0;      ///< Refused: nearer than min_range_m.
  std::uint32_t beyond_range = 0;  ///< Farther than max_range_m: carve only.
  /// Refused: outside the grid; or in range and over 2^19 voxels or thinning cells (the smaller)
  /// from the sensor; or beyond the range and over 10^7 m from it, which is no measurement.
  std::uint32_t out_of_grid = 0;
  std::uint32_t in_range = 0;    ///< Returns that were registered as hits.
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
  std::uint32_t refused_deadline = 0;    ///< The deadline, as it was foreseen.
  std::uint32_t rays = 0;  ///< Traced: of admitted points, and beyond the range limit.
  std::uint32_t rays_refused_memory =
      0;                                ///< Rays beyond the range limit left out: storage, scratch.
  std::uint32_t rays_refused_work = 0;  ///< The same: work budget.
  std::uint32_t rays_refused_deadline = 0;  ///< The same: the deadline, when admission foresaw it.
  /// Left out because the deadline came, in the order in which that happens. Points and rays here
  /// were admitted; a point may be left out with its ray, and is counted in both.
  /// Returns of a scan that was not registered in time: all but those over capacity.
  std::uint32_t returns_cut = 0;
  std::uint32_t rays_cut = 0;        ///< Rays not traced.
  std::uint32_t tiles_cut = 0;       ///< Tiles not written.
  std::uint32_t points_cut = 0;      ///< Admitted points in these.
  std::uint32_t ray_blocks_cut = 0;  ///< Blocks traced and not carved.
  std::int64_t overshoot_us = 0;     ///< How late the scan ended; 0: in time, or no deadline.
  /// The limit that held: the work budget, or what fits the deadline if that is less, against which
  /// labels are held and not rays; 0: none.
  std::uint64_t work_limit = 0;
  /// Bounds of what was admitted; 0 without a limit. work_spent() stays under it.
  std::uint64_t work_predicted = 0;
  std::uint32_t tiles = 0;          ///< Tiles used, of ScanCapacity::tiles.
  std::uint32_t ray_blocks = 0;     ///< Ray blocks used, of ScanCapacity::ray_blocks.
  std::uint64_t voxel_updates = 0;  ///< Contributions added: pairs of a point and a voxel.
  std::uint64_t evaluations = 0;    ///< Voxels that kernels were evaluated for, in reach or not.
  /// Voxels stepped through by rays: once, or twice where the scan did not fit as a whole and the
  /// one before it did (on trial, for carving); and blocks on rays admitted one by one.
  std::uint64_t ray_steps = 0;
  std::uint32_t strips = 0;        ///< Kernel mode: runs of tiles that were summed up together.
  std::uint32_t label_octets = 0;  ///< Octets written.
  std::uint32_t free_blocks = 0;   ///< Blocks carved.
  /// Octets, blocks and rays of what was admitted that could not be written. 0, or the library is
  /// at fault: admission reserves room for all of them.
  std::uint32_t write_faults = 0;

  /// Thinned points left out because map storage or scratch was full.
  [[nodiscard]] std::uint32_t refused_memory() const noexcept {
    return refused_storage + refused_tiles + refused_ray_blocks;
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
    const std::uint32_t beyond = rays_refused_memory + rays_refused_work + rays_refused_deadline;
    const std::uint32_t others = rays + rays_cut + beyond;
    return others == 0 ? 0 : others + thinned - admitted;
  }
  /// Returns, thinned points and rays that could have been integrated but were not.
  [[nodiscard]] std::uint32_t left_out() const noexcept {
    return over_capacity + refused_memory() + refused_work + rays_refused_memory +
           rays_refused_work + left_out_deadline();
  }
};

}  // namespace tessera
