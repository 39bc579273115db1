// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/key_file.hpp"

#include <sodium.h>

#include <algorithm>

#include "link/key_text.hpp"

namespace tessera {
namespace {

struct Secret {
  RobotSecret robot;
  std::string mission;
};

/// Reads the one key of a file of that kind, and the mission if the kind has one.
Outcome<Secret> read_secret(const std::string& path, std::string_view kind, const char* command) {
  TESSERA_TRY_ASSIGN(const SecretText text, read_key_text(path, true));
  Secret secret;
  bool found = false;
  const Outcome<void> read =
      for_each_key(path, text.bytes, [&](const KeyLine& line) -> const char* {
        if (line.kind == kMissionKind && kind == kFleetKeyKind) {
          if (!secret.mission.empty()) return "is a second mission; keep one";
          secret.mission = line.mission;
          return nullptr;
        }
        if (line.kind != kind) return "is a key of another kind; name the right file";
        if (found) return "is a second key; keep one";
        found = true;
        secret.robot.robot = line.robot;
        secret.robot.seed.bytes() = line.key;
        return nullptr;
      });
  if (!read.ok()) return read.failure();
  if (!found) return bad_key(path, std::string("it has no key; make one with ") + command);
  return secret;
}

}  // namespace

SecretKey::SecretKey(SecretKey&& other) noexcept : bytes_(other.bytes_) {
  ::sodium_memzero(other.bytes_.data(), other.bytes_.size());
}

SecretKey& SecretKey::operator=(SecretKey&& other) noexcept {
  if (this == &other) return *this;
  bytes_ = other.bytes_;
  ::sodium_memzero(other.bytes_.data(), other.bytes_.size());
  return *this;
}

SecretKey::~SecretKey() { ::sodium_memzero(bytes_.data(), bytes_.size()); }

Outcome<FleetSecret> read_fleet_key(const std::string& path) {
  TESSERA_TRY_ASSIGN(Secret secret,
                     read_secret(path, kFleetKeyKind, "tessera key new --robots N --dir DIR"));
  return FleetSecret{std::move(secret.robot.seed), std::move(secret.mission)};
}

Outcome<RobotSecret> read_robot_secret(const std::string& path) {
  TESSERA_TRY_ASSIGN(Secret secret,
                     read_secret(path, kRobotSecretKind, "tessera key new --robot ID --dir DIR"));
  return std::move(secret.robot);
}

Outcome<std::vector<RobotPublic>> read_public_keys(const std::string& path) {
  TESSERA_TRY_ASSIGN(const SecretText text, read_key_text(path, false));
  std::vector<RobotPublic> keys;
  TESSERA_TRY(for_each_key(path, text.bytes, [&](const KeyLine& line) -> const char* {
    if (line.kind != kRobotPublicKind) return "is not a public key; keep secrets out of this file";
    for (const RobotPublic& other : keys) {
      if (other.robot == line.robot) return "is a second key of that robot; keep one";
    }
    keys.push_back({line.robot, line.key});
    return nullptr;
  }));
  if (keys.empty()) return bad_key(path, "it has no key; concatenate the robots' .pub files");
  std::sort(keys.begin(), keys.end(),
            [](const RobotPublic& a, const RobotPublic& b) { return a.robot < b.robot; });
  return keys;
}

}  // namespace tessera
