// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The frame that a robot uses, which follows the one that the team's links give in steps so small
// that nobody who plans in it is thrown off.
#pragma once

#include "tessera/base/instant.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

/// Follows a target frame. After follow() the steps end at the target, equal to the bit.
class FrameFollower {
 public:
  /// By how much a step moves the robot's own position, at most.
  static constexpr double kMostStep_m = 0.1;
  /// By how much a step turns the frame, at most: 0.3 degrees.
  static constexpr double kMostStep_rad = 0.0052359877559829887;
  static constexpr Duration kLeastPause{100'000};

  /// Has no frame.
  FrameFollower() noexcept = default;

  /// The frame that the team's links give: step() moves towards it. Used at once where there was
  /// no frame in use before. Fails with kInvalidArgument iff the transform is not rigid
  /// (check_rigid); nothing is changed. O(1).
  [[nodiscard]] Status follow(const Matrix34d& T_team_map) noexcept;
  /// A frame that a user gives, or a correction of the robot's own pose graph: it is in use when
  /// this returns, and there is nothing left to follow. Fails as follow(). O(1).
  [[nodiscard]] Status use_at_once(const Matrix34d& T_team_map) noexcept;
  /// Stops the use of the frame: in_use() is false from here on, until the next frame comes. O(1).
  void withdraw() noexcept { in_use_ = false; }

  /// Makes one step, if the last one was kLeastPause ago or more; it may be called more often, also
  /// with a time before the last one, which makes none. p_map: where the robot is in its own map,
  /// metres, finite. It is moved by at most kMostStep_m in the frame in use, and the frame is
  /// turned by at most kMostStep_rad, to rounding (1e-9 m where the map's origin is within 1 km).
  /// True iff the frame was changed. O(1).
  ///
  /// The step is a share of the way. By that share, the rotation is turned at an even rate about
  /// one axis, and the robot's position is moved on a straight line. The whole angle a, up to half
  /// a turn, is at most (1 + c^2 / 7) c, where c = 2 sin(a / 2) is the chord of the rotation: a
  /// share of kMostStep_rad over that bound is small enough without an arc sine. The bound is at
  /// most 1.19 a, so a step that the angle limits turns by 0.84 of what is allowed, or more.
  [[nodiscard]] bool step(const Point3d& p_map, Instant now) noexcept;

  [[nodiscard]] bool in_use() const noexcept { return in_use_; }
  /// The frame in use; the last one that was if none is.
  [[nodiscard]] const Matrix34d& frame() const noexcept { return T_team_map_; }
  /// True iff a frame is in use and equal to the target to the bit.
  [[nodiscard]] bool arrived() const noexcept { return in_use_ && arrived_; }

 private:
  Matrix34d T_team_map_ = Matrix34d::Identity();
  Matrix34d target_ = Matrix34d::Identity();
  Instant last_step_ = Instant::long_ago();
  bool in_use_ = false;
  bool arrived_ = false;
};

}  // namespace tessera
