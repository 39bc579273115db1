// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/diffusion_links.hpp"

#include <bit>
#include <cstring>

#include "tessera/base/arena.hpp"
#include "tessera/base/internal/lanes.hpp"

namespace tessera {

namespace {

constexpr std::array<std::uint8_t, 16> kOnesOfFour{0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4};

/// A node whose edges are made, four at a time: what is written behind those that a row has is
/// written anew by the next one.
template <bool kConfidence>
class EdgesOfNode {
 public:
  EdgesOfNode(const LinkTask& task, std::uint32_t node) noexcept
      : terms_(task.terms + task.labels[node] * task.lane_stride),
        sures_(task.sure),
        loudness_(task.loudness),
        edges_(task.edges),
        weights_(task.weights),
        floats_(static_cast<std::int32_t>(task.floats)),
        sure_(all_lanes(task.sure[node])),
        steps_{0, floats_, 2 * floats_, 3 * floats_} {}
  /// To neighbours that are numbered one after the other from node on. The edge term is by the
  /// other's probability of the node's label: no sum over lanes.
  void add(const float* weights, std::uint32_t node, std::uint32_t edge) noexcept {
    Float4 g = load4(terms_ + node);
    if constexpr (kConfidence) {
      g = sure_ * load4(sures_ + node) * g;
      g = (all_lanes(1.0F) - g) * load4(loudness_ + node);
    }
    store4(weights_ + edge, load4(weights) * g);
    store_places(node, steps_, edge);
  }
  void fill_up(std::uint32_t node, std::uint32_t edge) noexcept {
    store4(weights_ + edge, Float4{});
    store_places(node, Int4{}, edge);
  }

 private:
  void store_places(std::uint32_t node, const Int4& steps, std::uint32_t edge) noexcept {
    const auto place = static_cast<std::int32_t>(node) * floats_;
    const Int4 places = Int4{place, place, place, place} + steps;
    std::memcpy(edges_ + edge, &places, sizeof(places));
  }

  // As values: what is written through pointers could be a task that is referred to.
  const float* terms_;
  const float* sures_;
  const float* loudness_;
  std::uint32_t* edges_;
  float* weights_;
  std::int32_t floats_;
  Float4 sure_;
  Int4 steps_;
};

template <bool kConfidence>
void link_with(const LinkTask& task, std::uint32_t node, int x, LinkEnd& end) noexcept {
  EdgesOfNode<kConfidence> edges(task, node);
  const auto from = static_cast<std::size_t>(x - task.reach);
  const std::size_t byte = from / 8;
  const std::size_t shift = from % 8;
  std::uint32_t edge = end.edge;
  const std::span<const LinkRow> rows = task.rows;
  for (const LinkRow& row : rows) {
    std::uint64_t word = 0;
    std::memcpy(&word, row.nodes + byte, sizeof(word));
    const auto cells = static_cast<std::size_t>(word >> (shift + row.shift)) & row.mask;
    edges.add((*row.weights)[cells].data(), row.first + row.ranks[from], edge);
    edge += kOnesOfFour[cells];
  }
  edges.fill_up(node, edge);
  float weights = 0.0F;
  for (const float weight : std::span(task.weights + end.edge, edge - end.edge)) weights += weight;
  DiffusionNode& here = task.nodes[node];
  here.first_edge = end.edge;
  here.edges = edge - end.edge;
  here.edges_before = end.counted;
  here.share = weights > 0.0F ? task.alpha / weights : 0.0F;
  end.counted += here.edges;
  end.edge += static_cast<std::uint32_t>(align_up(here.edges, 4));
}

}  // namespace

LinkWeights pack_weights(const LinkCells& cells) noexcept {
  LinkWeights packed{};
  for (std::size_t bits = 0; bits < packed.size(); ++bits) {
    std::size_t count = 0;
    for (std::size_t cell = 0; cell < LinkCells::kMost; ++cell)
      if (((bits >> cell) & 1U) != 0) packed[bits][count++] = cells.weights[cell];
  }
  return packed;
}

void link_node(const LinkTask& task, std::uint32_t node, int x, LinkEnd& end) noexcept {
  task.confidence ? link_with<true>(task, node, x, end) : link_with<false>(task, node, x, end);
}

}  // namespace tessera
