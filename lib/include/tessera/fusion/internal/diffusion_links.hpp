// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which neighbours nodes have, and what the edges to them weigh: those of up to four cells of a row
// at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/fusion/internal/diffusion_spread.hpp"

namespace tessera {

/// Cells along x, at most four one after the other, that a node has edges to where they are nodes.
struct LinkCells {
  static constexpr std::size_t kMost = 4;
  std::int8_t dx = 0;  ///< Of the first one.
  std::int8_t dy = 0;
  std::int8_t dz = 0;
  std::uint8_t cells = 0;
  std::array<float, kMost> weights{};  ///< k_0 of each.
};
/// By which of the cells are nodes, a bit each: k_0 of those that are, one after the other.
using LinkWeights = std::array<std::array<float, LinkCells::kMost>, 16>;
[[nodiscard]] LinkWeights pack_weights(const LinkCells& cells) noexcept;

/// The same for all nodes of a row: the cells are in a row that has nodes.
struct LinkRow {
  const std::byte* nodes = nullptr;     ///< Of the row: which cells are nodes, a bit each.
  const std::uint8_t* ranks = nullptr;  ///< Its nodes before the first cell of a node at x = reach.
  const LinkWeights* weights = nullptr;
  std::uint32_t first = 0;  ///< Nodes before the row.
  std::uint8_t shift = 0;   ///< dx + reach
  std::uint8_t mask = 0;    ///< A bit for each cell.
};

/// What edges depend on, and where they go. Nodes are numbered one after the other along a row.
/// Arrays by node have three more elements, of any value.
struct LinkTask {
  /// Behind the edges that a node may have, edges and weights have room for so many.
  static constexpr std::size_t kBehind = 8;

  std::span<const LinkRow> rows;          ///< In the order of (z, y, x).
  int reach = 0;                          ///< -dx at most.
  const float* sure = nullptr;            ///< How sure a node's label is, 0 to 1.
  const float* loudness = nullptr;        ///< What it gives of its evidence, 0 to 1.
  const std::uint32_t* labels = nullptr;  ///< Lanes.
  /// By lane and node: what an edge from a node with that label is multiplied by; under confidence
  /// how unlike the node is to that label.
  const float* terms = nullptr;
  std::size_t lane_stride = 0;  ///< Of terms.
  bool confidence = false;      ///< EdgeTerm::kConfidence
  std::size_t floats = 0;       ///< Of a node, as DiffusionRun::stride.
  float alpha = 0.0F;
  std::uint32_t* edges = nullptr;  ///< As DiffusionRun has them.
  float* weights = nullptr;
  DiffusionNode* nodes = nullptr;
};
/// Where the next edge goes.
struct LinkEnd {
  std::uint32_t edge = 0;     ///< With those that fill up fours.
  std::uint32_t counted = 0;  ///< Without.
};

/// Links one node in column x: its edges, their number, and its share. Edges are filled up to a
/// whole number of fours by some that weigh nothing. O(rows).
void link_node(const LinkTask& task, std::uint32_t node, int x, LinkEnd& end) noexcept;

}  // namespace tessera
