// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The rays of a scan, traced as far as time goes.
#pragma once

#include "tessera/inference/internal/free_space.hpp"
#include "tessera/inference/internal/scan_points.hpp"

namespace tessera {

class RayTracer {
 public:
  /// Rays traced from one reading of the clock to the next.
  static constexpr std::size_t kRayBatch = 64;
  /// Parts of a scan's rays, each spread over all directions, that are traced one after the other.
  static constexpr std::size_t kRaySweeps = 16;

  /// Traces the rays of all points, and those beyond the range limit. With a deadline, as long as
  /// what was admitted can still be written in time: what is traced when time runs short is spread
  /// over all directions, and the next scan continues where it ran short, so that a robot which
  /// stands sees along all rays in the end. False: the ray blocks are full. O(voxels crossed).
  [[nodiscard]] bool trace(const ScanPoints& points, FreeSpace& free_space,
                           ScanWork& work) noexcept;
  /// Rays of the last call that were left out.
  [[nodiscard]] std::size_t rays_cut() const noexcept { return rays_cut_; }
  /// None was left out.
  void forget_cut() noexcept { rays_cut_ = 0; }

 private:
  std::size_t rays_cut_ = 0;
  std::size_t first_sweep_ = 0;  ///< That rays are traced in.
};

}  // namespace tessera
