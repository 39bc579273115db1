// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How far the points of a scan contribute, and the most that a point may take.
#pragma once

#include <cmath>
#include <cstdint>

#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/tile_evidence.hpp"
#include "tessera/inference/kernel.hpp"

namespace tessera {

/// Edge of the units that points are gathered in, voxels.
[[nodiscard]] constexpr int unit_edge_of(const InferenceConfig& config) noexcept {
  return by_entropies(config.mode) ? config.entropy.block_edge : 2;
}

[[nodiscard]] inline KernelShape kernel_shape(const InferenceConfig& config,
                                              float length_voxels) noexcept {
  return {1.0F / (length_voxels * length_voxels), config.kernel_scale, config.min_weight};
}

/// Of a scan in the kernel mode.
struct KernelReach {
  float radius_voxels = 0.0F;  ///< Beyond that distance no contribution counts.
  int units = 0;  ///< Most units from a point's unit to one it contributes to, on an axis.
};

/// largest_weight: of the scan's points. A weight above one can lift a contribution over the
/// cut-off anywhere in the ball. O(1).
[[nodiscard]] inline KernelReach kernel_reach(const InferenceConfig& config, double resolution_m,
                                              float largest_weight) noexcept {
  const double length = static_cast<double>(config.kernel_length_m) / resolution_m;
  const double lift =
      static_cast<double>(largest_weight) * static_cast<double>(config.kernel_scale);
  const double cut = lift > 0.0 ? static_cast<double>(config.min_weight) / lift : 1.0;
  const auto s = static_cast<double>(Kernel::support(cut < 1.0 ? cut : 1.0));
  const auto radius = static_cast<float>(length * std::sqrt(s));
  return {radius, (static_cast<int>(radius + 1.5F) + 1) / 2};
}

/// A bound on the evaluations for a point. O(1).
[[nodiscard]] inline std::uint64_t most_evaluations(const InferenceConfig& config,
                                                    const KernelReach& reach) noexcept {
  switch (config.mode) {
    case InferenceMode::kCounting:
      return 1;
    case InferenceMode::kKernel: {
      // Beyond that no budget is met, and products with the number of points would wrap.
      constexpr std::uint64_t kWidest = 4096;
      const auto side = static_cast<std::uint64_t>(2.0F * reach.radius_voxels + 2.0F);
      return side > kWidest ? kWidest * kWidest * kWidest : side * side * side;
    }
    case InferenceMode::kMultiEntropy:
    case InferenceMode::kLattice:
      break;
  }
  const auto edge = static_cast<std::uint64_t>(unit_edge_of(config));
  return 7 * edge * edge * edge;
}

}  // namespace tessera
