// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Finds the process that runs a robot, to send it a signal.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

#include "base/outcome.hpp"

namespace tessera {

/// Returns the process that has folder/robot_ID.lock (lock_robot). Fails with kUsage iff there is
/// no such file, no process has its lock, or the caller cannot see the process.
Outcome<pid_t> find_robot_process(const std::string& folder, std::uint32_t robot);

}  // namespace tessera
