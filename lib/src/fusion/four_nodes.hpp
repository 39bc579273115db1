// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Numbers by node and lane, of four nodes at a time.
#pragma once

#include <cstddef>
#include <cstring>

#include "tessera/base/internal/lanes.hpp"

namespace tessera {

/// Calls visit(lane, numbers of four nodes) by ascending lane. load(node, lane): four lanes of one
/// of the nodes. stride: lanes, a multiple of four.
template <class Load, class Visit>
void for_lanes(std::size_t stride, Load&& load, Visit&& visit) noexcept {
  for (std::size_t lane = 0; lane < stride; lane += 4) {
    const Float4 a = load(0, lane);
    const Float4 b = load(1, lane);
    const Float4 c = load(2, lane);
    const Float4 d = load(3, lane);
    const Float4 low_ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
    const Float4 low_cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    const Float4 high_ab = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    const Float4 high_cd = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    visit(lane, Float4(__builtin_shufflevector(low_ab, low_cd, 0, 1, 4, 5)));
    visit(lane + 1, Float4(__builtin_shufflevector(low_ab, low_cd, 2, 3, 6, 7)));
    visit(lane + 2, Float4(__builtin_shufflevector(high_ab, high_cd, 0, 1, 4, 5)));
    visit(lane + 3, Float4(__builtin_shufflevector(high_ab, high_cd, 2, 3, 6, 7)));
  }
}

/// Sums over lanes of four nodes, and for each its first lane of those with the most.
struct FourNodes {
  Float4 sum{};
  Float4 most{};
  Int4 leader{};

  /// By ascending lane; counts are not negative.
  void add(std::size_t lane, const Float4& counts) noexcept {
    const auto number = static_cast<std::int32_t>(lane);
    const Int4 is_more = counts > most;
    sum += counts;
    most = counts > most ? counts : most;
    leader = (Int4{number, number, number, number} & is_more) | (leader & ~is_more);
  }
  void store_leaders(std::uint32_t* to) const noexcept { std::memcpy(to, &leader, sizeof(leader)); }
};

}  // namespace tessera
