// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A small fleet's keys, and statuses of its robots as they would be sealed.
#pragma once

#include <catch2/catch.hpp>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <tessera_status.hpp>
#include <vector>

#include "link/fleet_keys.hpp"
#include "link/key_maker.hpp"
#include "link/status_publisher.hpp"
#include "support/temporary_folder.hpp"

namespace tessera::test {

inline constexpr std::int64_t kSecond = 1'000'000;
inline constexpr std::uint32_t kRobots = 3;

enum class Protection { kNone, kKey, kSignatures };

/// Keys of a small fleet, as its robots have them.
class Fleet {
 public:
  explicit Fleet(Protection protection, const char* mission = "harbour 7") {
    const std::string folder = folder_.path().string() + "/keys";
    std::filesystem::create_directories(folder);
    REQUIRE(make_fleet(folder, kRobots, *Mission::make("harbour 7")).ok());
    for (std::uint32_t robot = 0; robot < kRobots; ++robot)
      keys_.push_back(keys_of(protection, folder, mission, robot));
  }
  /// The same fleet in another mission.
  [[nodiscard]] std::unique_ptr<FleetKeys> in_mission(const char* mission, std::uint32_t robot) {
    return keys_of(Protection::kSignatures, folder_.path().string() + "/keys", mission, robot);
  }
  [[nodiscard]] StatusKeys of(std::uint32_t robot) { return of(*keys_[robot]); }
  [[nodiscard]] static StatusKeys of(FleetKeys& keys) {
    return {keys.status_authenticator(), keys.keys().signatures};
  }
  /// For what is not a status: a datagram's tag.
  [[nodiscard]] Authenticator datagram_tags(std::uint32_t robot) {
    return keys_[robot]->keys().authenticator;
  }

 private:
  static std::unique_ptr<FleetKeys> keys_of(Protection protection, const std::string& folder,
                                            const char* mission, std::uint32_t robot) {
    KeyFiles files;
    if (protection != Protection::kNone) {
      files.fleet_key = folder + "/fleet.key";
      files.mission = mission;
    }
    if (protection == Protection::kSignatures) {
      files.robot_secret = folder + "/robot_" + std::to_string(robot) + ".key";
      files.robot_public_keys = folder + "/fleet.pub";
    }
    Outcome<FleetKeys> keys = FleetKeys::read(files, robot);
    REQUIRE(keys.ok());
    return std::make_unique<FleetKeys>(std::move(*keys));
  }

  TemporaryFolder folder_;
  std::vector<std::unique_ptr<FleetKeys>> keys_;
};

struct Said {
  std::uint32_t robot = 1;
  std::uint64_t session = 1;
  std::uint32_t sequence = 1;
  std::uint32_t exclude_digest = 0;
  std::int64_t other_twins = 0;
  std::int64_t conflicts = 0;
};

inline std::vector<std::byte> status_of(const Said& said, const StatusKeys& keys) {
  tessera_status message{};
  message.version = kStatusVersion;
  message.robot = static_cast<std::int32_t>(said.robot);
  message.exclude_digest = said.exclude_digest;
  message.counters[kLinkCounters + NodeState::kOtherTwins] = said.other_twins;
  message.counters[kLinkCounters + NodeState::kConflicts] = said.conflicts;
  std::vector<std::byte> bytes(keys.status_bytes());
  REQUIRE(message.encode(bytes.data(), 0, static_cast<int>(kTypedStatusBytes)) ==
          static_cast<int>(kTypedStatusBytes));
  seal_status(bytes, said.session, said.sequence, keys);
  return bytes;
}

}  // namespace tessera::test
