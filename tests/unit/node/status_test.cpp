// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is taken of a status: of the robot that signed it, of this mission, once.
#include <fcntl.h>

#include <array>
#include <catch2/catch.hpp>
#include <tessera_status.hpp>

#include "lcm/status_publisher.hpp"
#include "lcm/status_table.hpp"
#include "node/datagram_door.hpp"
#include "node/fleet_watch.hpp"
#include "posix/file_descriptor.hpp"
#include "security/fleet_keys.hpp"
#include "security/key_maker.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::uint32_t kRobots = 3;

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

  test::TemporaryFolder folder_;
  std::vector<std::unique_ptr<FleetKeys>> keys_;
};

struct Said {
  std::uint32_t robot = 1;
  std::uint64_t session = 1;
  std::uint32_t sequence = 1;
  std::uint32_t exclude_digest = 0;
  std::int64_t other_twins = 0;
};

std::vector<std::byte> status_of(const Said& said, const StatusKeys& keys) {
  tessera_status message{};
  message.version = kStatusVersion;
  message.robot = static_cast<std::int32_t>(said.robot);
  message.exclude_digest = said.exclude_digest;
  message.counters[kLinkCounters + NodeStatus::kOtherTwins] = said.other_twins;
  std::vector<std::byte> bytes(keys.status_bytes());
  REQUIRE(message.encode(bytes.data(), 0, static_cast<int>(kTypedStatusBytes)) ==
          static_cast<int>(kTypedStatusBytes));
  seal_status(bytes, said.session, said.sequence, keys);
  return bytes;
}

TEST_CASE("StatusTable: what a robot signed is taken, and each changed bit is refused") {
  Fleet fleet(Protection::kSignatures);
  StatusTable table(fleet.of(0), 0);
  const auto status = status_of({.exclude_digest = 0xfedcba98U, .other_twins = 7}, fleet.of(1));
  for (std::size_t bit = 0; bit < 8 * status.size(); ++bit) {
    auto changed = status;
    changed[bit / 8] ^= std::byte{1} << (bit % 8);
    REQUIRE(table.hear(changed, 0) != PayloadVerdict::kTaken);
  }
  CHECK(table.counters().taken == 0);
  CHECK(table.counters().refused_format == 96);  // The first twelve bytes: kind and version.
  CHECK(table.counters().refused_tag == 8 * status.size() - 96);
  REQUIRE(table.hear(status, 0) == PayloadVerdict::kTaken);
  REQUIRE(table.entries().size() == 1);
  const HeardStatus& heard = table.entries()[0].status;
  CHECK(heard.robot == 1);
  CHECK(heard.exclude_digest == 0xfedcba98U);
  CHECK(heard.other_twins == 7);
  CHECK(heard.own_twins == 0);
}

TEST_CASE("StatusTable: what is cut or longer is no status") {
  for (const Protection p : {Protection::kNone, Protection::kKey, Protection::kSignatures}) {
    Fleet fleet(p);
    StatusTable table(fleet.of(0), 0);
    auto status = status_of({}, fleet.of(1));
    for (std::size_t bytes = 0; bytes < status.size(); ++bytes)
      REQUIRE(table.hear(std::span(status).first(bytes), 0) == PayloadVerdict::kFormat);
    status.push_back({});
    CHECK(table.hear(status, 0) == PayloadVerdict::kFormat);
    status.pop_back();
    CHECK(table.hear(status, 0) == PayloadVerdict::kTaken);
  }
}

TEST_CASE("StatusTable: a tag of datagrams is none of statuses") {
  Fleet fleet(Protection::kKey);
  StatusKeys other = fleet.of(1);
  other.authenticator = fleet.datagram_tags(1);
  StatusTable table(fleet.of(0), 0);
  CHECK(table.hear(status_of({}, other), 0) == PayloadVerdict::kTag);
  CHECK(table.counters().refused_tag == 1);
}

TEST_CASE("StatusTable: a status of another fleet or another mission has no tag of this one") {
  Fleet fleet(Protection::kSignatures);
  Fleet other(Protection::kSignatures);
  StatusTable table(fleet.of(0), 0);
  CHECK(table.hear(status_of({}, other.of(1)), 0) == PayloadVerdict::kTag);
  const auto elsewhere = fleet.in_mission("harbour 8", 1);
  CHECK(table.hear(status_of({}, Fleet::of(*elsewhere)), 0) == PayloadVerdict::kTag);
  // Nor is the signature of one mission good in another, whoever has the key.
  StatusKeys mixed = fleet.of(1);
  mixed.signatures = Fleet::of(*elsewhere).signatures;
  CHECK(table.hear(status_of({}, mixed), 0) == PayloadVerdict::kTag);
  CHECK(table.counters().refused_tag == 2);
  CHECK(table.counters().refused_signature == 1);
}

TEST_CASE("StatusTable: a member that names another robot is refused") {
  Fleet fleet(Protection::kSignatures);
  StatusTable table(fleet.of(0), 0);
  CHECK(table.hear(status_of({.robot = 2}, fleet.of(1)), 0) == PayloadVerdict::kTag);
  CHECK(table.hear(status_of({.robot = 77}, fleet.of(1)), 0) == PayloadVerdict::kTag);
  CHECK(table.counters().refused_signature == 2);
  CHECK(table.entries().empty());
  CHECK(table.hear(status_of({.robot = 0}, fleet.of(1)), 0) == PayloadVerdict::kExcluded);
  CHECK(table.counters().refused_robot == 1);
}

TEST_CASE("StatusTable: nothing is heard twice, and nothing of an earlier session") {
  Fleet fleet(Protection::kSignatures);
  StatusTable table(fleet.of(0), 0);
  const auto hear = [&](std::uint64_t session, std::uint32_t sequence, std::int64_t now_us) {
    return table.hear(status_of({.session = session, .sequence = sequence}, fleet.of(1)), now_us);
  };
  CHECK(hear(5, 7, 0) == PayloadVerdict::kTaken);
  CHECK(hear(5, 7, 0) == PayloadVerdict::kExcluded);
  CHECK(hear(5, 6, 0) == PayloadVerdict::kExcluded);
  CHECK(hear(4, 9, 0) == PayloadVerdict::kExcluded);
  // Where robots sign, silence makes nothing good again.
  CHECK(hear(4, 9, 100 * kSecond) == PayloadVerdict::kExcluded);
  CHECK(table.counters().refused_replay == 4);
  CHECK(hear(5, 8, 100 * kSecond) == PayloadVerdict::kTaken);
  CHECK(hear(6, 1, 100 * kSecond) == PayloadVerdict::kTaken);
}

TEST_CASE("StatusTable: where nobody signs, a forged session mutes a robot for seconds alone") {
  Fleet fleet(Protection::kKey);
  StatusTable table(fleet.of(0), 0);
  const auto hear = [&](std::uint64_t session, std::int64_t now_us) {
    return table.hear(status_of({.session = session}, fleet.of(1)), now_us);
  };
  CHECK(hear(UINT64_MAX, 0) == PayloadVerdict::kTaken);
  CHECK(hear(5, StatusTable::kLately_us) == PayloadVerdict::kExcluded);
  CHECK(hear(5, StatusTable::kLately_us + 1) == PayloadVerdict::kTaken);
}

TEST_CASE("StatusTable: more signatures than it checks in a second are refused unchecked") {
  Fleet fleet(Protection::kSignatures);
  StatusKeys counting = fleet.of(0);
  static int checks = 0;
  checks = 0;
  counting.signatures.check = [](void*, std::uint32_t, std::span<const std::byte>,
                                 std::span<const std::byte, kSignatureBytes>) noexcept {
    ++checks;
    return false;
  };
  StatusTable table(counting, 0);
  const auto forged = status_of({.robot = 2}, fleet.of(1));
  constexpr int kSent = 1000;
  for (int i = 0; i < kSent; ++i) static_cast<void>(table.hear(forged, kSecond));
  CHECK(checks == static_cast<int>(StatusTable::kChecksPerSecond));
  CHECK(table.counters().refused_rate == kSent - StatusTable::kChecksPerSecond);
  static_cast<void>(table.hear(forged, 2 * kSecond));
  CHECK(checks == static_cast<int>(StatusTable::kChecksPerSecond) + 1);
}

TEST_CASE("StatusTable: a place is given away only of a robot that was silent") {
  Fleet fleet(Protection::kNone);
  StatusTable table(fleet.of(0), 0);
  const auto hear = [&](std::uint32_t robot, std::int64_t now_us) {
    return table.hear(status_of({.robot = robot}, fleet.of(1)), now_us);
  };
  for (std::uint32_t robot = 1; robot <= StatusTable::kMostRobots; ++robot)
    REQUIRE(hear(robot, robot == 9 ? 0 : kSecond) == PayloadVerdict::kTaken);
  CHECK(hear(100, StatusTable::kLately_us) == PayloadVerdict::kExcluded);
  CHECK(table.counters().refused_places == 1);
  CHECK(hear(100, StatusTable::kLately_us + 1) == PayloadVerdict::kTaken);
  CHECK(table.entries()[8].status.robot == 100);
  CHECK(table.entries().size() == StatusTable::kMostRobots);
}

TEST_CASE("DatagramDoor: of statuses too, who is excluded and who has no tag is refused") {
  Fleet fleet(Protection::kSignatures);
  Fleet strangers(Protection::kSignatures);
  DatagramDoor door(fleet.datagram_tags(0), fleet.of(0));
  const PayloadCheck check = door.status_check();
  const auto status = status_of({}, fleet.of(1));
  CHECK(check.check(check.context, status) == PayloadVerdict::kTaken);
  CHECK(check.check(check.context, status_of({}, strangers.of(1))) == PayloadVerdict::kTag);
  const std::uint32_t excluded[] = {1};
  door.set_excluded(excluded);
  CHECK(check.check(check.context, status) == PayloadVerdict::kExcluded);
}

TEST_CASE("FleetWatch: who differs is shown while it is heard, and said when it begins and ends") {
  Fleet fleet(Protection::kSignatures);
  FleetWatch watch(fleet.of(0), 0);
  LogQueue log("test");
  const FileDescriptor nothing(::open("/dev/null", O_WRONLY | O_CLOEXEC));
  FleetView view;
  std::uint32_t sequence = 0;
  const auto hear_and_look = [&](std::uint32_t theirs, std::int64_t now_us) {
    watch.hear(status_of({.sequence = ++sequence, .exclude_digest = theirs}, fleet.of(1)), now_us);
    watch.look(5, now_us, log);
    view = watch.view();
  };
  LogWriter writer(nothing.get(), false);
  const auto lines = [&] {
    const std::uint64_t before = writer.lines();
    LogQueue* const queues[] = {&log};
    writer.write(queues);
    return writer.lines() - before;
  };
  hear_and_look(5, 0);
  CHECK(view.differ().empty());
  CHECK(lines() == 0);
  hear_and_look(6, kSecond);
  hear_and_look(7, 2 * kSecond);
  REQUIRE(view.differ().size() == 1);
  CHECK(view.differ()[0] == 1);
  CHECK(lines() == 1);
  hear_and_look(5, 3 * kSecond);
  CHECK(view.differ().empty());
  CHECK(lines() == 1);
  hear_and_look(6, 4 * kSecond);
  CHECK(lines() == 1);
  watch.look(5, 4 * kSecond + StatusTable::kLately_us + 1, log);
  view = watch.view();
  CHECK(view.differ().empty());
  CHECK(lines() == 1);
}

}  // namespace
}  // namespace tessera
