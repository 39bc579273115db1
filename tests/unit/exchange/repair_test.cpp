// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whom a robot compares contents with, and when.
#include "tessera/exchange/internal/repair.hpp"

#include <catch2/catch.hpp>

#include "support/aligned_memory.hpp"

namespace tessera {
namespace {

constexpr std::uint32_t kSlow = 8;
constexpr std::uint32_t kOther = 9;

/// A robot that has heard of all versions of a contribution, and holds other records than its
/// origin stated. Two peers are there.
struct Comparing {
  static constexpr ContributionId kId{5, 1, 0};
  static constexpr std::uint32_t kLatest = 100;
  static constexpr ReplicasConfig kReplicas{
      .segments = 64, .blocks = 64, .contributions = 4, .robot_segments = 64};
  static constexpr int kComponents = 5;
  static ExchangeConfig config() {
    ExchangeConfig config;
    config.robot = 1;
    config.contributions = 4;
    config.records = kReplicas.blocks;
    return config;
  }
  Comparing()
      : memory(Replicas::required_bytes(kReplicas) + Gate::required_bytes(config()) +
               Ledger::required_bytes(config(), kComponents) + Repair::required_bytes(config())) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, kReplicas);
    gate = *Gate::make(arena, config(), {}, crc_authenticator(), {});
    ledger = *Ledger::make(arena, config(), store_of(replicas), gate, kComponents);
    repair = *Repair::make(arena, config());
    REQUIRE(ledger.take_frame({.id = kId, .revision = 1}, {}, true, now, counted));
    const Statement statement{.id = kId,
                              .range = {1, 1},
                              .latest = kLatest,
                              .records = 50,
                              .frame_revision = 1,
                              .session = 1};
    REQUIRE(ledger.take_statement(statement, {}, true, now, counted));
    REQUIRE(contribution().coverage.add({1, kLatest}));
    for (const std::uint32_t robot : {kSlow, kOther})
      REQUIRE(gate.peers().find_or_add(robot, now) != nullptr);
  }
  [[nodiscard]] Ledger::Contribution& contribution() { return *ledger.find(kId); }
  /// A peer says that it holds something else of the same versions.
  void announce(std::uint32_t robot) {
    const AnnouncedContribution announced{.id = kId,
                                          .latest = kLatest,
                                          .frame_revision = 1,
                                          .stated = true,
                                          .complete = true,
                                          .digest = 77};
    repair.note_announced(ledger, contribution(), announced, *gate.peers().find(robot), now,
                          counted);
  }
  [[nodiscard]] bool is_comparing_with(std::uint32_t robot) {
    return repair.comparison().active() && repair.comparison().robot() == robot;
  }
  /// Time goes on. A record comes from that peer at once, and then one every tenth of a second.
  void take_from(std::uint32_t robot, std::int64_t for_us) {
    constexpr std::int64_t kStepUs = 100'000;
    for (std::int64_t passed_us = 0; passed_us < for_us; passed_us += kStepUs) {
      repair.note_taken(ledger, contribution(), {.grew = true, .records = 1}, true, robot, now);
      now = now + Duration{kStepUs};
      repair.end_comparison(ledger, gate.peers(), now);
    }
  }

  /// A record of a version that nobody knew of.
  void take_fresh() {
    repair.note_taken(ledger, contribution(), {.grew = true, .records = 1}, false, kId.robot, now);
  }
  /// The requests that are due, read back.
  int write() {
    std::array<std::byte, kMostBodyBytes> body{};
    ByteWriter to(body);
    if (!repair.write(ledger, to, now, counted)) return 0;
    int requests = 0;
    RequestedContribution requested;
    const std::span<const std::byte> written(body.data(), to.size());
    for (ByteReader from(written); from.remaining() != 0; ++requests)
      REQUIRE(read_requested(from, requested));
    return requests;
  }

  AlignedMemory memory;
  Replicas replicas;
  Gate gate;
  Ledger ledger;
  Repair repair;
  ExchangeReport counted;
  Instant now = Instant::at_us(1'000'000);
};

TEST_CASE("Repair: who brings records for longer than a comparison may last lets others go first") {
  Comparing robot;
  robot.announce(kSlow);
  REQUIRE(robot.is_comparing_with(kSlow));
  robot.take_from(kSlow, Comparison::kLongest.us);
  REQUIRE(robot.is_comparing_with(kSlow));
  robot.take_from(kSlow, 200'000);
  REQUIRE_FALSE(robot.repair.comparison().active());

  robot.now = robot.now + Duration{1'000'000};
  robot.announce(kSlow);
  CHECK_FALSE(robot.repair.comparison().active());
  robot.announce(kOther);
  CHECK(robot.is_comparing_with(kOther));
  robot.repair.comparison().end();
  // Not for as long as it was at it: what it brings is needed.
  robot.now = robot.now + Duration{14'000'000};
  robot.announce(kSlow);
  CHECK(robot.is_comparing_with(kSlow));
}

TEST_CASE("Repair: who brings records and an end is compared with again at once") {
  Comparing robot;
  robot.announce(kSlow);
  robot.take_from(kSlow, 5'000'000);
  // It says no more.
  while (robot.repair.comparison().active()) {
    robot.now = robot.now + Duration{100'000};
    robot.repair.end_comparison(robot.ledger, robot.gate.peers(), robot.now);
  }
  robot.now = robot.now + Duration{500'000};
  robot.announce(kSlow);
  CHECK(robot.is_comparing_with(kSlow));
}

TEST_CASE("Repair: what an origin publishes all the while answers no question of a comparison") {
  Comparing robot;
  robot.announce(kSlow);
  REQUIRE(robot.write() == 1);
  REQUIRE(robot.is_comparing_with(kSlow));
  int questions = 0;
  for (int tenth = 0; tenth < 30; ++tenth) {
    robot.take_fresh();
    robot.now = robot.now + Duration{100'000};
    robot.repair.end_comparison(robot.ledger, robot.gate.peers(), robot.now);
    questions += robot.write();
  }
  // One each half second.
  CHECK(questions >= 5);
  CHECK(questions <= 6);
}

TEST_CASE("Repair: what an origin publishes all the while answers no request either") {
  Comparing robot;
  const Statement later{.id = Comparing::kId,
                        .range = {1, 1},
                        .latest = Comparing::kLatest + 1,
                        .records = 51,
                        .frame_revision = 1,
                        .session = 1};
  REQUIRE(robot.ledger.take_statement(later, {}, true, robot.now, robot.counted));
  int requests = 0;
  for (int tenth = 0; tenth < 200; ++tenth) {
    robot.take_fresh();
    robot.now = robot.now + Duration{100'000};
    requests += robot.write();
  }
  // In 20 s, after the first few a second and more apart.
  CHECK(requests >= 8);
  CHECK(requests <= 24);
}

TEST_CASE("Repair: a contribution that is complete is not full any more") {
  Comparing robot;
  robot.repair.note_taken(robot.ledger, robot.contribution(), {.records = 1, .refused = true}, true,
                          kSlow, robot.now);
  REQUIRE(robot.contribution().full);
  robot.contribution().records = robot.contribution().statement.records;
  robot.contribution().held = robot.contribution().statement.fingerprint;
  robot.repair.note_lack(robot.ledger, robot.contribution(), robot.now);
  CHECK_FALSE(robot.contribution().full);
}

TEST_CASE("Repair: of names of this robot that others say one a second and robot is asked for") {
  Comparing robot;
  int names = 0;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    robot.now = robot.now + Duration{1'000};
    robot.repair.note_claim({1, 100 + i, 0}, *robot.gate.peers().find(i % 2 == 0 ? kSlow : kOther),
                            robot.now);
    names += robot.write();
  }
  CHECK(names >= 2);
  CHECK(names <= 4);
}

}  // namespace
}  // namespace tessera
