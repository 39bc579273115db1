// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/fleet_keys.hpp"

#include <fmt/core.h>

#include <array>
#include <utility>

namespace tessera {
namespace {

/// Required with a fleet's key.
Outcome<Mission> mission_of(const KeyFiles& files, const std::string& of_file) {
  const bool has_keys = !files.fleet_key.empty() || !files.robot_secret.empty();
  const std::string& name = files.mission.empty() ? of_file : files.mission;
  if (!has_keys && !name.empty())
    return Failure{
        "a mission protects nothing without a key: name fleet_key, or leave mission out"};
  if (!name.empty()) return Mission::make(name);
  if (files.fleet_key.empty()) return Mission();
  return Failure{files.fleet_key +
                 " names no mission; write one into it with tessera key mission --new --fleet " +
                 files.fleet_key + " and copy it to every robot, or name one as mission"};
}

}  // namespace

Outcome<FleetKeys> FleetKeys::read(const KeyFiles& files, std::uint32_t robot) {
  FleetKeys keys;
  const bool has_secret = !files.robot_secret.empty();
  if (has_secret == files.robot_public_keys.empty()) {
    return Failure{std::string("signatures need both keys: name ") +
                   (has_secret ? "robot_public_keys" : "robot_secret") + " too"};
  }
  FleetSecret fleet;
  if (!files.fleet_key.empty()) {
    TESSERA_TRY_ASSIGN(FleetSecret read, read_fleet_key(files.fleet_key));
    fleet = std::move(read);
  }
  TESSERA_TRY_ASSIGN(const Mission mission, mission_of(files, fleet.mission));
  keys.mission_ = mission;
  if (!files.fleet_key.empty()) {
    TESSERA_TRY_ASSIGN(DatagramSeal seal,
                       DatagramSeal::make(fleet.key, keys.mission_, KeyUse::kDatagram));
    keys.seal_.emplace(std::move(seal));
    TESSERA_TRY_ASSIGN(DatagramSeal status,
                       DatagramSeal::make(fleet.key, keys.mission_, KeyUse::kStatus));
    keys.status_seal_.emplace(std::move(status));
  }
  if (!has_secret) return keys;
  TESSERA_TRY_ASSIGN(
      FleetSignatures signatures,
      FleetSignatures::read(files.robot_secret, files.robot_public_keys, keys.mission_));
  if (signatures.robot() != robot) {
    return Failure{
        fmt::format("{} is of robot {}, and this is robot {}; name the key file of this robot, or "
                    "give this robot its number",
                    files.robot_secret, signatures.robot(), robot)};
  }
  keys.signatures_.emplace(std::move(signatures));
  return keys;
}

/// Compares keys by tags and signatures of one text, which are functions of key and text.
std::string FleetKeys::changed_secrets(const KeyFiles& files, FleetKeys& other) {
  if (mission_.name() != other.mission_.name()) return "the mission in " + files.fleet_key;
  const std::array<std::byte, 1> text{};
  const auto tag_of = [&text](FleetKeys& keys) {
    std::array<std::byte, kTagBytes> tag{};
    const Authenticator authenticator = keys.keys().authenticator;
    authenticator.tag(authenticator.context, text, tag);
    return tag;
  };
  const auto signature_of = [&text](FleetKeys& keys) {
    std::array<std::byte, kSignatureBytes> signature{};
    const Signatures signatures = keys.keys().signatures;
    if (signatures.on()) signatures.sign(signatures.context, text, signature);
    return signature;
  };
  std::string changed;
  if (tag_of(*this) != tag_of(other)) changed = "the key in " + files.fleet_key;
  if (signature_of(*this) != signature_of(other))
    changed += (changed.empty() ? "" : ", ") + std::string("the key in ") + files.robot_secret;
  return changed;
}

RobotKeys FleetKeys::keys() noexcept {
  return {.authenticator = seal_ ? seal_->authenticator() : crc_authenticator(),
          .signatures = signatures_ ? signatures_->signatures() : Signatures{}};
}

}  // namespace tessera
