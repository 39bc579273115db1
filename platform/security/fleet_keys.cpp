// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "security/fleet_keys.hpp"

#include <utility>

namespace tessera {

Outcome<FleetKeys> FleetKeys::read(const KeyFiles& files, std::uint32_t robot) {
  FleetKeys keys;
  const bool has_secret = !files.robot_secret.empty();
  if (has_secret == files.robot_public_keys.empty()) {
    return Failure{std::string("signatures take both: name ") +
                   (has_secret ? "robot_public_keys" : "robot_secret") + " too"};
  }
  if (!files.fleet_key.empty()) {
    const Outcome<SecretKey> key = read_fleet_key(files.fleet_key);
    if (!key.ok()) return key.failure();
    Outcome<DatagramSeal> seal = DatagramSeal::make(*key, KeyUse::kDatagram);
    if (!seal.ok()) return seal.failure();
    keys.seal_.emplace(std::move(*seal));
  }
  if (!has_secret) return keys;
  Outcome<FleetSignatures> signatures =
      FleetSignatures::read(files.robot_secret, files.robot_public_keys);
  if (!signatures.ok()) return signatures.failure();
  if (signatures->robot() != robot) {
    return Failure{files.robot_secret + " is of robot " + std::to_string(signatures->robot()) +
                   ", and this is robot " + std::to_string(robot) +
                   "; name the key file of this robot, or give this robot its number"};
  }
  keys.signatures_.emplace(std::move(*signatures));
  return keys;
}

RobotKeys FleetKeys::keys() noexcept {
  return {.authenticator = seal_ ? seal_->authenticator() : crc_authenticator(),
          .signatures = signatures_ ? signatures_->signatures() : Signatures{}};
}

}  // namespace tessera
