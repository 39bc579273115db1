// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Small robots in memory of just their size, and a street that they see part by part.
#pragma once

#include <vector>

#include "support/mapper.hpp"
#include "support/random.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera {

inline constexpr std::int64_t kTick_us = 50'000;

/// Voxels of 0.2 m, two classes, two peers.
RobotConfig small_robot_config(std::uint32_t number);
ClassTable small_robot_classes();
Matrix34d shift_of(double x_m, double y_m);

/// A robot that owns its memory.
struct SmallRobotMemory {
  explicit SmallRobotMemory(const RobotConfig& config, const RobotKeys& keys = {});
  AlignedMemory memory;
  Robot* robot = nullptr;
};

/// Some points of part number part of a street, labelled at random; equal parts are equal.
struct StreetPart {
  explicit StreetPart(int part);
  [[nodiscard]] ScanView view() const;
  std::vector<float> points;
  std::vector<std::uint8_t> components;
};

/// Ticks until nothing waits, then brings the global map up to date. Returns ticks; over 1000:
/// never.
int settle(Robot& robot, std::int64_t& now_us);
std::uint64_t digest_of(const LocalMap& map);

}  // namespace tessera
