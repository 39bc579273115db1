// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots with many submaps, and where a correction moves them.
#pragma once

#include <catch2/catch.hpp>
#include <memory>

#include "network/simulated_network.hpp"
#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/rigid_code.hpp"

namespace tessera::network {

inline std::unique_ptr<Robot> roomy_robot(std::uint32_t number, bool signs = true) {
  ReplicasConfig replicas = Network::default_replicas();
  replicas.contributions = 256;
  ExchangeConfig config;
  config.contributions = replicas.contributions;
  config.contributions_per_robot = 128;
  config.own_contributions = 110;
  RobotOptions options;
  if (signs) options.key = number;
  return std::make_unique<Robot>(number, 1, replicas, config, options);
}

/// As corrections are: of a short code.
inline Matrix34d moved(std::uint32_t submap, double by) {
  Quaternion q{1.0, 0.01 * by, -0.02, 0.003 * submap};
  normalise(q);
  return *round_rigid(transform_of(q, {20.0 * submap + by, -3.0 * by, 0.1}));
}

/// Whether a robot holds that submap of robot 1 in that frame.
inline bool holds(const Robot& robot, std::uint32_t submap, const Matrix34d& T_global_map) {
  const Replicas& held = robot.replicas();
  const Result<Replicas::Slot> slot = held.find({1, 1, submap});
  if (!slot.ok()) return false;
  const GridTransform& found = held.contribution(*slot).T_global_local;
  const auto wanted = GridTransform::make(T_global_map, ExchangeConfig{}.resolution_m);
  const VoxelCoord far{9'000, -7'000, 500};
  return found.to_local({0, 0, 0}) == wanted->to_local({0, 0, 0}) &&
         found.to_local(far) == wanted->to_local(far);
}

}  // namespace tessera::network
