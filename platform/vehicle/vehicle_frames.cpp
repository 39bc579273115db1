// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/vehicle_frames.hpp"

#include <algorithm>
#include <cmath>

#include "tessera/base/assert.hpp"

namespace tessera {

using namespace bus;

CanFrame VehicleFrames::sealed(std::uint32_t place, CanFrame frame) noexcept {
  const BusMessage* const message = bus_message(place);
  TESSERA_ASSERT(message != nullptr);
  frame.id = base_id_ + place;
  frame.size = message->size;
  frame.is_fd = message->is_fd;
  e2e_protect(message->e2e, e2e_data_id(frame.id), counters_[place],
              std::span(frame.data).first(frame.size));
  counters_[place] = e2e_next(message->e2e, counters_[place]);
  return frame;
}

CanFrame VehicleFrames::frame(std::uint32_t place,
                              std::initializer_list<SignalValue> values) noexcept {
  CanFrame frame;
  for (const auto& [signal, value] : values) put_value(frame.data, signal, value);
  return sealed(place, frame);
}

std::array<CanFrame, 3> VehicleFrames::pose(const SentPose& pose) noexcept {
  const double counter = pose_counter_;
  pose_counter_ = (pose_counter_ + 1) % 16;
  CanFrame zh;
  for (const auto& [signal, value] :
       {SignalValue{kPoseCounter, counter}, SignalValue{kZ, pose.p_map.z()},
        SignalValue{kHeading, pose.heading_rad}, SignalValue{kAge, pose.age_ms}})
    put_value(zh.data, signal, value);
  if (pose.age_ms >= kAge.most + 0.5) put_raw(zh.data, kAge, kNoPoseAge);
  return {frame(kIdPoseXy, {{kPoseCounter, counter}, {kX, pose.p_map.x()}, {kY, pose.p_map.y()}}),
          sealed(kIdPoseZh, zh),
          frame(kIdPoseRp, {{kPoseCounter, counter},
                            {kRoll, pose.roll_rad},
                            {kPitch, pose.pitch_rad},
                            {kStdPosition, pose.std_position_m},
                            {kStdHeading, pose.std_heading_rad}})};
}

CanFrame VehicleFrames::fd_pose(const SentPose& pose, bool valid) noexcept {
  return frame(kIdPoseFd, {{kFdPoseState, valid ? 1.0 : 0.0},
                           {kFdX, pose.p_map.x()},
                           {kFdY, pose.p_map.y()},
                           {kFdZ, pose.p_map.z()},
                           {kFdRoll, pose.roll_rad},
                           {kFdPitch, pose.pitch_rad},
                           {kFdHeading, pose.heading_rad},
                           {kFdStdX, pose.std_position_m},
                           {kFdStdHeading, pose.std_heading_rad},
                           {kFdAge, pose.age_ms}});
}

CanFrame VehicleFrames::odometry(const WheelMotion& odometry) noexcept {
  return frame(kIdOdometry, {{kOdometryValid, odometry.valid ? 1.0 : 0.0},
                             {kWheelSpeed, odometry.speed_mps},
                             {kYawRate, odometry.yaw_rate_radps},
                             {kStdWheelSpeed, odometry.std_speed_mps},
                             {kStdYawRate, odometry.std_yaw_rate_radps}});
}

CanFrame VehicleFrames::state(MotionState state) noexcept {
  CanFrame frame;
  put_raw(frame.data, kMotionState, static_cast<std::uint32_t>(state));
  return sealed(kIdVehicleState, frame);
}

CanFrame VehicleFrames::command(VehicleCommand command, std::uint8_t number) noexcept {
  CanFrame frame;
  put_raw(frame.data, kCommand, static_cast<std::uint32_t>(command));
  put_raw(frame.data, kCommandNumber, number);
  return sealed(kIdCommand, frame);
}

SentPose to_sent_pose(const Matrix34d& T_map_body) noexcept {
  const Matrix34d& T = T_map_body;
  SentPose pose;
  pose.p_map = T.col(3);
  pose.pitch_rad = std::asin(std::clamp(-T(2, 0), -1.0, 1.0));
  constexpr double kUpright = 1e-9;
  if (std::hypot(T(0, 0), T(1, 0)) > kUpright) {
    pose.heading_rad = std::atan2(T(1, 0), T(0, 0));
    pose.roll_rad = std::atan2(T(2, 1), T(2, 2));
  } else {
    pose.heading_rad = std::atan2(-T(0, 1), T(1, 1));
  }
  return pose;
}

}  // namespace tessera
