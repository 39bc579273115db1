// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whether a loop closes, and whether it does without what one of its authors states.
#pragma once

#include "team_graph.hpp"

namespace tessera {

/// What the loop is without each of its authors.
struct WithoutAuthors {
  std::uint64_t closed = 0;   ///< It closes without what this one states.
  std::uint64_t unknown = 0;  ///< Nobody else states what this one does.
};

/// Tries loops of up to eight legs; of longer ones, all are unknown.
[[nodiscard]] WithoutAuthors try_without_each(TeamGraph& graph,
                                              std::span<const LoopLeg> legs) noexcept;
/// It does not close.
[[nodiscard]] bool is_open(const TeamGraph& graph, std::span<const LoopLeg> legs) noexcept;
/// A leg of it is a prior.
[[nodiscard]] bool through_priors(const TeamGraph& graph, std::span<const LoopLeg> legs) noexcept;

}  // namespace tessera
