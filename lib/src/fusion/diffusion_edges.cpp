// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The weights of the graph's edges: k_0 g.
#include "tessera/fusion/internal/diffusion_brick.hpp"

namespace tessera {

namespace {

/// What is left of an edge between nodes whose labels differ.
constexpr float kOtherLabel = 0.1F;
constexpr float kLeastSimilarity = 0.01F;

}  // namespace

/// Multiplies the weights of a node's edges by g. By the other's probability of the node's label:
/// no sum over lanes. Returns the sum of the weights.
template <EdgeTerm kTerm>
float DiffusionBrick::weigh(const Voice& own, std::span<Edge> edges) const noexcept {
  float weights = 0.0F;
  for (Edge& edge : edges) {
    const Voice& there = voices_[edge.node];
    const float common = sums_[edge.node * stride_ + own.label] * there.inverse;
    float g = 1.0F;
    if constexpr (kTerm == EdgeTerm::kLabel) g = own.label == there.label ? 1.0F : kOtherLabel;
    if constexpr (kTerm == EdgeTerm::kSimilarity)
      g = kLeastSimilarity + (1.0F - kLeastSimilarity) * common;
    if constexpr (kTerm == EdgeTerm::kConfidence)
      g = (1.0F - own.sure * there.sure * (1.0F - common)) * there.loudness;
    edge.weight *= g;
    weights += edge.weight;
  }
  return weights;
}

float DiffusionBrick::weigh_edges(const Voice& own, std::span<Edge> edges) const noexcept {
  switch (config_.edge) {
    case EdgeTerm::kNone:
      return weigh<EdgeTerm::kNone>(own, edges);
    case EdgeTerm::kLabel:
      return weigh<EdgeTerm::kLabel>(own, edges);
    case EdgeTerm::kSimilarity:
      return weigh<EdgeTerm::kSimilarity>(own, edges);
    case EdgeTerm::kConfidence:
      return weigh<EdgeTerm::kConfidence>(own, edges);
  }
  return 0.0F;
}

/// The edges of a node, in the order of (z, y, x). False iff there is no room for them.
bool DiffusionBrick::link(std::size_t at, std::size_t cell) noexcept {
  if (edges_.size() - edge_count_ <= offsets_.size()) return false;
  Node& node = nodes_[at];
  node.first_edge = static_cast<std::uint32_t>(edge_count_);
  Edge* const edges = &edges_[edge_count_];
  std::size_t count = 0;
  const std::uint32_t* const own = &node_of_cell_[cell];
  // Written whether it is a node or not: which of them are is a coin that no branch foresees.
  for (const Offset& offset : offsets_) {
    const std::uint32_t other = own[offset.cells];
    edges[count] = {other, offset.weight};
    count += other != kNoNode ? 1U : 0U;
  }
  node.edges = static_cast<std::uint32_t>(count);
  edge_count_ += count;
  if (config_.mode == DiffusionMode::kPaper) {
    node.share = 1.0F;
    return true;
  }
  const float weights = weigh_edges(voices_[at], {edges, count});
  node.share = weights > 0.0F ? config_.alpha / weights : 0.0F;
  return true;
}

}  // namespace tessera
