// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Decides whether a pose may be mapped with, whatever it came over. A map that a wrong pose was
// mixed into is smeared for good, so a doubt pauses mapping, and only several good poses in a row
// let it go on. What is checked, with the time until it is noticed, is in docs/can.md.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "tessera/registration/pose_track.hpp"
#include "vehicle/bus_values.hpp"

namespace tessera {

struct PoseObservation {
  StampedPose pose{};            ///< When it was measured, by the clock of received_us.
  std::int64_t received_us = 0;  ///< When it came.
  double std_position_m = 0.0;   ///< The largest of its axes.
  double std_heading_rad = 0.0;
};

struct PoseGuardConfig {
  std::int64_t timeout_us = 200'000;  ///< Stale without a pose for longer.
  std::int64_t max_age_us = 200'000;  ///< Stale if it is older when it comes.
  std::int64_t max_ahead_us = 5'000;  ///< Corrupt if it is measured so long after it came.
  double max_speed_mps = 15.0;        ///< Of the vehicle, downhill too.
  double max_yaw_rate_radps = 1.5;
  /// By which velocity changes at most, between poses too: braking, turning, bumps. A pose that is
  /// farther from where the poses before it lead, at their velocity, jumps.
  double max_acceleration_mps2 = 10.0;
  std::int64_t velocity_us = 80'000;  ///< Velocity is between poses that are so far apart at least.
  double sigmas = 3.0;                ///< Standard deviations that a pose may be off.
  double slack_m = 0.10;              ///< What is no jump, whatever the time and the deviations.
  double slack_rad = 0.03;
  double max_std_position_m = 0.30;
  double max_std_heading_rad = 0.05;
  double max_coordinate_m = 100'000.0;
  double wheels_factor = 1.2;  ///< Way and turn are at most so many times what the vehicle said.
  std::int64_t max_blind_us = 1'000'000;  ///< Where it said nothing: as far as it gets in this.
  std::int64_t frozen_us = 300'000;       ///< A window for frozen poses takes so long at least, and
  double frozen_travel_m = 0.5;           ///< the vehicle goes so far in it, or
  double frozen_turn_rad = 0.3;           ///< turns so far.
  double frozen_share = 0.2;  ///< Frozen if the pose goes or turns by less than this share of it.
  double min_yaw_rate_radps = 0.05;  ///< Less is no turn, but may be a gyroscope's bias.
  double moving_speed_mps = 0.2;     ///< What "moving" says at least where no speed is known.
  std::int64_t motion_timeout_us = 300'000;  ///< What the vehicle says of its motion lasts so long.
  int recover_after = 5;                     ///< Good poses in a row before poses are used again.
  int relocate_after = 10;  ///< Poses that agree with each other after a jump: it is believed.
};

/// What the vehicle itself says of its motion.
struct VehicleMotion {
  std::int64_t received_us = 0;
  MotionState state = MotionState::kUnknown;
  std::optional<double> speed_mps{};       ///< By its wheels, negative backwards.
  std::optional<double> yaw_rate_radps{};  ///< Positive to the left.
};

class PoseGuard {
 public:
  explicit PoseGuard(const PoseGuardConfig& config = {}) noexcept : config_(config) {}

  /// Judges a pose. Only one that is kGood may be used; each is counted under what this returns.
  /// A clock that steps back makes poses kOutOfOrder until it has caught up; call forget() then.
  /// O(1), no heap.
  PoseVerdict judge(const PoseObservation& observation) noexcept;
  /// What the vehicle says; the newest counts.
  void moves(const VehicleMotion& motion) noexcept;
  /// What holds now, also while nothing comes: kGood iff the last pose was and is recent.
  PoseVerdict state(std::int64_t now_us) noexcept;
  /// As if there had been no pose; counters stay.
  void forget() noexcept;

  /// Poses judged so, ever.
  [[nodiscard]] std::uint64_t count(PoseVerdict verdict) const noexcept {
    return counts_[static_cast<std::size_t>(verdict)];
  }
  /// Times that poses fell silent for longer than timeout_us.
  [[nodiscard]] std::uint64_t timeouts() const noexcept { return timeouts_; }
  /// Jumps that were believed in the end: the frame of the poses is another now, so a map that goes
  /// on needs a new submap.
  [[nodiscard]] std::uint64_t relocations() const noexcept { return relocations_; }
  [[nodiscard]] const PoseGuardConfig& config() const noexcept { return config_; }

 private:
  /// How far it goes, and how far it turns.
  struct Reach {
    double way_m = 0.0;
    double turn_rad = 0.0;
  };
  /// What the vehicle said since the start, without signs, and the time that it said nothing of.
  struct Said {
    Reach sum{};
    std::int64_t blind_us = 0;
    std::int64_t until_us = 0;
  };
  /// A pose that later ones are compared with, and where those before it came from.
  struct Reference {
    StampedPose pose{};
    double std_position_m = 0.0;
    double std_heading_rad = 0.0;
    Said said{};              ///< Until it came.
    StampedPose base{};       ///< The velocity is from here to pose.
    StampedPose next_base{};  ///< The base once it is velocity_us old.
  };
  /// Where a reference leads at its velocity.
  struct Course {
    Point3d velocity_mps = Point3d::Zero();
    double baseline_s = 0.0;  ///< That it was measured over; 0: it is not known.
  };
  /// How far the vehicle says that it went, and from which pose on.
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
  bool silent_ = false;  ///< No pose for longer than the timeout, which was counted.
  bool has_reference_ = false;
  std::int64_t last_stamp_us_ = 0;
  std::int64_t last_received_us_ = 0;
  Reference reference_{};  ///< The last one that was plausible.
  Reference moved_{};      ///< The last one of those that moved when the vehicle did.
  Reference candidate_{};  ///< The last one beyond a jump.
  int candidate_in_row_ = 0;
  Window window_{};
  bool frozen_ = false;
  bool was_good_ = false;  ///< A pose was used, ever.
  std::array<std::uint64_t, kPoseVerdicts> counts_{};
  std::uint64_t timeouts_ = 0;
  std::uint64_t relocations_ = 0;
};

/// How far apart two poses are turned, radians, 0 to pi.
[[nodiscard]] double turn_between(const Matrix34d& a, const Matrix34d& b) noexcept;

}  // namespace tessera
