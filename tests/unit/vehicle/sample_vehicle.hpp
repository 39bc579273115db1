// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A vehicle as a controller on the bus would be: its frames, with counters and checksums.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vehicle/bus_table.hpp"
#include "vehicle/bus_values.hpp"
#include "vehicle/pose_assembly.hpp"

namespace tessera {

class SampleVehicle {
 public:
  explicit SampleVehicle(std::uint32_t base_id = kDefaultBaseId) : base_id_(base_id) {}

  std::vector<CanFrame> pose(const SentPose& pose);
  CanFrame fd_pose(const SentPose& pose, bool valid = true);
  CanFrame odometry(double speed_mps, double yaw_rate_radps, bool valid = true);
  CanFrame state(int motion_state);
  CanFrame command(int command, int number);
  /// One whose signals are not to be the vehicle's.
  CanFrame raw(std::uint32_t place, const std::vector<std::pair<Signal, double>>& values);

 private:
  CanFrame sealed(std::uint32_t place, CanFrame frame);

  std::uint32_t base_id_;
  std::array<std::uint8_t, kBusIds> counters_{};
  std::uint32_t pose_counter_ = 0;
};

/// A good pose at a place, heading along x.
SentPose sent_pose(double x, double y = 0.0, double heading = 0.0);

}  // namespace tessera
