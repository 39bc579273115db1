// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The frames that a vehicle sends, with counters and checksums as from its controller: for
// simulated vehicles and for tests. No clock, no heap.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>

#include "vehicle/bus_table.hpp"
#include "vehicle/bus_values.hpp"
#include "vehicle/pose_assembly.hpp"

namespace tessera {

struct SignalValue {
  Signal signal{};
  double value = 0.0;
};

struct WheelMotion {
  double speed_mps = 0.0;
  double yaw_rate_radps = 0.0;
  double std_speed_mps = 0.02;
  double std_yaw_rate_radps = 0.002;
  bool valid = true;
};

/// Each call increments its message's counter, so send frames in the order of calls.
class VehicleFrames {
 public:
  /// base_id: see is_base_id().
  explicit VehicleFrames(std::uint32_t base_id = kDefaultBaseId) noexcept : base_id_(base_id) {}

  /// The three classic frames of a pose. Values beyond the range of their signals become the
  /// nearest in it; an age over 254 ms means that there is no pose.
  [[nodiscard]] std::array<CanFrame, 3> pose(const SentPose& pose) noexcept;
  [[nodiscard]] CanFrame fd_pose(const SentPose& pose, bool valid = true) noexcept;
  [[nodiscard]] CanFrame odometry(const WheelMotion& odometry) noexcept;
  [[nodiscard]] CanFrame state(MotionState state) noexcept;
  [[nodiscard]] CanFrame command(VehicleCommand command, std::uint8_t number) noexcept;
  /// The message at an offset from the base (bus::kIdCommand, ...), also one that vehicles do not
  /// send. An offset without a message is a caller bug.
  [[nodiscard]] CanFrame frame(std::uint32_t place,
                               std::initializer_list<SignalValue> values) noexcept;

 private:
  [[nodiscard]] CanFrame sealed(std::uint32_t place, CanFrame frame) noexcept;

  std::uint32_t base_id_;
  std::array<std::uint8_t, kBusIds> counters_{};
  std::uint32_t pose_counter_ = 0;
};

/// The position and the angles of a rigid transform, the inverse of to_transform(); deviations and
/// age are 0. At a pitch of a quarter turn heading and roll are equivalent, and roll is 0.
[[nodiscard]] SentPose to_sent_pose(const Matrix34d& T_map_body) noexcept;

}  // namespace tessera
