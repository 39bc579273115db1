// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The keys of a robot, as functions for the exchange.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "link/datagram_seal.hpp"
#include "link/fleet_signatures.hpp"
#include "tessera/robot/robot_config.hpp"

namespace tessera {

/// Paths and a name; empty: none.
struct KeyFiles {
  std::string fleet_key;          ///< Without it, datagrams have only a checksum.
  std::string robot_secret;       ///< Given with robot_public_keys; without both nothing is signed.
  std::string robot_public_keys;  ///< Of the whole fleet.
  std::string mission;            ///< Used instead of the one in fleet_key.
};

class FleetKeys {
 public:
  /// Reads the named files. robot: their owner. Fails as read_fleet_key(), DatagramSeal::make() and
  /// FleetSignatures::read() do; with kUsage iff one of robot_secret and robot_public_keys is given
  /// without the other, the secret is another robot's, there is a fleet key and neither
  /// files.mission nor its file names a mission, or a mission without a key.
  static Outcome<FleetKeys> read(const KeyFiles& files, std::uint32_t robot);
  /// For the exchange, which this must outlive, at the same address.
  [[nodiscard]] RobotKeys keys() noexcept;
  /// For statuses: without functions if there is no fleet key. As keys().
  [[nodiscard]] Authenticator status_authenticator() noexcept {
    return status_seal_ ? status_seal_->authenticator() : Authenticator{};
  }
  /// Swaps the public keys of the two, if both have some; for the thread that uses keys(). No heap.
  void swap_public_keys(FleetKeys& other) noexcept {
    if (signatures_ && other.signatures_) signatures_->swap_public_keys(*other.signatures_);
  }
  /// Text of what differs in the secret files of `other`, read from the same paths: "the mission in
  /// fleet.key"; empty: nothing. files: as both were read. Keys are not compared if the mission
  /// differs.
  [[nodiscard]] std::string changed_secrets(const KeyFiles& files, FleetKeys& other);
  /// Null without keys.
  [[nodiscard]] const Mission& mission() const noexcept { return mission_; }

 private:
  FleetKeys() noexcept = default;
  Mission mission_;
  std::optional<DatagramSeal> seal_;
  std::optional<DatagramSeal> status_seal_;
  std::optional<FleetSignatures> signatures_;
};

}  // namespace tessera
