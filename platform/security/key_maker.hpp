// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// New key files, by the system's random numbers, and a new mission in one that is there.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "posix/outcome.hpp"
#include "security/mission.hpp"

namespace tessera {

/// Each writes new files alone: what is there is never replaced, and where one file cannot be made
/// none is left. Fails with kUsage iff a file is there already or cannot be made; kFailure iff
/// writing fails or libsodium does not start. Uses the heap.
Outcome<void> make_fleet_key(const std::string& path, const Mission& mission);
/// Writes robot_ID.key (secret) and robot_ID.pub into the folder, which must exist.
Outcome<void> make_robot_key(std::uint32_t robot, const std::string& folder);
/// Writes what a fleet that signs needs into the folder, which must exist: fleet.key, the pairs of
/// robots 0 to robots - 1, and fleet.pub with all public keys. Returns their paths in this order.
Outcome<std::vector<std::string>> make_fleet(const std::string& folder, std::uint32_t robots,
                                             const Mission& mission);

/// Names another mission in a fleet's key file and leaves the rest of the file as it is; the file
/// is replaced whole or not at all. Fails as read_fleet_key() does; with kFailure iff writing
/// fails.
Outcome<void> set_mission(const std::string& path, const Mission& mission);

}  // namespace tessera
