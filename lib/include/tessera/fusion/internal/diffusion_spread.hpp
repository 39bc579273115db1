// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The inner loop of the diffusion: what nodes get from their neighbours in one iteration, in two
// widths of lanes with the same bits.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tessera/base/internal/lane_width.hpp"

namespace tessera {

/// A voxel of the overlap that has evidence of a class.
struct DiffusionNode {
  float sum = 0.0F;    ///< |B|
  float share = 0.0F;  ///< What its edges' weights are multiplied by.
  float change = 0.0F;
  std::uint32_t first_edge = 0;
  std::uint32_t edges = 0;
  std::uint32_t edges_before = 0;  ///< Of all nodes before.
  std::uint32_t leader = 0;        ///< The lane with the most after the last iteration.
};

/// Nodes that are numbered one after the other, and what an iteration reads and writes of them.
/// Z and B: by node and lane, stride floats a node.
struct DiffusionRun {
  const DiffusionNode* nodes = nullptr;
  /// The neighbours' places in Z. Each node's edges are filled up to a whole number of fours by
  /// some with the weight 0.
  const std::uint32_t* edges = nullptr;
  const float* weights = nullptr;  ///< Of edges.
  const float* from = nullptr;     ///< Z
  const float* sums = nullptr;     ///< B
  float* to = nullptr;             ///< Z of the next iteration.
  std::size_t stride = 0;
  std::size_t first = 0;
  std::size_t last = 0;   ///< Behind the last one.
  bool adds_own = false;  ///< A node's own Z, as in eq. (15); else it is left out.
};

/// Of 4 to 16 lanes from one on: in each sum in the order of the edges. O(edges).
using SpreadLanes = void (*)(const DiffusionRun& run, std::size_t lane) noexcept;
/// fours: 1 .. 4, a fourth of the lanes.
[[nodiscard]] SpreadLanes spread_lanes(std::size_t fours, LaneWidth width) noexcept;

}  // namespace tessera
