// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Dead reckoning: from a known pose by wheel speed and yaw rate, with an uncertainty that only
// grows until the next known pose. The vehicle moves in its own x-y plane, forward along x; roll,
// pitch and the slope of the road are not measured, so they stay constant.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "vehicle/pose_guard.hpp"

namespace tessera {

struct OdometryMeasurement {
  std::int64_t stamp_us = 0;
  double speed_mps = 0.0;       ///< Negative backwards.
  double yaw_rate_radps = 0.0;  ///< Positive to the left.
  double std_speed_mps = 0.0;
  double std_yaw_rate_radps = 0.0;
};

class Odometry {
 public:
  /// Measurements that are kept, so that a late pose is moved on to now: 0.64 s at 100 Hz.
  static constexpr std::size_t kKept = 64;
  /// Largest gap between two measurements; with more, nothing is known until the next anchor.
  static constexpr std::int64_t kMaxGapUs = 150'000;

  /// Sets a known pose, and applies the measurements after its stamp to it. Does nothing and
  /// returns false iff measurements do not reach back to its stamp or stop before it by more than
  /// kMaxGapUs. O(kKept).
  bool anchor(const StampedPose& pose, double std_position_m, double std_heading_rad) noexcept;
  /// Moves on to the measurement's stamp, by the mean of it and the one before, which is exact for
  /// an arc at constant speed. False, and the pose becomes unknown, iff the stamp is later than the
  /// last by more than kMaxGapUs; false, and nothing is changed, iff it is not later or a number is
  /// not finite. O(1).
  bool measure(const OdometryMeasurement& measurement) noexcept;

  /// True if there is a pose.
  [[nodiscard]] bool is_known() const noexcept { return known_; }
  /// Pose at the last measurement (or the last anchor, if that is later). Standard deviations are
  /// upper bounds: errors are added as if all of them had the same sign.
  [[nodiscard]] const PoseObservation& now() const noexcept { return now_; }
  /// Time since the anchor, microseconds.
  [[nodiscard]] std::int64_t reckoned_us() const noexcept {
    return now_.pose.stamp_us - anchored_us_;
  }
  void forget() noexcept { known_ = false; }

 private:
  [[nodiscard]] const OdometryMeasurement& kept(std::size_t i) const noexcept {
    return kept_[(first_ + i) % kKept];
  }
  void advance(const OdometryMeasurement& from, const OdometryMeasurement& to) noexcept;

  std::array<OdometryMeasurement, kKept> kept_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  PoseObservation now_{};
  std::int64_t anchored_us_ = 0;
  bool known_ = false;
};

/// T_map_body after seconds at constant speed. Exact for an arc and for a straight line, and
/// continuous between the two.
[[nodiscard]] Matrix34d after_arc(const Matrix34d& T_map_body, double speed_mps,
                                  double yaw_rate_radps, double seconds) noexcept;

}  // namespace tessera
