// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Edges of a node to its neighbours: k_0 of their distance, eq. (11), where it is at least 2^-44.
// Its witnesses, itself and the nodes around it that have a say in its label.
#pragma once

#include "tessera/fusion/diffusion_config.hpp"
#include "tessera/fusion/internal/diffusion_links.hpp"
#include "tessera/inference/kernel.hpp"

namespace tessera {

class DiffusionStencil {
 public:
  constexpr DiffusionStencil() noexcept = default;
  /// length: D in voxels. Offsets beyond kMostReach on an axis have no edge. O(kMostReach^3).
  explicit constexpr DiffusionStencil(double length) noexcept;
  /// The largest offset on an axis with an edge.
  [[nodiscard]] constexpr int reach() const noexcept { return reach_; }
  /// Edges of a node with all neighbours.
  [[nodiscard]] constexpr int edges() const noexcept { return edges_; }
  /// Calls visit(dx, dy, dz, weight) for every edge, in the order of (z, y, x). O(reach^3).
  template <class Visit>
  constexpr void for_edges(Visit&& visit) const noexcept {
    for (int dz = -reach_; dz <= reach_; ++dz) {
      for (int dy = -reach_; dy <= reach_; ++dy) {
        for (int dx = -reach_; dx <= reach_; ++dx) {
          const float weight = weight_at(dx * dx + dy * dy + dz * dz);
          if (weight > 0.0F) visit(dx, dy, dz, weight);
        }
      }
    }
  }
  /// Calls visit(cells) for all edges, those to cells beside each other together, in the same
  /// order.
  template <class Visit>
  constexpr void for_links(Visit&& visit) const noexcept {
    LinkCells cells;
    for_edges([&](int dx, int dy, int dz, float weight) {
      const bool goes_on = cells.cells != 0 && cells.cells != LinkCells::kMost && cells.dy == dy &&
                           cells.dz == dz && cells.dx + cells.cells == dx;
      if (!goes_on) {
        if (cells.cells != 0) visit(cells);
        cells = {static_cast<std::int8_t>(dx),
                 static_cast<std::int8_t>(dy),
                 static_cast<std::int8_t>(dz),
                 0,
                 {}};
      }
      cells.weights[cells.cells++] = weight;
    });
    if (cells.cells != 0) visit(cells);
  }

  /// The largest offset on an axis of a witness; 0 if there are no edges.
  [[nodiscard]] constexpr int witness_reach() const noexcept { return witness_reach_; }
  /// Rows along x of witnesses, of 2 width + 1 voxels each. Calls visit(dy, dz, width) in the order
  /// of (z, y). O(reach^2).
  template <class Visit>
  constexpr void for_witnesses(Visit&& visit) const noexcept {
    for (int dz = -witness_reach_; dz <= witness_reach_; ++dz) {
      for (int dy = -witness_reach_; dy <= witness_reach_; ++dy) {
        int width = witness_reach_;
        while (width >= 0 && !is_witness(width * width + dy * dy + dz * dz)) --width;
        if (width >= 0) visit(dy, dz, width);
      }
    }
  }

 private:
  /// Of D, nearer than that is a witness.
  static constexpr double kWitnessLengths = 2.5;
  [[nodiscard]] constexpr bool is_witness(int squared) const noexcept {
    // What is rounding of D reaches no farther.
    const double nearer = kWitnessLengths * length_ * (1.0 - 1e-6);
    return static_cast<double>(squared) < nearer * nearer;
  }
  /// Less is rounding: a length of two voxels as a float is a little more, and must not reach a
  /// third, for a node without other neighbours would take all of that one.
  static constexpr double kLeastWeight = 0x1p-44;
  /// k_0 at a squared distance, voxels; 0 for none: a node has no edge to itself.
  [[nodiscard]] constexpr float weight_at(int squared) const noexcept {
    if (squared == 0) return 0.0F;
    const double weight = kernel_exact(detail::exact_sqrt(squared) / length_);
    return weight >= kLeastWeight ? static_cast<float>(weight) : 0.0F;
  }

  double length_ = 1.0;
  int reach_ = 0;
  int edges_ = 0;
  int witness_reach_ = 0;
};

constexpr DiffusionStencil::DiffusionStencil(double length) noexcept : length_(length) {
  while (reach_ < DiffusionConfig::kMostReach && weight_at((reach_ + 1) * (reach_ + 1)) > 0.0F)
    ++reach_;
  for_edges([this](int, int, int, float) { ++edges_; });
  const auto reaches = [this](int offset) { return is_witness(offset * offset); };
  while (edges_ != 0 && witness_reach_ < DiffusionConfig::kMostReach && reaches(witness_reach_ + 1))
    ++witness_reach_;
}

}  // namespace tessera
