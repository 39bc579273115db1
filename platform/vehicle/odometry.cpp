// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/odometry.hpp"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

bool is_finite(const OdometryMeasurement& m) noexcept {
  return std::isfinite(m.speed_mps) && std::isfinite(m.yaw_rate_radps) &&
         std::isfinite(m.std_speed_mps) && std::isfinite(m.std_yaw_rate_radps) &&
         m.std_speed_mps >= 0.0 && m.std_yaw_rate_radps >= 0.0;
}

}  // namespace

Matrix34d after_arc(const Matrix34d& T_map_body, double speed_mps, double yaw_rate_radps,
                    double seconds) noexcept {
  const double turn = yaw_rate_radps * seconds;
  // The chord starts at half the turn; its length is the arc's times sin(turn / 2) / (turn / 2).
  const double half = turn / 2.0;
  const double shorter = std::abs(half) < 1e-4 ? 1.0 - half * half / 6.0 : std::sin(half) / half;
  const double chord_m = speed_mps * seconds * shorter;
  const Point3d along(std::cos(half) * chord_m, std::sin(half) * chord_m, 0.0);
  Matrix34d result = T_map_body;
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  for (int row = 0; row < 3; ++row) {
    const double x = T_map_body(row, 0);
    const double y = T_map_body(row, 1);
    result(row, 0) = x * c + y * s;
    result(row, 1) = y * c - x * s;
    result(row, 3) = T_map_body(row, 3) + x * along.x() + y * along.y();
  }
  return result;
}

void Odometry::advance(const OdometryMeasurement& from, const OdometryMeasurement& to) noexcept {
  const double seconds = static_cast<double>(to.stamp_us - now_.pose.stamp_us) * 1e-6;
  const double speed = (from.speed_mps + to.speed_mps) / 2.0;
  const double yaw_rate = (from.yaw_rate_radps + to.yaw_rate_radps) / 2.0;
  now_.pose.T_map_body = after_arc(now_.pose.T_map_body, speed, yaw_rate, seconds);
  now_.pose.stamp_us = to.stamp_us;
  now_.received_us = to.stamp_us;
  now_.std_heading_rad += std::max(from.std_yaw_rate_radps, to.std_yaw_rate_radps) * seconds;
  now_.std_position_m += std::max(from.std_speed_mps, to.std_speed_mps) * seconds +
                         std::abs(speed) * seconds * now_.std_heading_rad;
}

bool Odometry::measure(const OdometryMeasurement& measurement) noexcept {
  if (!is_finite(measurement)) return false;
  bool gapless = true;
  if (count_ > 0) {
    const OdometryMeasurement& last = kept(count_ - 1);
    if (measurement.stamp_us <= last.stamp_us) return false;
    if (measurement.stamp_us - last.stamp_us > kMaxGapUs) {
      known_ = gapless = false;
      count_ = 0;
    } else if (known_ && measurement.stamp_us > now_.pose.stamp_us) {
      advance(last, measurement);
    }
  }
  if (count_ == kKept)
    first_ = (first_ + 1) % kKept;
  else
    ++count_;
  kept_[(first_ + count_ - 1) % kKept] = measurement;
  return gapless;
}

bool Odometry::anchor(const StampedPose& pose, double std_position_m,
                      double std_heading_rad) noexcept {
  if (count_ == 0 || pose.stamp_us < kept(0).stamp_us ||
      pose.stamp_us > kept(count_ - 1).stamp_us + kMaxGapUs)
    return false;
  now_ = {pose, pose.stamp_us, std_position_m, std_heading_rad};
  anchored_us_ = pose.stamp_us;
  known_ = true;
  for (std::size_t i = 1; i < count_; ++i)
    if (kept(i).stamp_us > now_.pose.stamp_us) advance(kept(i - 1), kept(i));
  return true;
}

}  // namespace tessera
