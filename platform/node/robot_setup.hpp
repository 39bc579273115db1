// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// From a node's configuration to what its robot is made with.
#pragma once

#include "dataset/dataset.hpp"
#include "node/node_config.hpp"
#include "node/robot.hpp"

namespace tessera {

struct RobotSetup {
  MapSetup map;
  RobotConfig robot;
};

/// dataset: what the robot replays; epoch: of this start. Fails with kUsage iff a setting of the
/// map or the diffusion is out of its range, the frame is none, or a budget of memory holds no map;
/// messages are in words of "map" and "fuse" (in_words_of_config).
Outcome<RobotSetup> set_up_robot(const NodeConfig& config, const Dataset& dataset,
                                 std::uint32_t epoch);

/// Capacities of a global map that fit into so many bytes. robot_share: of the replicas, for one
/// robot. Fails with kUsage iff they hold no map.
Outcome<GlobalMapConfig> fit_global_map(GlobalMapConfig config, std::size_t memory_bytes,
                                        double robot_share, int num_components);

}  // namespace tessera
