// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is taken of a status: of the robot that signed it, of this mission.
#include <fcntl.h>

#include <array>
#include <catch2/catch.hpp>

#include "base/file_descriptor.hpp"
#include "link/status_table.hpp"
#include "node/datagram_door.hpp"
#include "node/fleet_watch.hpp"
#include "status_fleet.hpp"

namespace tessera {
namespace {

using test::Fleet;
using test::kSecond;
using test::Protection;
using test::status_of;

TEST_CASE("StatusTable: what a robot signed is taken, and each changed bit is refused") {
  Fleet fleet(Protection::kSignatures);
  StatusTable table(fleet.of(0), 0);
  const auto status =
      status_of({.exclude_digest = 0xfedcba98U, .other_twins = 7, .conflicts = 5}, fleet.of(1));
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
  const HeardState& heard = table.entries()[0].status;
  CHECK(heard.robot == 1);
  CHECK(heard.exclude_digest == 0xfedcba98U);
  CHECK(heard.other_twins == 7);
  CHECK(heard.own_twins == 0);
  CHECK(heard.conflicts == 5);
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
    watch.hear(status_of({.sequence = ++sequence, .exclude_digest = theirs}, fleet.of(1)), now_us,
               nullptr);
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
