// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Makes the configuration of a robot from that of its node.
#pragma once

#include <utility>

#include "maps/stored_map.hpp"
#include "node/node_config.hpp"
#include "tessera/map/obstacle_sectors.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera {

struct RobotSetup {
  MapSetup map;
  RobotConfig robot;
  ClassTable classes;  ///< With the kernels of the settings.
};

/// What a robot's scans are like.
struct ScanContent {
  std::size_t max_points = 0;
  const ClassTable& classes;
};

/// epoch: of this start. Fails with kUsage iff settings of the map or the diffusion contradict each
/// other, the frame or the file of kernels is invalid, or a budget of memory holds no map.
Outcome<RobotSetup> set_up_robot(const NodeConfig& config, const ScanContent& scans,
                                 std::uint32_t epoch);

/// Scans are replayed as fast as they are mapped: rather than lose something, mapping waits.
bool may_wait(const NodeConfig& config);

/// Rings of a metre, or one for the whole range if that is less.
ObstacleSectorsConfig sectors_of(const VehicleConfig& vehicle) noexcept;

/// A robot and its memory.
class HeldRobot {
 public:
  /// No robot.
  HeldRobot() = default;
  HeldRobot(ArenaMemory memory, Robot& robot) : memory_(std::move(memory)), robot_(&robot) {}
  [[nodiscard]] Robot& operator*() const { return *robot_; }
  [[nodiscard]] Robot* operator->() const { return robot_; }
  [[nodiscard]] std::span<std::byte> memory() const { return memory_.span(); }

 private:
  ArenaMemory memory_;
  Robot* robot_ = nullptr;
};

/// Allocates the memory and makes the robot in it. clock: for deadlines. Fails with kUsage iff a
/// setting is out of its range; kFailure iff the system does not give the memory. What keys refer
/// to must outlive it.
Outcome<HeldRobot> make_robot(const RobotConfig& config, const ClassTable& classes,
                              const RobotKeys& keys, const Clock& clock);

}  // namespace tessera
