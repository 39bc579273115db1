// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Makes new key files from the system's random numbers, and a new mission in an existing one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "link/mission.hpp"

namespace tessera {

/// Each writes only new files: existing ones are never replaced, and if one file cannot be made
/// none is left. Fails with kUsage iff a file already exists or cannot be made; kFailure iff
/// writing fails or libsodium does not start. Uses the heap.
Outcome<void> make_fleet_key(const std::string& path, const Mission& mission);
/// Writes robot_ID.key (secret) and robot_ID.pub into the folder, which must exist.
Outcome<void> make_robot_key(std::uint32_t robot, const std::string& folder);
/// Writes the keys of a fleet with signatures into the folder, which must exist: fleet.key, the
/// pairs of robots 0 to robots - 1, and fleet.pub with all public keys. Returns their paths in this
/// order.
Outcome<std::vector<std::string>> make_fleet(const std::string& folder, std::uint32_t robots,
                                             const Mission& mission);

/// Writes another mission into a fleet's key file and leaves the rest unchanged; replaces the file
/// atomically. Fails as read_fleet_key() does; with kFailure iff writing fails.
Outcome<void> set_mission(const std::string& path, const Mission& mission);

}  // namespace tessera
