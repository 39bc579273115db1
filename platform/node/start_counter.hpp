// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How often a robot was started, by a file that outlives it: what others heard of an earlier start
// is no news, whatever the clock says.
#pragma once

#include <cstdint>
#include <string>

#include "posix/file_descriptor.hpp"
#include "posix/outcome.hpp"

namespace tessera {

/// Takes folder/robot_ID.lock, which no other process can while the value lives; folder is made if
/// it is not there. Fails with kUsage iff another process has it, or folder or file cannot be made.
Outcome<FileDescriptor> lock_robot(const std::string& folder, std::uint32_t robot);

/// Counts this start in folder/robot_ID.starts, which is made if it is not there, and durable
/// before this returns. For the process that has the robot's lock. The value is 1 at the first
/// start. Fails with kUsage iff the folder is missing or cannot be written to, or the file holds no
/// count; kFailure iff writing fails, or the count is at its end.
Outcome<std::uint32_t> count_start(const std::string& folder, std::uint32_t robot);

}  // namespace tessera
