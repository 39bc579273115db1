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

  robot.now = robot.now + Duration{2'000'000};
  robot.announce(kSlow);
  CHECK_FALSE(robot.repair.comparison().active());
  robot.announce(kOther);
  CHECK(robot.is_comparing_with(kOther));
  robot.repair.comparison().end();
  // For about as long as it was at it.
  robot.now = robot.now + Comparison::kLongest;
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

}  // namespace
}  // namespace tessera
