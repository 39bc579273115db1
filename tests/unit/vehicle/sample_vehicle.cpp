// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "sample_vehicle.hpp"

namespace tessera {

using namespace bus;

CanFrame SampleVehicle::sealed(std::uint32_t place, CanFrame frame) {
  const BusMessage& message = *bus_message(place);
  frame.id = base_id_ + place;
  frame.size = message.size;
  frame.is_fd = message.is_fd;
  e2e_protect(message.e2e, e2e_data_id(frame.id), counters_[place],
              std::span(frame.data).first(frame.size));
  counters_[place] = e2e_next(message.e2e, counters_[place]);
  return frame;
}

CanFrame SampleVehicle::raw(std::uint32_t place,
                            const std::vector<std::pair<Signal, double>>& values) {
  CanFrame frame;
  for (const auto& [signal, value] : values) put_value(frame.data, signal, value);
  return sealed(place, frame);
}

std::vector<CanFrame> SampleVehicle::pose(const SentPose& pose) {
  const double counter = pose_counter_;
  pose_counter_ = (pose_counter_ + 1) % 16;
  return {raw(kIdPoseXy, {{kPoseCounter, counter}, {kX, pose.p_map.x()}, {kY, pose.p_map.y()}}),
          raw(kIdPoseZh, {{kPoseCounter, counter},
                          {kZ, pose.p_map.z()},
                          {kHeading, pose.heading_rad},
                          {kAge, pose.age_ms}}),
          raw(kIdPoseRp, {{kPoseCounter, counter},
                          {kRoll, pose.roll_rad},
                          {kPitch, pose.pitch_rad},
                          {kStdPosition, pose.std_position_m},
                          {kStdHeading, pose.std_heading_rad}})};
}

CanFrame SampleVehicle::fd_pose(const SentPose& pose, bool valid) {
  return raw(kIdPoseFd, {{kFdPoseState, valid ? 1.0 : 0.0},
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

CanFrame SampleVehicle::odometry(double speed_mps, double yaw_rate_radps, bool valid) {
  return raw(kIdOdometry, {{kOdometryValid, valid ? 1.0 : 0.0},
                           {kWheelSpeed, speed_mps},
                           {kYawRate, yaw_rate_radps},
                           {kStdWheelSpeed, 0.02},
                           {kStdYawRate, 0.002}});
}

CanFrame SampleVehicle::state(int motion_state) {
  CanFrame frame;
  put_raw(frame.data, kMotionState, static_cast<std::uint32_t>(motion_state));
  return sealed(kIdVehicleState, frame);
}

CanFrame SampleVehicle::command(int command, int number) {
  CanFrame frame;
  put_raw(frame.data, kCommand, static_cast<std::uint32_t>(command));
  put_raw(frame.data, kCommandNumber, static_cast<std::uint32_t>(number));
  return sealed(kIdCommand, frame);
}

SentPose sent_pose(double x, double y, double heading) {
  SentPose pose;
  pose.p_map = Point3d(x, y, 0.5);
  pose.heading_rad = heading;
  pose.std_position_m = 0.02;
  pose.std_heading_rad = 0.003;
  pose.age_ms = 10.0;
  return pose;
}

}  // namespace tessera
