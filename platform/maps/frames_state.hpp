// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames that a team finds, for other threads and for reports.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/json.hpp"
#include "tessera/robot/shared_frames.hpp"

namespace tessera {

/// Bytes that may be copied.
struct FramesState {
  static constexpr std::size_t kMostRobots = TeamFrames::kMostRobots;
  static constexpr std::size_t kMostLinks = 64;
  /// A PlacedRobot.
  struct Robot {
    std::uint32_t robot = 0;
    std::uint32_t group = 0;
    std::uint32_t anchor = 0;
    FrameAnchor anchored_by = FrameAnchor::kLowestRobot;
    FrameState state = FrameState::kAlone;
    bool suspected = false;
    bool in_use = false;
    bool arrived = false;
    std::uint64_t joined_by = 0;
    std::array<double, 12> T_team_world{};  ///< In use, row by row.
    double sigma_m = 0.0;                   ///< FrameCovariance.
    double sigma_rad = 0.0;
  };
  /// A link that was judged.
  struct Link {
    std::uint32_t from = 0;
    std::uint32_t to = 0;
    LinkVerdict verdict = LinkVerdict::kReplaced;
    bool confirmed = false;
    bool compared = false;
    double sigmas = 0.0;
  };
  /// What this robot has found of another one.
  struct Pair {
    std::uint32_t robot = 0;
    std::uint32_t attempts = 0;
    FrameVerdict verdict = FrameVerdict::kTooLittle;
    bool stated = false;
    double support = 0.0;
    double support_second = 0.0;
    Agreement agreement{};
    Agreement agreement_second{};
    double sigma_m = 0.0;
    double sigma_rad = 0.0;
  };
  FrameMode mode = FrameMode::kGiven;
  bool joined = false;  ///< SharedFrames::is_joined().
  /// Where frames are given: how many other robots find theirs, and leave this one out.
  std::uint32_t left_out_by = 0;
  FramesReport report{};
  std::uint32_t robot_count = 0;
  std::uint32_t link_count = 0;  ///< As many as fit.
  std::uint32_t pair_count = 0;
  std::array<Robot, kMostRobots> robots{};
  std::array<Link, kMostLinks> links{};
  std::array<Pair, kMostRobots> pairs{};

  void take(const SharedFrames& frames) noexcept;
  /// Where frames are given: what others state of theirs is of no account. O(contributions).
  void take_given(const Replicas& replicas, std::uint32_t own_robot) noexcept;
};

/// The frame in use of a robot; nothing: there is none.
[[nodiscard]] std::optional<Matrix34d> T_team_world(const FramesState& state,
                                                    std::uint32_t robot) noexcept;
[[nodiscard]] const char* to_string(FrameState state) noexcept;
[[nodiscard]] const char* to_string(FrameAnchor anchor) noexcept;
[[nodiscard]] const char* to_string(LinkVerdict verdict) noexcept;
/// Keys mode, robots, links, pairs and counters; in degrees and metres.
[[nodiscard]] Json to_json(const FramesState& state);

}  // namespace tessera
