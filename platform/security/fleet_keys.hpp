// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot has of its fleet's keys, as the exchange calls them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "security/datagram_seal.hpp"
#include "security/fleet_signatures.hpp"
#include "tessera/robot/robot_config.hpp"

namespace tessera {

/// Paths; empty: none.
struct KeyFiles {
  std::string fleet_key;          ///< Without it, datagrams have a checksum alone.
  std::string robot_secret;       ///< With robot_public_keys; without both nothing is signed.
  std::string robot_public_keys;  ///< Of the whole fleet.
};

class FleetKeys {
 public:
  /// Those of the files that are named. robot: who has them. Fails as read_fleet_key(),
  /// DatagramSeal::make() and FleetSignatures::read() do; with kUsage iff one of robot_secret and
  /// robot_public_keys is there without the other, or the secret is another robot's.
  static Outcome<FleetKeys> read(const KeyFiles& files, std::uint32_t robot);
  /// For the exchange. This must outlive it and stay where it is.
  [[nodiscard]] RobotKeys keys() noexcept;

 private:
  FleetKeys() noexcept = default;
  std::optional<DatagramSeal> seal_;
  std::optional<FleetSignatures> signatures_;
};

}  // namespace tessera
