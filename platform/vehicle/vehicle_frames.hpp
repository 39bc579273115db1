// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The frames that a vehicle sends, with counters and checksums, as its controller would make them:
// for simulated vehicles and for tests. No clock, no heap.
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

/// Each call counts one on in its message's counter, so what it gives is to be sent in that order.
class VehicleFrames {
 public:
  /// base_id: see is_base_id().
  explicit VehicleFrames(std::uint32_t base_id = kDefaultBaseId) noexcept : base_id_(base_id) {}

  /// The three classic frames of a pose. Values beyond what their signals can say become the
  /// nearest that they can; an age over 254 ms says that there is no pose.
  [[nodiscard]] std::array<CanFrame, 3> pose(const SentPose& pose) noexcept;
  [[nodiscard]] CanFrame fd_pose(const SentPose& pose, bool valid = true) noexcept;
  [[nodiscard]] CanFrame odometry(const WheelMotion& odometry) noexcept;
  [[nodiscard]] CanFrame state(MotionState state) noexcept;
  [[nodiscard]] CanFrame command(VehicleCommand command, std::uint8_t number) noexcept;
  /// The message at a place behind the base (bus::kIdCommand, ...), also with signals that are not
  /// a vehicle's. A place without a message is a caller bug.
  [[nodiscard]] CanFrame frame(std::uint32_t place,
                               std::initializer_list<SignalValue> values) noexcept;

 private:
  [[nodiscard]] CanFrame sealed(std::uint32_t place, CanFrame frame) noexcept;

  std::uint32_t base_id_;
  std::array<std::uint8_t, kBusIds> counters_{};
  std::uint32_t pose_counter_ = 0;
};

/// The position and the angles of a rigid transform, as to_transform() puts them together again;
/// deviations and age are 0. At a pitch of a quarter turn heading and roll are one, and roll is 0.
[[nodiscard]] SentPose to_sent_pose(const Matrix34d& T_map_body) noexcept;

}  // namespace tessera
