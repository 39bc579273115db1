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

/// Paths and a name; empty: none.
struct KeyFiles {
  std::string fleet_key;          ///< Without it, datagrams have a checksum alone.
  std::string robot_secret;       ///< With robot_public_keys; without both nothing is signed.
  std::string robot_public_keys;  ///< Of the whole fleet.
  std::string mission;            ///< Used instead of the one that fleet_key names.
};

class FleetKeys {
 public:
  /// Those of the files that are named. robot: who has them. Fails as read_fleet_key(),
  /// DatagramSeal::make() and FleetSignatures::read() do; with kUsage iff one of robot_secret and
  /// robot_public_keys is there without the other, the secret is another robot's, there is a fleet
  /// key and neither files.mission nor its file names a mission, or a mission without a key.
  static Outcome<FleetKeys> read(const KeyFiles& files, std::uint32_t robot);
  /// For the exchange. This must outlive it and stay where it is.
  [[nodiscard]] RobotKeys keys() noexcept;
  /// For statuses: without functions where there is no fleet key. As keys().
  [[nodiscard]] Authenticator status_authenticator() noexcept {
    return status_seal_ ? status_seal_->authenticator() : Authenticator{};
  }
  /// Exchanges the public keys of the two, where both have some; for the thread that uses keys().
  /// No heap.
  void swap_public_keys(FleetKeys& other) noexcept {
    if (signatures_ && other.signatures_) signatures_->swap_public_keys(*other.signatures_);
  }
  /// None without keys.
  [[nodiscard]] const Mission& mission() const noexcept { return mission_; }

 private:
  FleetKeys() noexcept = default;
  Mission mission_;
  std::optional<DatagramSeal> seal_;
  std::optional<DatagramSeal> status_seal_;
  std::optional<FleetSignatures> signatures_;
};

}  // namespace tessera
