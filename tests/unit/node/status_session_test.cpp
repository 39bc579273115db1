// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which of a robot's sessions is heard, and each status of it once.
#include <array>
#include <catch2/catch.hpp>

#include "link/status_table.hpp"
#include "status_fleet.hpp"

namespace tessera {
namespace {

using test::Fleet;
using test::kSecond;
using test::Protection;
using test::status_of;

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

/// As an exchange has them. Sessions are put to work by hand: who proves one the exchange's tests
/// say.
class Peers {
 public:
  Peers() {
    Arena arena(memory_);
    table_ = *PeerTable::make(arena, 2);
  }
  void put_to_work(std::uint32_t robot, std::uint64_t session) {
    table_.find_or_add(robot, Instant{})->control.note(session, 1);
  }
  [[nodiscard]] const PeerTable* table() const { return &table_; }

 private:
  alignas(kArenaAlignment) std::array<std::byte, PeerTable::required_bytes(2)> memory_{};
  PeerTable table_;
};

TEST_CASE(
    "StatusTable: a robot that lost its counter of starts is heard when the exchange has it") {
  Fleet fleet(Protection::kSignatures);
  StatusTable table(fleet.of(0), 0);
  Peers peers;
  const auto hear = [&](std::uint64_t session, std::uint32_t sequence, const PeerTable* known) {
    return table.hear(status_of({.session = session, .sequence = sequence}, fleet.of(1)), 0, known);
  };
  peers.put_to_work(1, 50);
  REQUIRE(hear(50, 7, peers.table()) == PayloadVerdict::kTaken);
  // Its first start, by its new counter: not before it has proved itself.
  CHECK(hear(1, 1, peers.table()) == PayloadVerdict::kExcluded);
  peers.put_to_work(1, 1);
  CHECK(hear(1, 1, peers.table()) == PayloadVerdict::kTaken);
  CHECK(table.entries()[0].status.session == 1);
  CHECK(hear(1, 2, peers.table()) == PayloadVerdict::kTaken);
  // Recordings: of the session at work, of another one that was heard, of one that was not.
  CHECK(hear(1, 2, peers.table()) == PayloadVerdict::kExcluded);
  CHECK(hear(1, 1, peers.table()) == PayloadVerdict::kExcluded);
  CHECK(hear(50, 8, peers.table()) == PayloadVerdict::kExcluded);
  CHECK(hear(60, 1, peers.table()) == PayloadVerdict::kExcluded);
  // Nor is what was taken before forgotten with the exchange's peer.
  CHECK(hear(50, 7, nullptr) == PayloadVerdict::kExcluded);
  CHECK(table.counters().refused_replay == 6);
  // The earlier session again: it goes on where it was.
  peers.put_to_work(1, 50);
  CHECK(hear(50, 7, peers.table()) == PayloadVerdict::kExcluded);
  CHECK(hear(50, 8, peers.table()) == PayloadVerdict::kTaken);
}

TEST_CASE(
    "StatusTable: of a robot that is there nothing recorded is taken, be it the first heard") {
  Fleet fleet(Protection::kSignatures);
  StatusTable table(fleet.of(0), 0);
  Peers peers;
  peers.put_to_work(1, 6);
  CHECK(table.hear(status_of({.session = 5, .sequence = 9}, fleet.of(1)), 0, peers.table()) ==
        PayloadVerdict::kExcluded);
  // The exchange has not heard this one yet.
  CHECK(table.hear(status_of({.robot = 2, .session = 5}, fleet.of(2)), 0, peers.table()) ==
        PayloadVerdict::kTaken);
}

TEST_CASE("StatusTable: whoever gets the place of another has no sessions yet") {
  Fleet fleet(Protection::kSignatures);
  StatusKeys any = fleet.of(0);
  any.signatures.check = [](void*, std::uint32_t, std::span<const std::byte>,
                            std::span<const std::byte, kSignatureBytes>) noexcept { return true; };
  StatusTable table(any, 0);
  const auto hear = [&](const test::Said& said, std::int64_t now_us) {
    return table.hear(status_of(said, fleet.of(1)), now_us);
  };
  for (std::uint32_t robot = 1; robot <= StatusTable::kMostRobots; ++robot)
    REQUIRE(hear({.robot = robot, .session = 50}, 0) == PayloadVerdict::kTaken);
  const std::int64_t later_us = StatusTable::kLately_us + 1;
  CHECK(hear({.robot = 100, .session = 2, .sequence = 1}, later_us) == PayloadVerdict::kTaken);
  CHECK(hear({.robot = 100, .session = 2, .sequence = 2}, later_us) == PayloadVerdict::kTaken);
}

TEST_CASE(
    "StatusTable: where nobody signs, the session at work says nothing, as it can be forged") {
  Fleet fleet(Protection::kKey);
  StatusTable table(fleet.of(0), 0);
  Peers peers;
  peers.put_to_work(1, UINT64_MAX);
  CHECK(table.hear(status_of({.session = 5}, fleet.of(1)), 0, peers.table()) ==
        PayloadVerdict::kTaken);
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

}  // namespace
}  // namespace tessera
