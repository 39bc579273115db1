// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places of contributions that are far and come near, without a network.
#include "tessera/exchange/internal/reach.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>

#include "exchange_rig.hpp"
#include "support/cloud.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

constexpr Instant kNow = Instant::at_us(1'000'000);
constexpr std::uint32_t kFar = 40;
constexpr std::uint32_t kOfRobot = 3;

ExchangeConfig config_with_far(std::uint32_t far = kFar) {
  ExchangeConfig config = ExchangeRig::config_of(1);
  config.contributions = 24;
  config.contributions_per_robot = kOfRobot;
  config.far_contributions = far;
  return config;
}

/// Known with a frame, a statement, and blocks around a place on x.
HeldContribution& known(ExchangeRig& rig, const ContributionId& id, double x_m) {
  Matrix34d T_global_map = Matrix34d::Identity();
  T_global_map(0, 3) = x_m;
  BlockExtent extent;
  extent.include(BlockCoord{0, 0, 0});
  REQUIRE(rig.ledger.take_frame(
      {.id = id, .revision = 4, .T_global_map = T_global_map, .extent = extent}, {}, true, kNow,
      rig.counted));
  REQUIRE(rig.ledger.take_statement({.id = id,
                                     .range = {1, 1},
                                     .latest = 10 + id.submap,
                                     .records = 5,
                                     .frame_revision = 4,
                                     .session = 1},
                                    {}, true, kNow, rig.counted));
  HeldContribution* const place = rig.ledger.find(id);
  REQUIRE(place != nullptr);
  return *place;
}

TEST_CASE("ContributionTable: what is known of a contribution is the same after it was far") {
  ExchangeRig rig(config_with_far());
  HeldContribution& before = known(rig, {2, 7, 3}, 12.0);
  const std::array<std::byte, 5> proof{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4},
                                       std::byte{77}};
  const std::array<std::byte, 3> frame_proof{std::byte{8}, std::byte{9}, std::byte{10}};
  before.proof.keep(proof);
  before.frame_proof.keep(frame_proof);
  before.session = {.digest = 5, .date_s = 6, .weight = 7};
  before.frame_at = Instant::at_us(1);
  before.origin_at = Instant::at_us(2);
  before.listed = Instant::at_us(3);
  before.denied = Instant::at_us(4);
  const KnownContribution expected = before.known();
  ContributionTable& table = rig.ledger.table();
  REQUIRE(table.put_far(before, rig.counted));
  REQUIRE(rig.ledger.find({2, 7, 3}) == nullptr);
  FarContribution* const far = table.far().find({2, 7, 3});
  REQUIRE(far != nullptr);
  const HeldContribution* const after = table.recall(*far, kNow);
  REQUIRE(after != nullptr);
  CHECK(table.far().size() == 0);
  CHECK((after->open && after->stated && after->latest == 13));
  CHECK(std::ranges::equal(after->proof.bytes(), proof));
  CHECK(std::ranges::equal(after->frame_proof.bytes(), frame_proof));
  CHECK(after->frame_revision == 4);
  CHECK(after->T_global_map == expected.T_global_map);
  CHECK(after->session == expected.session);
  CHECK(after->statement.records == 5);
  CHECK(after->signed_extent == expected.signed_extent);
  const std::array moments{after->frame_at, after->origin_at, after->listed, after->denied};
  for (std::size_t i = 0; i < moments.size(); ++i)
    CHECK(moments[i].us() == static_cast<std::int64_t>(i) + 1);
}

TEST_CASE("ContributionTable: a far one that is forgotten for another one is counted") {
  ExchangeRig rig(config_with_far(4));
  ContributionTable& table = rig.ledger.table();
  const auto put = [&](const ContributionId& id) {
    REQUIRE(table.put_far(known(rig, id, 100.0), rig.counted));
  };
  for (std::uint32_t submap = 0; submap < 3; ++submap) put({2, 1, submap});
  put({3, 1, 0});
  CHECK(rig.counted.forgotten_far == 0);
  put({4, 1, 0});
  CHECK(rig.counted.forgotten_far == 1);
  CHECK(table.far().size() == 4);
  // It was of the robot that has most.
  CHECK(table.far().find({3, 1, 0}) != nullptr);
  put({3, 1, 1});
  CHECK(rig.counted.forgotten_far == 2);
}

TEST_CASE("ContributionTable: whether a robot may have another place is as counting says") {
  ExchangeRig rig(config_with_far());
  ContributionTable& table = rig.ledger.table();
  oracle::Random random(oracle::announce_seed(2141));
  int full = 0;
  for (int step = 0; step < 3000; ++step) {
    const auto pick = [&](int below) { return static_cast<std::uint32_t>(random.below(below)); };
    const std::uint32_t submap = pick(6);
    const ContributionId id{2 + pick(5), 1,
                            submap < 4 ? submap : MapSession::kFirst + (submap - 4)};
    HeldContribution* const held = table.find(id);
    FarContribution* const far = table.far().find(id);
    if (held != nullptr) {
      if (random.below(2) != 0 || !table.put_far(*held, rig.counted)) table.drop(*held);
    } else if (far == nullptr) {
      static_cast<void>(table.add(id, ContributionTable::Claim::kFrame, kNow, rig.counted) ==
                            nullptr ||
                        (known(rig, id, 5.0), true));
    } else {
      std::uint32_t count = 0;
      for (const HeldContribution& one : table.places())
        count += one.used && one.id.robot == id.robot &&
                         MapSession::is(one.id.submap) == MapSession::is(id.submap)
                     ? 1U
                     : 0U;
      const bool expected =
          count < (MapSession::is(id.submap) ? MapSession::kPlacesOfRobot : kOfRobot);
      REQUIRE(table.has_place_for(*far) == expected);
      full += expected ? 0 : 1;
      const bool is_free = table.free_places() != 0;
      REQUIRE((table.recall(*far, kNow) != nullptr) == (expected && is_free));
    }
  }
  CHECK(full > 50);
}

TEST_CASE("Reach: a turn looks at each far one no more often than it may") {
  ExchangeRig rig(config_with_far());
  ContributionTable& table = rig.ledger.table();
  const Point3d here(0.0, 0.0, 0.0);
  // All are near, each nearer than the one before it; most are of a robot that has all its places.
  double x_m = 19.0;
  for (std::uint32_t submap = 0; submap < 20; ++submap, x_m -= 0.5)
    REQUIRE(table.put_far(known(rig, {2, 1, submap}, x_m), rig.counted));
  for (std::uint32_t submap = 0; submap < 10; ++submap, x_m -= 0.5)
    REQUIRE(table.put_far(known(rig, {3, 1, submap}, x_m), rig.counted));
  for (std::uint32_t submap = 20; submap < 20 + kOfRobot; ++submap)
    static_cast<void>(known(rig, {2, 1, submap}, 1.0));
  Reach reach(rig.config);
  reach.set({&here, 1}, 20.0);
  // Of robot 3 three come near; there is then no other one that may.
  CHECK(reach.tick(rig.ledger, rig.repair, kNow, rig.counted) == 4 * kFar);
  CHECK(rig.counted.made_near == kOfRobot);
  CHECK(table.far().find({3, 1, 9}) == nullptr);
  CHECK(table.far().find({3, 1, 6}) != nullptr);
  CHECK(table.far().find({2, 1, 19}) != nullptr);
  // Before the next turn nothing.
  CHECK(reach.tick(rig.ledger, rig.repair, kNow, rig.counted) == 0);
  const std::uint64_t looked =
      reach.tick(rig.ledger, rig.repair, kNow + Duration{200'000}, rig.counted);
  CHECK(looked > 0);
  CHECK(looked <= Reach::kMostWalks * kFar);
}

}  // namespace
}  // namespace tessera
