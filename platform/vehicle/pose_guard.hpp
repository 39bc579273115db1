// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Decides whether a pose is usable for mapping, from any source. A wrong pose damages a map
// permanently, so a doubt pauses mapping, and only several good poses in a row resume it.
// docs/reference/can.md has the checks, with their detection times.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "tessera/registration/pose_track.hpp"
#include "vehicle/bus_values.hpp"

namespace tessera {

struct PoseObservation {
  StampedPose pose{};            ///< Time of measurement, by the clock of received_us.
  std::int64_t received_us = 0;  ///< Time of arrival.
  double std_position_m = 0.0;   ///< The largest of all axes.
  double std_heading_rad = 0.0;
};

struct PoseGuardConfig {
  std::int64_t timeout_us = 200'000;  ///< Stale after a longer time without a pose.
  std::int64_t max_age_us = 200'000;  ///< Stale if it is older on arrival.
  std::int64_t max_ahead_us = 5'000;  ///< Corrupt if measured this long after its arrival.
  double max_speed_mps = 15.0;        ///< Of the vehicle, also downhill.
  double max_yaw_rate_radps = 1.5;
  /// Largest change of velocity, also between poses: braking, turning, bumps. A pose that is
  /// farther from where the poses before it lead, at their velocity, jumps.
  double max_acceleration_mps2 = 10.0;
  std::int64_t velocity_us = 80'000;  ///< Least time between the poses of a velocity.
  double sigmas = 3.0;                ///< Largest error of a pose in standard deviations.
  double slack_m = 0.10;              ///< Never a jump, for any time and deviations.
  double slack_rad = 0.03;
  double max_std_position_m = 0.30;
  double max_std_heading_rad = 0.05;
  double max_coordinate_m = 100'000.0;
  double wheels_factor = 1.2;  ///< Way and turn are at most this factor times the reported ones.
  std::int64_t max_blind_us = 1'000'000;  ///< Without reports: as far as it can move in this time.
  std::int64_t frozen_us = 300'000;       ///< Least duration of a window for frozen poses, in which
  double frozen_travel_m = 0.5;           ///< the vehicle moves at least this far, or
  double frozen_turn_rad = 0.3;           ///< turns this far.
  double frozen_share = 0.2;         ///< Frozen if the pose moves or turns by less than this share.
  double min_yaw_rate_radps = 0.05;  ///< Less may be the bias of a gyroscope.
  double moving_speed_mps = 0.2;     ///< Least speed of "moving" if no speed is known.
  std::int64_t motion_timeout_us = 300'000;  ///< Validity of a motion report.
  int recover_after = 5;                     ///< Good poses in a row before poses are used again.
  int relocate_after = 10;  ///< Poses that must agree after a jump before it is accepted.
};

/// A motion report of the vehicle.
struct VehicleMotion {
  std::int64_t received_us = 0;
  MotionState state = MotionState::kUnknown;
  std::optional<double> speed_mps{};       ///< By its wheels, negative backwards.
  std::optional<double> yaw_rate_radps{};  ///< Positive to the left.
};

class PoseGuard {
 public:
  explicit PoseGuard(const PoseGuardConfig& config = {}) noexcept : config_(config) {}

  /// Judges a pose. Only kGood ones may be used; each is counted under the returned verdict.
  /// A clock that steps back makes poses kOutOfOrder until it has caught up; call forget() then.
  /// O(1), no heap.
  PoseVerdict judge(const PoseObservation& observation) noexcept;
  /// Takes a motion report; the newest counts.
  void moves(const VehicleMotion& motion) noexcept;
  /// The current verdict, also while no poses come: kGood iff the last pose was good and is recent.
  PoseVerdict state(std::int64_t now_us) noexcept;
  /// Forgets all poses; counters stay.
  void forget() noexcept;

  /// Number of poses with this verdict.
  [[nodiscard]] std::uint64_t count(PoseVerdict verdict) const noexcept {
    return counts_[static_cast<std::size_t>(verdict)];
  }
  /// Times that no pose came for longer than timeout_us.
  [[nodiscard]] std::uint64_t timeouts() const noexcept { return timeouts_; }
  /// Jumps that were accepted: poses are in another frame now, so a map that continues needs a new
  /// submap.
  [[nodiscard]] std::uint64_t relocations() const noexcept { return relocations_; }
  [[nodiscard]] const PoseGuardConfig& config() const noexcept { return config_; }

 private:
  /// Distance and turn of a motion.
  struct Reach {
    double way_m = 0.0;
    double turn_rad = 0.0;
  };
  /// Reported motion since the start, without signs, and the time without reports.
  struct Said {
    Reach sum{};
    std::int64_t blind_us = 0;
    std::int64_t until_us = 0;
  };
  /// A pose with which later ones are compared, and its predecessors.
  struct Reference {
    StampedPose pose{};
    double std_position_m = 0.0;
    double std_heading_rad = 0.0;
    Said said{};              ///< Until its arrival.
    StampedPose base{};       ///< The velocity is from here to pose.
    StampedPose next_base{};  ///< The base once it is velocity_us old.
  };
  /// Predicted pose of a reference at its velocity.
  struct Course {
    Point3d velocity_mps = Point3d::Zero();
    double baseline_s = 0.0;  ///< Time over which it was measured; 0: not known.
  };
  /// Motion reported by the vehicle since a pose.
  struct Window {
    StampedPose start{};
    Reach said{};  ///< Backwards and to the right are negative.
    bool open = false;
  };

  [[nodiscard]] PoseVerdict inspect(const PoseObservation& observation) noexcept;
  [[nodiscard]] Reach said_since(const Reference& from) const noexcept;
  [[nodiscard]] double strain(const Reference& from, const PoseObservation& to) const noexcept;
  [[nodiscard]] Course course_of(const Reference& from) const noexcept;
  [[nodiscard]] double course_strain(const Reference& from,
                                     const PoseObservation& to) const noexcept;
  [[nodiscard]] bool is_nearer_here(const PoseObservation& to, double here,
                                    double there) const noexcept;
  [[nodiscard]] Reference begin(const PoseObservation& at) const noexcept;
  [[nodiscard]] Reference follow(const Reference& before, const PoseObservation& to) const noexcept;
  [[nodiscard]] bool stops_dead(const PoseObservation& to) const noexcept;
  [[nodiscard]] double lag_strain(const PoseObservation& to) const noexcept;
  [[nodiscard]] double share(const Reference& from, const PoseObservation& to,
                             const Reach& reach) const noexcept;
  [[nodiscard]] bool jumps(const PoseObservation& observation) noexcept;
  [[nodiscard]] bool is_relocated(const PoseObservation& observation, bool agrees) noexcept;
  [[nodiscard]] bool is_frozen(const StampedPose& pose, const Reach& said) noexcept;
  [[nodiscard]] bool is_held(const StampedPose& pose, const Reach& said) const noexcept;
  [[nodiscard]] Reach said_since_reference(const PoseObservation& observation) const noexcept;
  [[nodiscard]] bool is_recent(std::int64_t now_us) const noexcept;
  void add_up(std::int64_t now_us) noexcept;
  void fail(PoseVerdict verdict) noexcept;

  PoseGuardConfig config_;
  VehicleMotion motion_{};
  Said said_{};
  PoseVerdict state_ = PoseVerdict::kNone;
  int good_in_row_ = 0;
  bool has_pose_ = false;
  bool silent_ = false;  ///< No pose for longer than the timeout, already counted.
  bool has_reference_ = false;
  std::int64_t last_stamp_us_ = 0;
  std::int64_t last_received_us_ = 0;
  Reference reference_{};  ///< The last plausible pose.
  Reference moved_{};      ///< The last pose that moved with the vehicle.
  Reference candidate_{};  ///< The last pose beyond a jump.
  int candidate_in_row_ = 0;
  Window window_{};
  bool frozen_ = false;
  bool was_good_ = false;  ///< A pose was used before.
  std::array<std::uint64_t, kPoseVerdicts> counts_{};
  std::uint64_t timeouts_ = 0;
  std::uint64_t relocations_ = 0;
};

/// Angle between two poses, radians, 0 to pi.
[[nodiscard]] double turn_between(const Matrix34d& a, const Matrix34d& b) noexcept;

}  // namespace tessera
