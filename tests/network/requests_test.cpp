// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot asks for, and how often.
#include "network/team.hpp"

namespace tessera::network {
namespace {

TEST_CASE("requests: who loses nothing of what an origin publishes asks for nothing") {
  const bool signs = GENERATE(false, true);
  Team team(2, 520, signs);
  team.publish(0, 1);
  REQUIRE(team.settle(10 * kSecond));
  const std::uint64_t requests = team.report(1).requests;
  const std::uint64_t announcements = team.report(0).announcements;
  // At any time, so some announcements go out just before what they announce.
  for (int i = 0; i < 200; ++i) {
    team.publish(0, 1, i % 40);
    team.run(kTickUs * (1 + team.random().below(30)));
  }
  REQUIRE(team.settle(kSecond));
  CHECK(team.report(0).announcements - announcements > 50);
  CHECK(team.report(1).requests == requests);
}

TEST_CASE("requests: the first version of a contribution is asked for as others are") {
  const bool signs = GENERATE(false, true);
  Team team(2, 521, signs);
  // Robot 1 knows that robot 0 has published nothing yet.
  team.run(5 * kSecond);
  REQUIRE(team.all_complete());
  team.set_link(0, 1, {.loss = 1.0});
  REQUIRE(team.robot(0).publish(*pack({1, 2, 3}), team.random(), 1).ok());
  team.run(kSecond / 10);
  team.set_link(0, 1, {});
  REQUIRE(team.report(0).published_parts == 1);
  REQUIRE_FALSE(team.agree());
  const std::uint64_t requests = team.report(1).requests;
  REQUIRE(team.settle(5 * kSecond));
  CHECK(team.all_complete());
  // Without a comparison of contents.
  CHECK(team.report(1).diverged + team.report(0).diverged == 0);
  // For the statement, and then for the version.
  CHECK(team.report(1).requests - requests <= 2);
}

/// Each hears all that the others say. Before each tick the first one publishes if it is time to.
template <class Publish>
void talk(const std::vector<Robot*>& robots, std::int64_t& now_us, std::int64_t for_us,
          const Publish& publish) {
  for (const std::int64_t until_us = now_us + for_us; now_us < until_us; now_us += kTickUs) {
    if (now_us % (kSecond / 10) == 0) publish();
    for (Robot* const from : robots) {
      for (const auto& datagram : said(*from, now_us, kTickUs)) {
        for (Robot* const to : robots) {
          if (to != from) to->exchange().receive(datagram, now_us);
        }
      }
    }
  }
}

TEST_CASE("requests: a robot that is full asks seldom while the blocks that it has change") {
  constexpr std::int32_t kBlocks = 60;
  constexpr std::int32_t kHeld = 20;  // or more
  oracle::Random random(oracle::announce_seed(522));
  ReplicasConfig small = Network::default_replicas();
  small.blocks = 64;
  Robot origin(1, 1, Network::default_replicas(), {});
  Robot other(2, 1, Network::default_replicas(), {});
  Robot full(3, 1, small, {});
  for (std::int32_t i = 0; i < 30; ++i) REQUIRE(other.publish(*pack({i, 2, 0}), random, 1).ok());
  std::int64_t now_us = 0;
  talk({&other, &full}, now_us, 3 * kSecond, [] {});
  std::int32_t block = 0;
  talk({&origin, &full}, now_us, 20 * kSecond, [&] {
    if (block < kBlocks) REQUIRE(origin.publish(*pack({block++, 1, 0}), random, 1).ok());
  });
  const Replicas& held = full.replicas();
  const auto blocks = [&] { return held.contribution(*held.find({1, 1, 0})).blocks; };
  REQUIRE(full.exchange().report().records_refused > 0);
  REQUIRE(blocks() > kHeld);
  REQUIRE(blocks() < kBlocks);

  const auto change = [&] {
    REQUIRE(origin.publish(*pack({block++ % kHeld, 1, 0}), random, 1).ok());
  };
  const ExchangeReport before = full.exchange().report();
  talk({&origin, &full}, now_us, 120 * kSecond, change);
  const ExchangeReport after = full.exchange().report();
  REQUIRE(after.records_taken - before.records_taken > 1'000);
  CHECK(after.requests - before.requests < 30);

  // And it goes on asking: once there is room it gets what it lacks.
  REQUIRE(full.exchange().exclude(2) == Status::kOk);
  talk({&origin, &full}, now_us, 70 * kSecond, change);
  CHECK(blocks() == kBlocks);
}

}  // namespace
}  // namespace tessera::network
