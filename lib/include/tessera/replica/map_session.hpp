// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map session: a map of an earlier day, of this or another robot, that a robot loads from a file
// and publishes beside its own map. Its evidence counts less than today's, and counts once however
// many robots load the same file (docs/design/theory.md).
#pragma once

#include <compare>
#include <cstdint>

namespace tessera {

/// What a robot states about a session with its frame.
struct MapSession {
  /// Units of a weight: that of evidence which counts as it is.
  static constexpr std::uint16_t kFullWeight = 1U << 15U;
  /// That one robot has at a time, at most.
  static constexpr std::uint32_t kMostOfRobot = 8;
  /// That others hold of it, with those that were removed or are of an earlier start, and so that
  /// it opens in one epoch.
  static constexpr std::uint32_t kPlacesOfRobot = 16;
  /// A session is a contribution whose submap has a number from this one on. A robot gives each
  /// number once in an epoch.
  static constexpr std::uint32_t kFirst = 0xffff'0000U;
  [[nodiscard]] static constexpr bool is(std::uint32_t submap) noexcept { return submap >= kFirst; }

  std::uint64_t digest = 0;  ///< Of the content of its file: its name.
  std::int64_t date_s = 0;   ///< Of the map: UTC, seconds since 1970 without leap seconds.
  std::uint16_t weight = 0;  ///< Of its evidence; 0: it was removed, and counts nothing.
  friend constexpr auto operator<=>(const MapSession&, const MapSession&) = default;
};

}  // namespace tessera
