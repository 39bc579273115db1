// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Keys as text: one line of words each, in files that can be read, copied and concatenated.
//
//     tessera-fleet-key 1 <64 hex digits> <check>           secret, one for the whole fleet
//     tessera-mission 1 <name> <check>                       in the same file
//     tessera-robot-secret 1 <robot> <64 hex digits> <check> secret, one for each robot
//     tessera-robot-public 1 <robot> <64 hex digits> <check> for everybody
//
// check: CRC-32C of everything before it on the line without the last space, 8 hex digits, which
// detects typing errors. Empty lines and lines that begin with # are ignored. key_maker writes
// them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"

namespace tessera {

inline constexpr std::size_t kKeyBytes = 32;

/// 32 bytes that are wiped on destruction. Cannot be copied implicitly.
class SecretKey {
 public:
  SecretKey() noexcept = default;
  SecretKey(SecretKey&& other) noexcept;
  SecretKey& operator=(SecretKey&& other) noexcept;
  SecretKey(const SecretKey&) = delete;
  SecretKey& operator=(const SecretKey&) = delete;
  ~SecretKey();
  [[nodiscard]] std::array<unsigned char, kKeyBytes>& bytes() noexcept { return bytes_; }
  [[nodiscard]] const std::array<unsigned char, kKeyBytes>& bytes() const noexcept {
    return bytes_;
  }

 private:
  std::array<unsigned char, kKeyBytes> bytes_{};
};

struct RobotSecret {
  std::uint32_t robot = 0;
  SecretKey seed;  ///< Of the Ed25519 key.
};

struct RobotPublic {
  std::uint32_t robot = 0;
  std::array<unsigned char, kKeyBytes> key{};
};

struct FleetSecret {
  SecretKey key;
  std::string mission;  ///< Its name; empty: the file has none.
};

/// Each reads a file that holds exactly one secret; the fleet's may name a mission too. Fails with
/// kUsage iff the file is missing, unreadable, a symbolic link or not a regular file; belongs to
/// another user; may be read or written by others than its owner (the message has the chmod); is
/// over 64 KiB; or is not of this kind (a malformed line is named, never quoted). Uses the heap.
Outcome<FleetSecret> read_fleet_key(const std::string& path);
Outcome<RobotSecret> read_robot_secret(const std::string& path);

/// The fleet's public keys, in the order of the robots. Fails with kUsage iff the file is
/// unreadable, over 64 KiB, may be written by others than its owner, has a malformed line, a
/// private key or none at all, or two lines for one robot. Uses the heap.
Outcome<std::vector<RobotPublic>> read_public_keys(const std::string& path);

}  // namespace tessera
