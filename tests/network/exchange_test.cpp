// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whatever a network does: once datagrams get through again, all robots hold the same.
#include <catch2/catch.hpp>

#include "network/patch_drive.hpp"
#include "network/simulated_network.hpp"
#include "support/cloud.hpp"

namespace tessera::network {
namespace {

TEST_CASE("network: loss on every link, and all robots hold the same in the end") {
  const auto seed = oracle::announce_seed(501);
  const auto bytes_at = [seed](double loss) {
    Network network(3, {.loss = loss}, seed);
    drive(network, 10 * kSecond, 100);
    const std::int64_t driven_us = network.now_us();
    REQUIRE(network.settle(600 * kSecond));
    WARN("loss " << loss << ": " << network.sent_bytes() << " bytes, "
                 << static_cast<double>(network.now_us() - driven_us) / 1e6
                 << " s after the drive");
    return static_cast<double>(network.sent_bytes());
  };
  const double lossless = bytes_at(0.0);
  CHECK(bytes_at(0.01) < 1.2 * lossless);
  CHECK(bytes_at(0.1) < 1.5 * lossless);
  CHECK(bytes_at(0.3) < 1.8 * lossless);
  bytes_at(0.7);
}

TEST_CASE("network: of ten datagrams seven are lost, and all robots have all within minutes") {
  const auto seed = oracle::announce_seed(7000);
  std::int64_t worst_us = 0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    CAPTURE(i);
    Network network(3, {.loss = 0.7}, seed + i);
    drive(network, 10 * kSecond, 100);
    const std::int64_t driven_us = network.now_us();
    REQUIRE(network.settle(180 * kSecond));
    worst_us = std::max(worst_us, network.now_us() - driven_us);
  }
  WARN("at most " << static_cast<double>(worst_us) / 1e6 << " s after the drive");
}

TEST_CASE("network: a partition of 30 s, and both halves have all afterwards") {
  Network network(4, {.loss = 0.05}, oracle::announce_seed(503));
  drive(network, 5 * kSecond, 60);
  network.partition({0, 0, 1, 1});
  drive(network, 30 * kSecond, 60);
  CHECK_FALSE(network.agree());
  network.heal();
  REQUIRE(network.settle(60 * kSecond));
}

TEST_CASE("network: who joins late hears all, from whoever has it") {
  Network network(4, {.loss = 0.1}, oracle::announce_seed(504));
  network.switch_off(3);
  drive(network, 10 * kSecond, 60);
  REQUIRE(network.settle(60 * kSecond));
  // Two of three are gone when the fourth comes.
  network.switch_off(0);
  network.switch_off(1);
  network.switch_on(3);
  REQUIRE(network.settle(60 * kSecond));
  CHECK(network.robot(3).exchange().report().contributions == 4);
  network.switch_on(0);
  network.switch_on(1);
  REQUIRE(network.settle(60 * kSecond));
}

TEST_CASE(
    "network: a robot that is killed and starts again loses nothing that was delivered once") {
  Network network(3, {.loss = 0.05}, oracle::announce_seed(505));
  drive(network, 5 * kSecond, 60);
  REQUIRE(network.settle(60 * kSecond));
  const std::uint64_t before = network.robot(0).exchange().digest();
  network.restart(1);
  REQUIRE(network.settle(60 * kSecond));
  // What it published is there as before, and beside it the new epoch, which is empty.
  const Replicas& replicas = network.robot(1).replicas();
  const Replicas::Slot slot = *replicas.find({1, 1, 0});
  CHECK(replicas.contribution(slot).blocks > 50);
  CHECK(network.robot(1).exchange().report().contributions == 4);
  CHECK(network.robot(0).exchange().digest() != before);
  drive(network, 5 * kSecond, 60);
  REQUIRE(network.settle(60 * kSecond));
  CHECK(replicas.contribution(*network.robot(1).replicas().find({1, 2, 0})).blocks > 50);
}

TEST_CASE("network: whatever it did before, once it is well again all robots hold the same") {
  const auto seed = static_cast<std::uint64_t>(GENERATE(range(510, 522)));
  oracle::Random random(oracle::announce_seed(seed));
  Network network(3 + random.below(4), {}, seed);
  for (int phase = 0; phase < 6; ++phase) {
    for (int from = 0; from < network.size(); ++from) {
      for (int to = 0; to < network.size(); ++to) {
        network.set_link(from, to,
                         {.loss = random.uniform() * random.uniform(),
                          .burst = random.below(3) == 0 ? 0.01 : 0.0,
                          .delay_us = random.below(300'000),
                          .jitter_us = random.below(300'000),
                          .duplicate = 0.2 * random.uniform(),
                          .corrupt = 0.2 * random.uniform()});
      }
    }
    const int what = random.below(5);
    const int whom = random.below(network.size());
    if (what == 0) network.restart(whom);
    if (what == 1) network.switch_off(whom);
    if (what == 2) {
      std::vector<int> groups;
      for (int i = 0; i < network.size(); ++i) groups.push_back(random.below(2));
      network.partition(groups);
    }
    if (what == 3) {
      Matrix34d moved = Matrix34d::Identity();
      moved(1, 3) = phase + 1;
      Robot& robot = network.robot(whom);
      CHECK(robot.exchange().move(robot.session(), 0, moved) == Status::kOk);
    }
    drive(network, random.below(4) * kSecond, 40);
    if (random.below(2) == 0) network.heal();
    if (what == 1) network.switch_on(whom);
  }
  network.heal();
  network.set_link({.loss = 0.02});
  REQUIRE(network.settle(120 * kSecond));
  std::uint64_t damaged = 0;
  for (int i = 0; i < network.size(); ++i) {
    const ExchangeReport report = network.robot(i).exchange().report();
    damaged += report.refused_tag + report.refused_size + report.refused_format;
    CHECK(report.refused_body == 0);
    CHECK(report.impostors == 0);
  }
  CHECK(damaged > 0);
}

TEST_CASE("network: a robot without room keeps what it has, and does not ask without end") {
  ReplicasConfig small = Network::default_replicas();
  small.segments = 300;
  small.robot_segments = 200;
  Network network(3, {}, oracle::announce_seed(506), small);
  drive(network, 10 * kSecond, 40, false);
  CHECK_FALSE(network.settle(5 * kSecond));
  const ExchangeReport report = network.robot(0).exchange().report();
  CHECK(report.records_refused > 0);
  CHECK(report.complete < report.contributions);
  const std::uint64_t sent = network.sent_bytes();
  network.run(100 * kSecond);
  CHECK(network.sent_bytes() - sent < 100 * 3 * 20'000);
}

TEST_CASE("network: more than is noted of what is to be sent goes out all the same") {
  ExchangeConfig config;
  config.fresh = 3;
  config.bytes_per_s = 20'000;
  config.burst_bytes = 4'000;
  Network network(2, {}, oracle::announce_seed(509), Network::default_replicas(), config);
  for (int i = 0; i < 600; ++i)
    REQUIRE(network.robot(0).publish(*pack({i % 500, 0, 0}), network.random(), 5).ok());
  drive(network, 3 * kSecond, 30, false);
  REQUIRE(network.settle(120 * kSecond));
  // Every third of a second, if what is not noted were not sent by itself.
  CHECK(network.robot(1).exchange().report().requests < 10);
}

TEST_CASE("network: who is excluded is gone, and heard no more") {
  Network network(3, {}, oracle::announce_seed(507));
  drive(network, 3 * kSecond, 40);
  REQUIRE(network.settle(10 * kSecond));
  for (const int i : {0, 1}) CHECK(network.robot(i).exchange().exclude(2) == Status::kOk);
  drive(network, 3 * kSecond, 40);
  network.switch_off(2);
  REQUIRE(network.settle(10 * kSecond));
  CHECK_FALSE(network.robot(0).replicas().find({2, 1, 0}).ok());
  CHECK(network.robot(0).exchange().report().refused_excluded > 0);
  CHECK(network.robot(0).exchange().report().contributions == 2);
}

TEST_CASE("network: many robots") {
  const int robots = GENERATE(2, 4, 8, 16);
  Network network(robots, {.loss = 0.02}, oracle::announce_seed(508),
                  {.segments = 1U << 15U,
                   .blocks = 1U << 14U,
                   .contributions = 64,
                   .robot_segments = 1U << 14U});
  drive(network, 5 * kSecond, 40);
  REQUIRE(network.settle(60 * kSecond));
  const double each = static_cast<double>(network.sent_bytes()) / robots;
  WARN(robots << " robots: " << each << " bytes each");
}

}  // namespace
}  // namespace tessera::network
