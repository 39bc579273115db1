// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What edges depend on, and the edges: k_0 g.
#include <algorithm>
#include <bit>
#include <limits>

#include "four_nodes.hpp"
#include "tessera/fusion/internal/diffusion_brick.hpp"
#include "tessera/semantics/evidence.hpp"

namespace tessera {

namespace {

/// Evidence at which a node is half sure of its label.
constexpr float kHalfSure = 4.0F;
/// Evidence at which a node's own weight counts half: what was seen often does not drown the rest.
constexpr float kLoud = 10.0F;
/// What is left of an edge between nodes whose labels differ.
constexpr float kAcrossLabels = 0.1F;
constexpr float kLeastSimilarity = 0.01F;
// Sums come from packed blocks, and a node has one at least: its inverse is finite, and what it is
// multiplied with, a sum of all lanes at most, leaves it finite.
static_assert(1.0F / kLeastCount * (kLargestCount * static_cast<float>(kMaxComponents)) <
              std::numeric_limits<float>::max());

}  // namespace

/// term(lane, probability, label): of edges to four nodes from one with the lane as its label. Sums
/// go from lane to lane, so that lanes of classes that a node does not have change nothing.
template <class Term>
void DiffusionBrick::describe_by(Term&& term) noexcept {
  const std::size_t padded = align_up(node_count_, 4);
  for (std::size_t i = 0; i < padded; i += 4) {
    const float* const b = sums_ + i * stride_;
    const auto load = [&](std::size_t node, std::size_t lane) {
      return load4(b + node * stride_ + lane);
    };
    FourNodes four;
    for_lanes(stride_, load,
              [&](std::size_t lane, const Float4& counts) { four.add(lane, counts); });
    const Float4 inverse = all_lanes(1.0F) / four.sum;
    store4(&sure_[i], four.sum / (four.sum + all_lanes(kHalfSure)));
    store4(&loudness_[i], all_lanes(kLoud) / (all_lanes(kLoud) + four.sum));
    four.store_leaders(&labels_[i]);
    const std::size_t nodes = std::min<std::size_t>(4, node_count_ - i);
    for (std::size_t k = 0; k < nodes; ++k)
      nodes_[i + k] = {.sum = four.sum[k], .leader = labels_[i + k]};
    for_lanes(stride_, load, [&](std::size_t lane, const Float4& counts) {
      if (lane < lanes_) store4(z_ + lane * padded + i, term(lane, counts * inverse, four.leader));
    });
  }
}

/// Terms of edges are where Z will be.
void DiffusionBrick::describe_nodes() noexcept {
  const EdgeTerm edge = config_.mode == DiffusionMode::kPaper ? EdgeTerm::kNone : config_.edge;
  switch (edge) {
    case EdgeTerm::kNone:
      return describe_by([](std::size_t, const Float4&, const Int4&) { return all_lanes(1.0F); });
    case EdgeTerm::kLabel:
      return describe_by([](std::size_t lane, const Float4&, const Int4& label) {
        const auto own = static_cast<std::int32_t>(lane);
        const Int4 is_same = label == Int4{own, own, own, own};
        return is_same ? all_lanes(1.0F) : all_lanes(kAcrossLabels);
      });
    case EdgeTerm::kSimilarity:
      return describe_by([](std::size_t, const Float4& common, const Int4&) {
        return all_lanes(kLeastSimilarity) + all_lanes(1.0F - kLeastSimilarity) * common;
      });
    case EdgeTerm::kConfidence:
      return describe_by(
          [](std::size_t, const Float4& common, const Int4&) { return all_lanes(1.0F) - common; });
  }
}

/// The nodes of a row that are at least reach from its ends. False iff there is no room for edges.
bool DiffusionBrick::link_row(LinkTask& task, std::int32_t y, std::int32_t z,
                              LinkEnd& end) noexcept {
  const std::size_t row = row_at(y, z);
  if (!has_nodes(row)) return true;
  std::size_t rows = 0;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const LinkCells& cells = links_[i];
    const std::size_t at = row_at(y + cells.dy, z + cells.dz);
    if (!has_nodes(at)) continue;
    const auto shift = static_cast<std::size_t>(reach_ + cells.dx);
    linked_rows_[rows++] = {.nodes = reinterpret_cast<const std::byte*>(rows_[at].data()),
                            .ranks = &ranks_[at * width_ + shift],
                            .weights = &link_weights_[i],
                            .first = first_[at],
                            .shift = static_cast<std::uint8_t>(shift),
                            .mask = static_cast<std::uint8_t>((1U << cells.cells) - 1U)};
  }
  task.rows = linked_rows_.first(rows);
  auto node = static_cast<std::uint32_t>(nodes_before(row, reach_));
  const Row inside = cells_within(reach_, edge_[0] - reach_);
  for (std::size_t word = 0; word < inside.size(); ++word) {
    for (std::uint64_t bits = rows_[row][word] & inside[word]; bits != 0; bits &= bits - 1) {
      if (edges_.size() - end.edge < most_edges_ + LinkTask::kBehind) return false;
      link_node(task, node++, static_cast<int>(64 * word) + std::countr_zero(bits), end);
    }
  }
  return true;
}

bool DiffusionBrick::link_nodes() noexcept {
  LinkTask task{.rows = {},
                .reach = reach_,
                .sure = sure_.data(),
                .loudness = loudness_.data(),
                .labels = labels_.data(),
                .terms = z_,
                .lane_stride = align_up(node_count_, 4),
                .confidence = config_.edge == EdgeTerm::kConfidence,
                .floats = stride_,
                .alpha = config_.alpha,
                .edges = edges_.data(),
                .weights = weights_.data(),
                .nodes = nodes_.data()};
  // Eq. (15) has no shares.
  const bool is_paper = config_.mode == DiffusionMode::kPaper;
  if (is_paper) task.confidence = false;
  LinkEnd end;
  bool fits = true;
  for (std::int32_t z = reach_; z < edge_[2] - reach_ && fits; ++z) {
    for (std::int32_t y = reach_; y < edge_[1] - reach_ && fits; ++y)
      fits = link_row(task, y, z, end);
  }
  edge_count_ = end.counted;
  for (std::size_t i = 0; is_paper && i < node_count_; ++i) nodes_[i].share = 1.0F;
  return fits;
}

}  // namespace tessera
