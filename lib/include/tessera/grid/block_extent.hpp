// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "tessera/grid/lattice.hpp"

namespace tessera {

/// A box around blocks, its corners included. Of no blocks: low is above high.
struct BlockExtent {
  BlockCoord low{INT32_MAX, INT32_MAX, INT32_MAX};
  BlockCoord high{INT32_MIN, INT32_MIN, INT32_MIN};

  [[nodiscard]] constexpr bool any() const noexcept {
    return low.x <= high.x && low.y <= high.y && low.z <= high.z;
  }
  constexpr void include(const BlockExtent& other) noexcept {
    low = {std::min(low.x, other.low.x), std::min(low.y, other.low.y),
           std::min(low.z, other.low.z)};
    high = {std::max(high.x, other.high.x), std::max(high.y, other.high.y),
            std::max(high.z, other.high.z)};
  }
  constexpr void include(BlockCoord block) noexcept { include(BlockExtent{block, block}); }
  /// All blocks of the other one are in this one.
  [[nodiscard]] constexpr bool contains(const BlockExtent& other) const noexcept {
    return !other.any() ||
           (low.x <= other.low.x && low.y <= other.low.y && low.z <= other.low.z &&
            high.x >= other.high.x && high.y >= other.high.y && high.z >= other.high.z);
  }
  [[nodiscard]] constexpr bool touches(const BlockExtent& other) const noexcept {
    return low.x <= other.high.x && low.y <= other.high.y && low.z <= other.high.z &&
           high.x >= other.low.x && high.y >= other.low.y && high.z >= other.low.z;
  }
  friend constexpr bool operator==(const BlockExtent&, const BlockExtent&) = default;
};

}  // namespace tessera
