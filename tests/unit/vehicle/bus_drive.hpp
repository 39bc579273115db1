// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <catch2/catch.hpp>
#include <span>

#include "sample_pose.hpp"
#include "vehicle/vehicle_inputs.hpp"

namespace tessera {

/// The frames of one pose, a millisecond apart; what the last of them gave.
inline VehicleInputs::Taken take_all(VehicleInputs& inputs, std::span<const CanFrame> frames,
                                     std::int64_t& now_us) {
  VehicleInputs::Taken taken;
  for (const CanFrame& frame : frames) {
    now_us += 1'000;
    const VehicleInputs::Taken one = inputs.take(frame, now_us);
    if (one.pose.has_value()) taken.pose = one.pose;
    if (one.command.has_value()) taken.command = one.command;
  }
  return taken;
}

/// A vehicle that drives along x at 1 m/s and sends a pose and odometry every 20 ms.
struct BusDrive {
  explicit BusDrive(VehicleInputsConfig config = {}) : inputs(config), vehicle(config.base_id) {}
  VehicleInputs::Taken step(bool with_pose = true, bool with_odometry = true) {
    VehicleInputs::Taken taken;
    const std::int64_t begin_us = now_us;
    if (with_odometry) taken = inputs.take(vehicle.odometry({1.0, 0.0}), now_us);
    if (with_pose) taken = take_all(inputs, vehicle.pose(sent_pose(x_m)), now_us);
    now_us = begin_us + 20'000;
    x_m += 0.02;
    return taken;
  }
  void settle() {
    for (int i = 0; i < 20; ++i) static_cast<void>(step());
    REQUIRE(inputs.pose_source(now_us) == PoseSource::kPose);
  }
  VehicleInputs inputs;
  VehicleFrames vehicle;
  std::int64_t now_us = 1'000'000;
  double x_m = 0.0;
};

}  // namespace tessera
