// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tessera {

/// Sums over nodes, in 2^-40: whole numbers, so that their order does not matter.
struct NodeStatistics {
  std::uint64_t variance = 0;
  std::uint64_t variance_undiffused = 0;
  std::uint32_t nodes = 0;
  float largest_sum = 0.0F;     ///< |B|
  float largest_change = 0.0F;  ///< |Z_n - Z_{n-1}|

  constexpr void add(const NodeStatistics& other) noexcept {
    variance += other.variance;
    variance_undiffused += other.variance_undiffused;
    nodes += other.nodes;
    if (other.largest_sum > largest_sum) largest_sum = other.largest_sum;
    if (other.largest_change > largest_change) largest_change = other.largest_change;
  }
};

}  // namespace tessera
