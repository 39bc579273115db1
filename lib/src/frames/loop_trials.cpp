// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "loop_trials.hpp"

namespace tessera {

namespace {

constexpr std::uint32_t kMostTriedLegs = 8;

/// How a loop closes with what an author states taken from whom it states it about, where these
/// state something. Unknown if it does not, and there is something that nobody else states.
Closing closing_without(TeamGraph& graph, std::span<const LoopLeg> legs,
                        NodeIndex author) noexcept {
  bool all = true;
  LoopSum sum(graph.storage[legs.back().statement].about);
  for (const LoopLeg leg : legs) {
    const FrameStatement& statement = graph.storage[leg.statement];
    const bool by_author = statement.from == author && !statement.given;
    const FrameStatement* const other = by_author ? graph.counterpart(statement) : nullptr;
    all = all && (!by_author || other != nullptr);
    sum.add(other != nullptr ? *other : statement, leg.forward != (other != nullptr));
  }
  const Closing closing = sum.closing();
  return closing == Closing::kOpen && !all ? Closing::kUnknown : closing;
}

/// The robots that state something of a loop.
std::uint64_t authors_of(const TeamGraph& graph, std::span<const LoopLeg> legs) noexcept {
  std::uint64_t authors = 0;
  for (const LoopLeg leg : legs) {
    const FrameStatement& statement = graph.storage[leg.statement];
    if (!statement.given) authors |= std::uint64_t{1} << statement.from;
  }
  return authors;
}

}  // namespace

bool is_open(const TeamGraph& graph, std::span<const LoopLeg> legs) noexcept {
  LoopSum sum(graph.storage[legs.back().statement].about);
  for (const LoopLeg leg : legs) sum.add(graph.storage[leg.statement], leg.forward);
  return sum.closing() == Closing::kOpen;
}

bool through_priors(const TeamGraph& graph, std::span<const LoopLeg> legs) noexcept {
  bool any = false;
  for (const LoopLeg leg : legs) any = any || graph.storage[leg.statement].given;
  return any;
}

WithoutAuthors try_without_each(TeamGraph& graph, std::span<const LoopLeg> legs) noexcept {
  WithoutAuthors found;
  const std::uint64_t authors = authors_of(graph, legs);
  if (legs.size() > kMostTriedLegs) return {0, authors};
  for (std::uint32_t author = 0; author < graph.robots; ++author) {
    if ((authors >> author & 1U) == 0) continue;
    const Closing closing = closing_without(graph, legs, static_cast<NodeIndex>(author));
    const std::uint64_t bit = std::uint64_t{1} << author;
    if (closing == Closing::kClosed) found.closed |= bit;
    if (closing == Closing::kUnknown) found.unknown |= bit;
  }
  return found;
}

}  // namespace tessera
