// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// record_status FILE: statuses of a robot in fleets without a key, with one, and with signatures,
// as text that decode_status.py holds its own decoder against.
#include <array>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <tessera_status.hpp>
#include <vector>

#include "link/fleet_keys.hpp"
#include "link/key_maker.hpp"
#include "link/status_message.hpp"
#include "link/status_publisher.hpp"

namespace {

using namespace tessera;

constexpr std::uint32_t kRobot = 2;
constexpr const char* kMission = "harbour 7";

template <class T>
T made(Outcome<T> outcome) {
  if (!outcome.ok()) throw std::runtime_error(outcome.failure().text());
  return std::move(*outcome);
}

template <class Bytes>
void write(std::FILE* file, const char* what, const Bytes& bytes) {
  std::fprintf(file, "%s ", what);
  for (const auto byte : bytes) std::fprintf(file, "%02x", static_cast<unsigned>(byte));
  std::fprintf(file, "\n");
}

void record(std::FILE* file, const std::string& mode, const std::string& folder) {
  KeyFiles files;
  if (mode != "none") files.fleet_key = folder + "/fleet.key";
  if (mode == "signatures") {
    files.robot_secret = folder + "/robot_" + std::to_string(kRobot) + ".key";
    files.robot_public_keys = folder + "/fleet.pub";
  }
  FleetKeys fleet = made(FleetKeys::read(files, kRobot));
  const StatusKeys keys{fleet.status_authenticator(), fleet.keys().signatures};
  tessera_status message{};
  message.version = kStatusVersion;
  message.robot = static_cast<std::int32_t>(kRobot);
  message.exclude_digest = 0xfedcba98U;
  message.doubted = 2;
  message.doubted_robot[0] = 5;
  message.doubted_classes[0] = 0b1010;
  message.doubted_robot[1] = 9;
  message.doubted_classes[1] = std::int64_t{1} << 62;
  message.counters[kLinkCounters + NodeState::kOwnTwins] = 17;
  message.counters[kLinkCounters + NodeState::kOtherTwins] = 19;
  message.counters[kLinkCounters + NodeState::kConflicts] = 23;
  std::vector<std::byte> status(keys.status_bytes());
  if (message.encode(status.data(), 0, static_cast<int>(kTypedStatusBytes)) !=
      static_cast<int>(kTypedStatusBytes))
    throw std::runtime_error("the typed message has another size");
  seal_status(status, 0x0123456789abcdefU, 0xfedcba98U, keys);
  write(file, ("status_" + mode).c_str(), status);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  const std::string path = argv[1];
  const std::string folder = path + ".keys";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  static_cast<void>(made(make_fleet(folder, kRobot + 1, made(Mission::make(kMission)))));
  std::FILE* const file = std::fopen(path.c_str(), "w");
  if (file == nullptr) return 1;
  write(file, "key", made(read_fleet_key(folder + "/fleet.key")).key.bytes());
  std::fprintf(file, "mission %s\n", kMission);
  for (const RobotPublic& one : made(read_public_keys(folder + "/fleet.pub"))) {
    if (one.robot == kRobot) write(file, "public", one.key);
  }
  for (const char* const mode : {"none", "key", "signatures"}) record(file, mode, folder);
  return std::fclose(file) == 0 ? 0 : 1;
}
