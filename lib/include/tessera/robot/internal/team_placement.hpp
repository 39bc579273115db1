// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places the robots of a team where their links have them, in small steps. Of the global map's
// thread.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/instant.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/frames/frame_follower.hpp"
#include "tessera/frames/frame_statements.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/robot/frames_config.hpp"

namespace tessera {

/// A robot of the team, and the frame in use.
struct PlacedRobot {
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;  ///< Of the contributions that count.
  RobotFrame frame{};       ///< As the links have it.
  FrameFollower follower{};
};

class TeamPlacement {
 public:
  /// Between two solutions.
  static constexpr Duration kPause{1'000'000};

  [[nodiscard]] static std::size_t required_bytes(const FramesConfig& config) noexcept;
  /// Fails as TeamFrames::make.
  [[nodiscard]] static Result<TeamPlacement> make(Arena& arena,
                                                  const FramesConfig& config) noexcept;
  TeamPlacement() noexcept = default;

  /// p_world: where this robot is in its world. Cost: O(contributions), with a solution as
  /// TeamFrames::solve, and GlobalMap::place of each robot that moves.
  void tick(const Exchange& exchange, GlobalMap& global, const Point3d& p_world,
            Instant now) noexcept;

  /// T_team_world of this robot, and of another one; null: it is not placed. O(robots).
  [[nodiscard]] const Matrix34d& own() const noexcept { return T_team_own_; }
  [[nodiscard]] const Matrix34d* placed(std::uint32_t robot) const noexcept;
  [[nodiscard]] std::span<const PlacedRobot> robots() const noexcept {
    return robots_.first(count_);
  }
  [[nodiscard]] std::span<const FrameLink> links() const noexcept {
    return links_.first(link_count_);
  }
  [[nodiscard]] std::span<const FrameLinkReport> verdicts() const noexcept {
    return verdicts_.first(link_count_);
  }
  [[nodiscard]] const FramesReport& report() const noexcept { return report_; }
  [[nodiscard]] bool busy() const noexcept;
  /// How well a robot knows its own frame; kUnknown too where it has said nothing. O(robots).
  [[nodiscard]] PriorKind prior_kind(std::uint32_t robot) const noexcept;
  /// It is placed, and by more than one robot's word. O(robots).
  [[nodiscard]] bool is_sure(std::uint32_t robot) const noexcept;

 private:
  [[nodiscard]] const PlacedRobot* find(std::uint32_t robot) const noexcept;
  /// False: nothing has changed since the last solution.
  bool collect(const Exchange& exchange, const GlobalMap& global) noexcept;
  void solve(std::uint32_t own, GlobalMap& global) noexcept;
  void take(const TeamSolution& solution, std::uint32_t own, GlobalMap& global) noexcept;
  /// Whether it is a member with the same epoch.
  [[nodiscard]] bool stays(const PlacedRobot& one) const noexcept;
  void follow(PlacedRobot& one, bool is_joined, GlobalMap& global) noexcept;
  void withdraw(PlacedRobot& one, GlobalMap& global) noexcept;
  void place(const PlacedRobot& one, GlobalMap& global) noexcept;
  /// This robot is no member: its own map is all that there is.
  void keep_alone(std::uint32_t own, GlobalMap& global) noexcept;
  /// What a robot publishes in a later epoch is of another world, which is not placed yet.
  void leave_out_new_epochs(GlobalMap& global) noexcept;
  [[nodiscard]] std::uint32_t epoch_of(std::uint32_t robot) const noexcept;
  void note_own(std::uint32_t own) noexcept;
  void move(const Exchange& exchange, GlobalMap& global, const Point3d& p_world,
            Instant now) noexcept;

  TeamFrames team_;
  std::span<PlacedRobot> robots_;  ///< By ascending number.
  std::span<PlacedRobot> next_;    ///< Scratch: those of a new solution.
  std::span<FrameMember> members_;
  std::span<FrameLink> links_;
  std::span<FrameLinkReport> verdicts_;
  std::span<FramePrior> priors_;
  std::span<StatedPrior> stated_;
  std::size_t count_ = 0;
  std::size_t member_count_ = 0;
  std::size_t link_count_ = 0;
  std::size_t prior_count_ = 0;
  std::size_t stated_count_ = 0;
  std::uint64_t seen_ = 0;  ///< Replicas::frame_changes(), as of the last solution.
  Instant due_ = Instant::long_ago();
  Matrix34d T_team_own_ = Matrix34d(Matrix34d::Identity());
  std::uint32_t own_ = 0;
  /// Who holds the frame of this robot's group.
  std::uint32_t anchor_ = 0;
  std::uint32_t anchor_epoch_ = 0;
  FrameAnchor anchored_by_ = FrameAnchor::kLowestRobot;
  FramesReport report_{};
};

}  // namespace tessera
