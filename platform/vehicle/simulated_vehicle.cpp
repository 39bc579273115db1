// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/simulated_vehicle.hpp"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// Speed above which the vehicle moves.
constexpr double kMovingSpeed_mps = 0.05;
constexpr double kMovingYawRate_radps = 0.01;

}  // namespace

WheelMotion SimulatedVehicle::since_before(const StampedPose& now) const noexcept {
  WheelMotion odometry;
  odometry.valid = has_before_ && now.stamp_us > before_.stamp_us;
  if (!odometry.valid) return odometry;
  const double seconds = 1e-6 * static_cast<double>(now.stamp_us - before_.stamp_us);
  const Matrix34d& from = before_.T_map_body;
  const Matrix34d& to = now.T_map_body;
  double ahead_m = 0.0;
  double left = 0.0;
  double along = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    // In the body's earlier axes: distance ahead, and direction of the new x axis.
    ahead_m += from(axis, 0) * (to(axis, 3) - from(axis, 3));
    left += from(axis, 1) * to(axis, 0);
    along += from(axis, 0) * to(axis, 0);
  }
  odometry.speed_mps = ahead_m / seconds;
  odometry.yaw_rate_radps = std::atan2(left, along) / seconds;
  return odometry;
}

std::span<const CanFrame> SimulatedVehicle::cycle(const PoseTrack& track, std::int64_t at_us,
                                                  std::int64_t age_us) noexcept {
  std::size_t count = 0;
  WheelMotion odometry{.valid = false};
  const Result<Matrix34d> T_map_body = track.at(at_us, config_.max_gap_us);
  if (T_map_body.ok()) {
    SentPose pose = to_sent_pose(*T_map_body);
    pose.std_position_m = config_.std_position_m;
    pose.std_heading_rad = config_.std_heading_rad;
    pose.age_ms = 1e-3 * static_cast<double>(age_us);
    for (const CanFrame& frame : frames_.pose(pose)) out_[count++] = frame;
    ++poses_;
    const StampedPose now{at_us, *T_map_body};
    odometry = since_before(now);
    before_ = now;
  }
  has_before_ = T_map_body.ok();
  out_[count++] = frames_.odometry(odometry);
  if (cycles_ == 0) {
    const bool moves = std::abs(odometry.speed_mps) > kMovingSpeed_mps ||
                       std::abs(odometry.yaw_rate_radps) > kMovingYawRate_radps;
    out_[count++] = frames_.state(!odometry.valid ? MotionState::kUnknown
                                  : moves         ? MotionState::kMoving
                                                  : MotionState::kStanding);
    out_[count++] = frames_.command(VehicleCommand::kNone, 0);
  }
  cycles_ = (cycles_ + 1) % kSlowCycles;
  return {out_.data(), count};
}

}  // namespace tessera
