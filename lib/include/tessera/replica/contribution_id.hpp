// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Names of contributions, and of where they lie.
#pragma once

#include <compare>
#include <cstdint>

namespace tessera {

/// Whose evidence it is. A robot that starts with an empty map opens a new epoch; submaps are parts
/// of a map that a pose graph may move on their own.
struct ContributionId {
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;
  std::uint32_t submap = 0;
  friend constexpr auto operator<=>(const ContributionId&, const ContributionId&) = default;
};

/// Names where a contribution lies: two that are equal were taken at the same place.
struct FrameStamp {
  std::uint32_t revision = 0;  ///< Of the frame that its robot states.
  std::uint32_t place = 0;     ///< Of the place of its robot's world (GlobalMap::place); 0: none.
  friend constexpr bool operator==(const FrameStamp&, const FrameStamp&) = default;
};

}  // namespace tessera
