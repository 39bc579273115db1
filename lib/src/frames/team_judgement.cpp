// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which statements are used. What authors confirm for each other first, then, where that does not
// join robots, one author's word.
#include <algorithm>
#include <bit>

#include "loop_trials.hpp"
#include "team_graph.hpp"

namespace tessera {

namespace {

constexpr int kRounds = 3;
constexpr NodeIndex kNobody = 0xff;
constexpr NodeIndex kAnybody = 0xff;

/// Sentences statements of a loop that does not close: those of one author, or all that may be
/// wrong.
template <class Wrong>
void sentence_loop(TeamGraph& graph, std::span<const LoopLeg> legs, LinkVerdict sentence,
                   const Wrong& wrong) noexcept {
  for (const LoopLeg leg : legs) {
    FrameStatement& statement = graph.storage[leg.statement];
    if (!statement.given && wrong(statement)) statement.sentence = sentence;
  }
}

/// Sentences statements of a loop of confirmed ones that does not close: those that only one end
/// states, or else all pairs, since any may be wrong.
void sentence_pairs(TeamGraph& graph, std::span<const LoopLeg> legs) noexcept {
  const LinkVerdict sentence =
      through_priors(graph, legs) ? LinkVerdict::kAgainstPriors : LinkVerdict::kContradicted;
  bool all_mutual = true;
  for (const LoopLeg leg : legs) {
    const FrameStatement& statement = graph.storage[leg.statement];
    all_mutual = all_mutual && (statement.given || graph.counterpart(statement) != nullptr);
  }
  for (const LoopLeg leg : legs) {
    FrameStatement& statement = graph.storage[leg.statement];
    FrameStatement* const back = graph.counterpart(statement);
    if (statement.given || (back != nullptr && !all_mutual)) continue;
    statement.sentence = sentence;
    if (back != nullptr) back->sentence = sentence;
  }
}

void carry_out(TeamGraph& graph) noexcept {
  for (FrameStatement& statement : graph.statements()) {
    if (statement.active()) statement.verdict = statement.sentence;
  }
}

/// Refuses all that these state.
void refuse_authors(TeamGraph& graph, std::uint64_t authors) noexcept {
  graph.suspected |= authors;
  for (FrameStatement& statement : graph.statements()) {
    if (!statement.given && (authors >> statement.from & 1U) != 0)
      statement.sentence = LinkVerdict::kAuthorRefused;
  }
}

/// The forest of the confirmed statements, in their order, without those by or about a robot, and
/// those that are no evidence against it.
void plant_confirmed(TeamGraph& graph, JoinedNodes& joined, NodeIndex without) noexcept {
  for (FrameStatement& statement : graph.statements()) {
    const bool apart =
        without == kNobody || (statement.from != without && statement.to != without &&
                               statement.is_evidence_against(without));
    statement.in_forest = apart && statement.active() && statement.confirmed &&
                          joined.join(statement.from, statement.to);
  }
}

/// The statements of an author, or of anybody, all or those that nobody confirms, the most certain
/// first: the number of keys.
std::uint32_t sort_statements(TeamGraph& graph, NodeIndex author, bool unconfirmed) noexcept {
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < graph.statement_count; ++i) {
    const FrameStatement& statement = graph.storage[i];
    if (author != kAnybody && statement.from != author) continue;
    // Positive doubles are ordered as their bits.
    if (statement.active() && !statement.given && !(unconfirmed && statement.confirmed))
      graph.keys[count++] = {std::bit_cast<std::uint64_t>(statement.spread), i};
  }
  radix_sort(graph.keys.first(count), graph.scratch);
  return count;
}

/// Looks at the loop of each confirmed statement over the forest. True: somebody was blamed, and
/// the loops have to be looked at again.
bool judge_confirmed_loops(TeamGraph& graph, bool naming) noexcept {
  JoinedNodes joined(graph.robots + 1);
  plant_confirmed(graph, joined, kNobody);
  root_forest(graph);
  std::uint64_t blamed = 0;
  LoopLegs storage{};
  for (std::uint32_t i = 0; i < graph.statement_count; ++i) {
    const FrameStatement& chord = graph.storage[i];
    if (!chord.active() || !chord.confirmed || chord.in_forest) continue;
    const auto at = static_cast<std::uint16_t>(i);
    const std::span<const LoopLeg> legs{storage.data(), loop_over_forest(graph, at, storage)};
    if (!is_open(graph, legs)) continue;
    const WithoutAuthors without = try_without_each(graph, legs);
    if (naming && std::has_single_bit(without.closed) && without.unknown == 0) {
      blamed |= without.closed;
    } else if (without.closed == 0 && !naming) {
      sentence_pairs(graph, legs);
    }
  }
  refuse_authors(graph, blamed);
  carry_out(graph);
  return blamed != 0;
}

/// Nobody whom an author states something about in a loop states anything about the author.
bool only_word(const TeamGraph& graph, std::span<const LoopLeg> legs, NodeIndex author) noexcept {
  return std::none_of(legs.begin(), legs.end(), [&](const LoopLeg& leg) {
    const FrameStatement& statement = graph.storage[leg.statement];
    return statement.from == author && graph.counterpart(statement) != nullptr;
  });
}

/// Names those whose own links do not close over what others confirm for each other, whichever end
/// of each pair of these is asked.
void judge_words(TeamGraph& graph) noexcept {
  std::uint64_t blamed = 0;
  LoopLegs storage{};
  for (std::uint32_t node = 0; node < graph.robots; ++node) {
    const auto author = static_cast<NodeIndex>(node);
    JoinedNodes joined(graph.robots + 1);
    plant_confirmed(graph, joined, author);
    const std::uint32_t count = sort_statements(graph, author, false);
    for (const KeyedIndex& key : graph.keys.first(count)) {
      FrameStatement& statement = graph.storage[key.index];
      statement.in_forest = joined.join(statement.from, statement.to);
    }
    root_forest(graph);
    for (const KeyedIndex& key : graph.keys.first(count)) {
      if (graph.storage[key.index].in_forest) continue;
      const auto at = static_cast<std::uint16_t>(key.index);
      const std::span<const LoopLeg> legs{storage.data(), loop_over_forest(graph, at, storage)};
      if (!is_open(graph, legs) || through_priors(graph, legs)) continue;
      const WithoutAuthors without = try_without_each(graph, legs);
      const std::uint64_t bit = std::uint64_t{1} << node;
      const bool others_may_be_it = ((without.closed | without.unknown) & ~bit) != 0;
      const bool closes_without = (without.closed & bit) != 0 || only_word(graph, legs, author);
      if (closes_without && !others_may_be_it) blamed |= bit;
    }
  }
  refuse_authors(graph, blamed);
  carry_out(graph);
}

/// Sentences what nobody confirms in a loop that does not close.
void judge_open_loop(TeamGraph& graph, std::span<const LoopLeg> legs) noexcept {
  const auto unconfirmed = [](const FrameStatement& one) { return !one.confirmed; };
  std::uint64_t authors = 0;
  for (const LoopLeg leg : legs) {
    const FrameStatement& one = graph.storage[leg.statement];
    if (unconfirmed(one)) authors |= std::uint64_t{1} << one.from;
  }
  if (through_priors(graph, legs)) {
    sentence_loop(graph, legs, LinkVerdict::kAgainstPriors, unconfirmed);
    return;
  }
  if (!std::has_single_bit(authors)) {
    sentence_loop(graph, legs, LinkVerdict::kContradicted, unconfirmed);
    return;
  }
  // Where the author's own links confirmed what they now contradict, one is as good as the other.
  const auto author = static_cast<NodeIndex>(std::countr_zero(authors));
  const auto doubtful = [&](const FrameStatement& one) {
    return !one.confirmed || !one.is_evidence_against(author);
  };
  bool evident = true;
  for (const LoopLeg leg : legs) {
    const FrameStatement& one = graph.storage[leg.statement];
    evident = evident && (unconfirmed(one) || !doubtful(one));
  }
  if (evident) graph.suspect(author);
  sentence_loop(graph, legs, evident ? LinkVerdict::kAuthorRefused : LinkVerdict::kContradicted,
                doubtful);
}

/// What does not close with what is confirmed, or with what others say, is refused. What is left
/// closes: each loop of it is a sum of loops that were looked at.
void judge_unconfirmed(TeamGraph& graph, NodeIndex author) noexcept {
  JoinedNodes joined(graph.robots + 1);
  plant_confirmed(graph, joined, kNobody);
  const std::uint32_t count = sort_statements(graph, author, true);
  if (count < 2 && author != kAnybody) return;
  for (const KeyedIndex& key : graph.keys.first(count)) {
    FrameStatement& statement = graph.storage[key.index];
    statement.in_forest = joined.join(statement.from, statement.to);
  }
  root_forest(graph);
  LoopLegs storage{};
  for (const KeyedIndex& key : graph.keys.first(count)) {
    if (graph.storage[key.index].in_forest) continue;
    const auto at = static_cast<std::uint16_t>(key.index);
    const std::span<const LoopLeg> legs{storage.data(), loop_over_forest(graph, at, storage)};
    if (is_open(graph, legs)) judge_open_loop(graph, legs);
  }
  carry_out(graph);
}

/// Nobody has to believe what somebody says who is suspected and whom nobody confirms.
void refuse_suspects(TeamGraph& graph) noexcept {
  for (FrameStatement& statement : graph.statements()) {
    const bool by_suspect = !statement.given && (graph.suspected >> statement.from & 1U) != 0;
    if (by_suspect && statement.active() && !statement.confirmed)
      statement.verdict = LinkVerdict::kAuthorRefused;
  }
}

/// Joins robots by what is confirmed and by exact priors; then, where that does not join them, by
/// one member's word.
void join_groups(TeamGraph& graph) noexcept {
  JoinedNodes joined(graph.robots + 1);
  for (const FrameStatement& statement : graph.statements()) {
    if (statement.active() && statement.confirmed && (!statement.given || statement.exact))
      static_cast<void>(joined.join(statement.from, statement.to));
  }
  const std::uint32_t count = sort_statements(graph, kAnybody, true);
  for (const KeyedIndex& key : graph.keys.first(count)) {
    FrameStatement& statement = graph.storage[key.index];
    if (!joined.join(statement.from, statement.to)) statement.verdict = LinkVerdict::kNotNeeded;
  }
  for (std::uint32_t i = 0; i <= graph.robots; ++i)
    graph.group[i] = joined.find(static_cast<NodeIndex>(i));
}

}  // namespace

void judge_statements(TeamGraph& graph) noexcept {
  find_triangles(graph);
  judge_words(graph);
  vote_by_triangles(graph);
  for (int round = 0; round < kRounds && judge_confirmed_loops(graph, true); ++round) {
  }
  static_cast<void>(judge_confirmed_loops(graph, false));
  // Each author's words by themselves, so that whoever contradicts himself is named for it rather
  // than others who contradict him; then all of them.
  for (std::uint32_t author = 0; author < graph.robots; ++author)
    judge_unconfirmed(graph, static_cast<NodeIndex>(author));
  refuse_suspects(graph);
  judge_unconfirmed(graph, kAnybody);
  refuse_suspects(graph);
  join_groups(graph);
}

}  // namespace tessera
