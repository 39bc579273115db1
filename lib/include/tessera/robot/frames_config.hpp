// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the frames of a team come from.
#pragma once

#include <cstdint>

#include "tessera/frames/team_frames.hpp"

namespace tessera {

/// The same for all robots of a team, but that some may be kRefined and others kFound.
enum class FrameMode : std::uint8_t {
  kGiven,    ///< T_global_map of each robot, exactly.
  kRefined,  ///< It is roughly known (FramesConfig), and links correct it.
  kFound     ///< Not known: links alone give it. T_global_map has no meaning.
};
constexpr const char* to_string(FrameMode mode) noexcept {
  return mode == FrameMode::kGiven ? "given" : mode == FrameMode::kRefined ? "refined" : "found";
}

/// How the frames of a team are found.
struct FramesConfig {
  FrameMode mode = FrameMode::kGiven;
  /// Standard deviations of T_global_map where it is refined, along each axis at the map's origin,
  /// 0 .. 100 m, and about each, 0 .. 1 rad. Both 0: it is exact, as of a survey; else none is 0.
  double sigma_m = 2.5;
  double sigma_rad = 0.0873;
  /// Robots that are placed, 1 .. TeamFrames::kMostRobots; of more, those with the lowest numbers.
  std::uint32_t most_robots = 16;

  /// Links that are kept: one from each robot to each, of two epochs.
  [[nodiscard]] constexpr std::uint32_t most_links() const noexcept {
    const std::uint32_t all = 2 * most_robots * (most_robots - 1) + 1;
    return all < TeamFrames::kMostLinks ? all : TeamFrames::kMostLinks;
  }
};

/// All values are in their ranges.
[[nodiscard]] constexpr bool is_valid(const FramesConfig& config) noexcept {
  return config.sigma_m >= 0.0 && config.sigma_m <= 100.0 && config.sigma_rad >= 0.0 &&
         config.sigma_rad <= 1.0 && (config.sigma_m > 0.0) == (config.sigma_rad > 0.0) &&
         config.most_robots >= 1 && config.most_robots <= TeamFrames::kMostRobots;
}

/// Whether this robot knows exactly where its own world is: a map of an earlier day has a place
/// there. A frame that is found may be rebased, and such a map would not go along.
[[nodiscard]] constexpr bool knows_own_frame(const FramesConfig& config) noexcept {
  return config.mode == FrameMode::kGiven ||
         (config.mode == FrameMode::kRefined && !(config.sigma_m > 0.0));
}

/// What has happened to frames in use. Counters never decrease.
struct FramesReport {
  std::uint64_t solved = 0;       ///< Times that the team's frames were computed.
  std::uint64_t withdrawals = 0;  ///< Frames in use that ended, of any robot.
  /// Times that all frames in use became others at once, as the robot that holds the group's frame
  /// became another.
  std::uint64_t rebased = 0;
  std::uint64_t steps = 0;           ///< Of frames in use that follow.
  std::uint64_t refused_robots = 0;  ///< Priors at one time for which there was no room: the most.
  std::uint64_t refused_links = 0;   ///< The same of links.
  std::uint64_t refused_frames = 0;  ///< Solutions and frames that were refused; no frame changed.
  std::uint64_t digest = 0;          ///< TeamSolution::digest of the latest.
};

}  // namespace tessera
