// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which pairs are wrong where confirmed statements do not close: those in the most open triangles.
#include <bit>

#include "team_graph.hpp"

namespace tessera {

namespace {

PairVotes& votes_of(TeamGraph& graph, const FrameTriangle& triangle, unsigned edge) noexcept {
  const NodeIndex a = triangle.nodes[edge];
  const NodeIndex b = triangle.nodes[(edge + 1) % 3];
  return graph.votes[std::size_t{a < b ? a : b} * kMostNodes + (a < b ? b : a)];
}

/// Of the confirmed statements of a triangle; unknown if it has none of an edge.
Closing closing_of(TeamGraph& graph, const FrameTriangle& triangle) noexcept {
  Closing found = Closing::kUnknown;
  for (unsigned combination = 0; combination < FrameTriangle::kCombinations; ++combination) {
    bool all = true;
    const std::array<FrameStatement*, 3> edges = combination_of(graph, triangle, combination);
    for (const FrameStatement* const edge : edges)
      all = all && edge != nullptr && edge->active() && edge->confirmed;
    if (!all) continue;
    if ((triangle.consistent >> combination & 1U) != 0) return Closing::kClosed;
    found = Closing::kOpen;
  }
  return found;
}

/// Whether one pair is worse than another: in more loops that do not close, or in fewer that do.
bool worse(const PairVotes& one, const PairVotes& other) noexcept {
  return one.broken != other.broken ? one.broken > other.broken : one.good < other.good;
}

/// False: all triangles close.
bool count_votes(TeamGraph& graph) noexcept {
  bool any = false;
  for (PairVotes& votes : graph.votes) votes = {};
  for (const FrameTriangle& triangle : graph.triangles()) {
    const Closing closing = closing_of(graph, triangle);
    if (closing == Closing::kUnknown) continue;
    const bool open = closing == Closing::kOpen;
    any = any || open;
    for (unsigned edge = 0; edge < 3; ++edge) {
      PairVotes& votes = votes_of(graph, triangle, edge);
      ++(open ? votes.broken : votes.good);
      if (open && triangle.nodes[2] == graph.world()) votes.against_priors = true;
    }
  }
  return any;
}

/// Both ends state it, and agree.
bool is_mutual(TeamGraph& graph, std::uint32_t a, std::uint32_t b) noexcept {
  const FrameStatement* const there = graph.find(a, b);
  return there != nullptr && there->active() && there->agrees &&
         graph.counterpart(*there) != nullptr;
}

/// Calls use(a, b, votes) for each pair of robots, but for mutual ones if they are spared.
template <class Use>
void for_each_pair(TeamGraph& graph, bool spare_mutual, const Use& use) noexcept {
  for (std::uint32_t a = 0; a < graph.robots; ++a) {
    for (std::uint32_t b = a + 1; b < graph.robots; ++b) {
      const PairVotes& votes = graph.votes[std::size_t{a} * kMostNodes + b];
      if (votes.broken == 0 || (spare_mutual && is_mutual(graph, a, b))) continue;
      use(a, b, votes);
    }
  }
}

/// Refuses the worst pairs of robots, all of them where several are as bad; and names the one robot
/// that three or more of them have in common. Of two pairs, one may be wrong by itself.
/// all: refuses all that are in a loop that does not close.
void refuse_worst(TeamGraph& graph, bool all) noexcept {
  PairVotes worst{};
  bool spare_mutual = true;
  const auto find_worst = [&](std::uint32_t, std::uint32_t, const PairVotes& votes) {
    if (worse(votes, worst)) worst = votes;
  };
  for_each_pair(graph, spare_mutual, find_worst);
  if (worst.broken == 0) {
    spare_mutual = false;
    for_each_pair(graph, spare_mutual, find_worst);
  }
  std::uint64_t in_all = ~std::uint64_t{0};
  std::uint32_t refused = 0;
  bool against_priors = false;
  for_each_pair(graph, spare_mutual, [&](std::uint32_t a, std::uint32_t b, const PairVotes& votes) {
    if (!all && worse(worst, votes)) return;
    ++refused;
    in_all &= std::uint64_t{1} << a | std::uint64_t{1} << b;
    against_priors = against_priors || votes.against_priors;
    for (FrameStatement* const statement : {graph.find(a, b), graph.find(b, a)}) {
      if (statement == nullptr || !statement->active()) continue;
      statement->sentence = statement->verdict =
          votes.against_priors ? LinkVerdict::kAgainstPriors : LinkVerdict::kContradicted;
    }
  });
  if (!all && refused > 2 && std::has_single_bit(in_all) && !against_priors)
    graph.suspected |= in_all;
}

}  // namespace

void vote_by_triangles(TeamGraph& graph) noexcept {
  // Each round refuses a pair at least; the last ones all, mutual pairs after the others.
  constexpr int kKindRounds = 32;
  for (int round = 0; count_votes(graph); ++round) refuse_worst(graph, round >= kKindRounds);
}

}  // namespace tessera
