// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a contribution is, by the number of its submap. Numbers of no map are the highest ones, so
// that submaps can be counted from 0.
#pragma once

#include "tessera/replica/objection.hpp"

namespace tessera {

/// What a robot states about frames (frames/frame_statements.hpp), as a contribution of its own:
/// where it finds the maps of others in its own, and how well its own frame is known.
struct FrameStatements {
  /// The submap's number of a robot's statements, which are no map.
  static constexpr std::uint32_t kNumber = Objection::kNumber - 1;
  [[nodiscard]] static constexpr bool is(std::uint32_t submap) noexcept {
    return submap == kNumber;
  }
  /// Contributions of statements that others hold of one robot: of its newest epochs.
  static constexpr std::uint32_t kPlacesOfRobot = 2;
  /// Links that a robot may state in one epoch, to another robot each.
  static constexpr std::uint32_t kMostLinks = Replicas::kMostRobots - 1;
};

/// Contributions of each kind have places of their own.
enum class ContributionKind : std::uint8_t {
  kMap,         ///< A map, or a submap of one.
  kSession,     ///< A map of an earlier day (MapSession).
  kObjections,  ///< What a robot says against the blocks of others (Objection).
  kFrames,      ///< What a robot says about frames (FrameStatements).
};

[[nodiscard]] constexpr ContributionKind kind_of(const ContributionId& id) noexcept {
  if (MapSession::is(id.submap)) return ContributionKind::kSession;
  if (Objection::is(id.submap)) return ContributionKind::kObjections;
  return FrameStatements::is(id.submap) ? ContributionKind::kFrames : ContributionKind::kMap;
}
/// Of what a robot maps today.
[[nodiscard]] constexpr bool is_map(const ContributionId& id) noexcept {
  return kind_of(id) == ContributionKind::kMap;
}
/// Its records are blocks of a map, today's or an earlier one. Otherwise its frame means nothing,
/// it is nowhere, and never far.
[[nodiscard]] constexpr bool has_blocks(const ContributionId& id) noexcept {
  return is_map(id) || kind_of(id) == ContributionKind::kSession;
}

static_assert(FrameStatements::kNumber + 1 == Objection::kNumber &&
                  Objection::kNumber + 1 == MapSession::kFirst,
              "the numbers of maps have no gap");

}  // namespace tessera
