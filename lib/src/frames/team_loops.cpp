// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Loops of statements: whether they close, and those of three.
#include "team_graph.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

void LoopSum::add(const FrameStatement& statement, bool forward) noexcept {
  vague_ = vague_ || statement.turns;
  if (!forward) T_start_here_ = product(T_start_here_, inverse(statement.T_from_to));
  SquareOfSix J{};
  motion_seen_from(T_start_here_, statement.about, at_, J);
  add_congruent(J, statement.covariance, covariance_);
  if (forward) T_start_here_ = product(T_start_here_, statement.T_from_to);
}

Closing LoopSum::closing_within(double most_squared_sigmas) const noexcept {
  SixBySix L{};
  if (vague_ || !factor_six(covariance_, L)) return Closing::kUnknown;
  const double off = squared_sigmas(L, motion_at(T_start_here_, at_));
  return off <= most_squared_sigmas ? Closing::kClosed : Closing::kOpen;
}

void root_forest(TeamGraph& graph) noexcept {
  const std::uint32_t nodes = graph.robots + 1;
  std::array<bool, kMostNodes> seen{};
  std::uint32_t count = 0;
  std::uint32_t next = 0;
  // The world first, then the lowest of what it does not reach.
  for (std::uint32_t i = 0; i < nodes; ++i) {
    const auto root = static_cast<NodeIndex>(i == 0 ? graph.robots : i - 1);
    if (seen[root]) continue;
    seen[root] = true;
    graph.forest[root] = {};
    graph.order[count++] = root;
    for (; next < count; ++next) {
      const NodeIndex node = graph.order[next];
      for (std::uint32_t other = 0; other < nodes; ++other) {
        if (seen[other]) continue;
        const FrameStatement* edge = graph.find(node, other);
        if (edge == nullptr || !edge->in_forest) edge = graph.find(other, node);
        if (edge == nullptr || !edge->in_forest) continue;
        seen[other] = true;
        graph.forest[other] = {static_cast<std::uint16_t>(edge - graph.storage.data()), node,
                               static_cast<NodeIndex>(graph.forest[node].depth + 1)};
        graph.order[count++] = static_cast<NodeIndex>(other);
      }
    }
  }
}

std::uint32_t loop_over_forest(TeamGraph& graph, std::uint16_t statement, LoopLegs& legs) noexcept {
  const FrameStatement& chord = graph.storage[statement];
  NodeIndex low = chord.from;
  NodeIndex high = chord.to;
  std::uint32_t up = 0;
  std::uint32_t down = 0;
  LoopLegs descent{};
  while (low != high) {
    const bool from_low = graph.forest[low].depth >= graph.forest[high].depth;
    NodeIndex& node = from_low ? low : high;
    const ForestNode at = graph.forest[node];
    TESSERA_ASSERT(at.up != kNoStatement);
    const bool stated_here = graph.storage[at.up].from == node;
    if (from_low) {
      legs[up++] = {at.up, stated_here};
    } else {
      descent[down++] = {at.up, !stated_here};
    }
    node = at.parent;
  }
  while (down > 0) legs[up++] = descent[--down];
  legs[up++] = {statement, false};
  return up;
}

namespace {

/// The statement of an edge of a triangle, by the one node or by the other.
FrameStatement* edge_of(TeamGraph& graph, const FrameTriangle& triangle, unsigned edge,
                        bool by_next) noexcept {
  const NodeIndex node = triangle.nodes[edge];
  const NodeIndex next = triangle.nodes[(edge + 1) % 3];
  return by_next ? graph.find(next, node) : graph.find(node, next);
}

}  // namespace

std::array<FrameStatement*, 3> combination_of(TeamGraph& graph, const FrameTriangle& triangle,
                                              unsigned combination) noexcept {
  std::array<FrameStatement*, 3> edges{};
  for (unsigned edge = 0; edge < 3; ++edge) {
    edges[edge] = edge_of(graph, triangle, edge, (combination >> edge & 1U) != 0);
    if (edges[edge] == nullptr) return {};
  }
  return edges;
}

namespace {

/// The 0.01 quantile of chi-square with six degrees of freedom: what two others confirm together
/// has to be nearer than what is not refused.
constexpr double kConfirmingSquaredSigmas = 16.8;

/// None of a prior, which nobody is suspected of.
std::uint64_t author_bit(const FrameStatement& statement) noexcept {
  return statement.given ? 0 : std::uint64_t{1} << statement.from;
}

/// Where two others say the same, and not vaguely, a statement is confirmed.
void confirm_by(const std::array<FrameStatement*, 3>& edges) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    const FrameStatement& one = *edges[(i + 1) % 3];
    const FrameStatement& other = *edges[(i + 2) % 3];
    const bool independent = one.from != edges[i]->from && other.from != edges[i]->from;
    if (independent && one.tight && other.tight)
      edges[i]->confirm(author_bit(one) | author_bit(other));
  }
}

void test_triangle(TeamGraph& graph, FrameTriangle& triangle) noexcept {
  for (unsigned combination = 0; combination < FrameTriangle::kCombinations; ++combination) {
    const std::array<FrameStatement*, 3> edges = combination_of(graph, triangle, combination);
    if (edges[0] == nullptr) continue;
    const bool first_forward = (combination & 1U) == 0;
    // It begins where the first statement was made, whose covariance is small about its point.
    LoopSum sum(edges[0]->about);
    if (first_forward) {
      sum.add(*edges[0], true);
      sum.add(*edges[1], (combination & 2U) == 0);
      sum.add(*edges[2], (combination & 4U) == 0);
    } else {
      sum.add(*edges[1], (combination & 2U) == 0);
      sum.add(*edges[2], (combination & 4U) == 0);
      sum.add(*edges[0], false);
    }
    const Closing closing = sum.closing();
    if (closing == Closing::kOpen) continue;
    triangle.consistent = static_cast<std::uint8_t>(triangle.consistent | 1U << combination);
    if (sum.closing_within(kConfirmingSquaredSigmas) == Closing::kClosed) confirm_by(edges);
  }
}

/// Whether what two state of each other is the same, which confirms both.
void test_pair(TeamGraph& graph, std::uint32_t a, std::uint32_t b) noexcept {
  FrameStatement* const there = graph.find(a, b);
  FrameStatement* const back = graph.find(b, a);
  if (there == nullptr || back == nullptr) return;
  LoopSum sum(there->about);
  sum.add(*there, true);
  sum.add(*back, true);
  if (sum.closing() != Closing::kClosed) return;
  there->agrees = back->agrees = true;
  // What a robot agrees to may be held against it, too.
  if (back->tight) there->confirm(0);
  if (there->tight) back->confirm(0);
}

bool joined(TeamGraph& graph, std::uint32_t a, std::uint32_t b) noexcept {
  return graph.slot(a, b) != kNoStatement || graph.slot(b, a) != kNoStatement;
}

}  // namespace

void find_triangles(TeamGraph& graph) noexcept {
  const std::uint32_t nodes = graph.robots + 1;
  for (std::uint32_t a = 0; a < nodes; ++a) {
    for (std::uint32_t b = a + 1; b < nodes; ++b) {
      if (!joined(graph, a, b)) continue;
      test_pair(graph, a, b);
      for (std::uint32_t c = b + 1; c < nodes; ++c) {
        if (!joined(graph, a, c) || !joined(graph, b, c)) continue;
        FrameTriangle& triangle = graph.triangle_storage[graph.triangle_count++];
        triangle.nodes = {static_cast<NodeIndex>(a), static_cast<NodeIndex>(b),
                          static_cast<NodeIndex>(c)};
        triangle.consistent = 0;
        test_triangle(graph, triangle);
      }
    }
  }
}

}  // namespace tessera
