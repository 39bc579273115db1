// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Edges of a node to its neighbours: k_0 of their distance, eq. (11), where it is at least 2^-44.
#pragma once

#include "tessera/fusion/diffusion_config.hpp"

namespace tessera {

class DiffusionStencil {
 public:
  DiffusionStencil() noexcept = default;
  /// length: D in voxels. Offsets beyond kMostReach on an axis have no edge. O(kMostReach^3).
  explicit DiffusionStencil(double length) noexcept;
  /// The largest offset on an axis with an edge.
  [[nodiscard]] int reach() const noexcept { return reach_; }
  /// Edges of a node with all neighbours.
  [[nodiscard]] int edges() const noexcept { return edges_; }
  /// Calls visit(dx, dy, dz, weight) for every edge, in the order of (z, y, x). O(reach^3).
  template <class Visit>
  void for_edges(Visit&& visit) const noexcept {
    for (int dz = -reach_; dz <= reach_; ++dz) {
      for (int dy = -reach_; dy <= reach_; ++dy) {
        for (int dx = -reach_; dx <= reach_; ++dx) {
          const float weight = weight_at(dx * dx + dy * dy + dz * dz);
          if (weight > 0.0F) visit(dx, dy, dz, weight);
        }
      }
    }
  }

 private:
  /// k_0 at a squared distance, voxels; 0 for none: a node has no edge to itself.
  [[nodiscard]] float weight_at(int squared) const noexcept;

  double length_ = 1.0;
  int reach_ = 0;
  int edges_ = 0;
};

}  // namespace tessera
