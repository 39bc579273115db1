// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Nothing else here: units for one kind of machine include this.
#pragma once

#include <cstdint>

#include "tessera/registration/label_limits.hpp"

namespace tessera {

/// A point in tile-local coordinates: voxels from the tile's corner.
struct TilePoint {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
  float weight = 0.0F;
  std::uint8_t component = 0;  ///< Of its best label.
  // Its other labels, the heaviest first, and where what they leave of one goes (RestOfLabels).
  std::uint8_t second = 0;
  std::uint8_t third = 0;
  std::uint8_t fourth = 0;
  /// In the same order, a byte each from the lowest: 255ths, 0 after the last, 255 in all.
  std::uint32_t label_weights = kOneLabel;
};

/// Calls visit(component, weight in 255ths) for each label of a point, the best first. Visit: a
/// type of the unit's own.
template <class Visit>
[[gnu::always_inline]] inline void for_labels(const TilePoint& point, Visit&& visit) noexcept {
  std::uint32_t components = point.component | (std::uint32_t{point.second} << 8U) |
                             (std::uint32_t{point.third} << 16U) |
                             (std::uint32_t{point.fourth} << 24U);
  for (std::uint32_t weights = point.label_weights; weights != 0; weights >>= 8U) {
    visit(static_cast<std::uint8_t>(components), static_cast<std::uint8_t>(weights));
    components >>= 8U;
  }
}
/// The share of a point's contribution that a label of that weight has.
[[gnu::always_inline]] inline float share_of(std::uint8_t weight) noexcept {
  return static_cast<float>(weight) * (1.0F / static_cast<float>(kOneLabel));
}

}  // namespace tessera
