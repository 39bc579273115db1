// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot in memory of its own.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "base/arena_memory.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera::bench {

struct OneRobot {
  /// What keys name must outlive it. Ends the program iff there can be no such robot.
  OneRobot(const RobotConfig& config, const ClassTable& classes, const RobotKeys& keys)
      : memory(std::move(
            *ArenaMemory::allocate(Robot::required_bytes(config, classes.num_components())))) {
    Arena arena(memory.span());
    const Result<Robot*> made = Robot::make(arena, config, classes, keys, {});
    if (!made.ok()) {
      std::fprintf(stderr, "a robot: %s\n", to_string(made.status()));
      std::exit(1);
    }
    robot = *made;
  }
  ArenaMemory memory;
  Robot* robot = nullptr;
};

}  // namespace tessera::bench
