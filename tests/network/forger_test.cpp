// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one who has the fleet's key can do without signatures, and what it cannot.
#include "network/forger.hpp"

#include <catch2/catch.hpp>

#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr ContributionId kOfTwo{2, 1, 0};

/// A network of two robots, 0 and 1, and a third, 2, that is only made up.
struct Fixture {
  explicit Fixture(std::uint64_t seed, ReplicasConfig replicas = Network::default_replicas(),
                   const ExchangeConfig& config = {})
      : network(2, {}, oracle::announce_seed(seed), replicas, config) {}
  Exchange& exchange(int i = 0) { return network.robot(i).exchange(); }
  [[nodiscard]] ExchangeReport report(int i = 0) { return exchange(i).report(); }
  void say(const std::vector<std::byte>& datagram) {
    for (const int i : {0, 1})
      exchange(i).receive(datagram, Network::clock_us(i, network.now_us()));
  }
  /// Publishes so many blocks on robot 1.
  void publish(int blocks) {
    for (int i = 0; i < blocks; ++i)
      REQUIRE(network.robot(1).publish(*pack({i, 0, 0}), network.random(), 30).ok());
  }
  Network network;
  Forger forger{2};
};

TEST_CASE("forger: two blocks of one version stop nobody") {
  Fixture f(551);
  f.say(f.forger.frame(kOfTwo, 1));
  for (int i = 0; i < 300; ++i) f.say(f.forger.chunk(kOfTwo, {7, 7}, {i, 0, 0}, 7));
  CHECK(f.report().records_taken == 300);
  // A late joiner asks for all of it.
  f.network.restart(1);
  f.publish(20);
  f.network.run(10 * kSecond);
  CHECK(f.exchange(0).report().answer_chunks > 0);
  // Each in a chunk of its own, and all of them once more where an answer is awaited.
  CHECK(f.exchange(0).report().answer_chunks < 700);
  CHECK(f.network.robot(0).replicas().find({1, 2, 0}).ok());
  // Both have all of them: who shows them different ones of one version makes no lasting
  // difference.
  CHECK(f.network.agree());
  const Replicas& late = f.network.robot(1).replicas();
  CHECK(late.contribution(*late.find(kOfTwo)).blocks == 300);
}

TEST_CASE("forger: nobody says what a robot will say") {
  Fixture f(552);
  const ContributionId next{0, 2, 0};
  f.say(f.forger.announcement({{.id = next, .latest = 900, .frame_revision = 9}}));
  f.say(f.forger.frame(next, 9));
  f.say(f.forger.chunk(next, {1, 900}, {1, 2, 3}, 5));
  CHECK(f.report().impostors == 2);
  CHECK(f.report().refused_body == 1);  // only an origin sends records without their proofs
  REQUIRE(f.exchange().open(2, 0, Matrix34d::Identity()) == Status::kOk);
  REQUIRE(f.network.robot(0).publish(*pack({1, 2, 3}), f.network.random(), 30).ok());
  const Replicas& own = f.network.robot(0).replicas();
  const Replicas::Slot slot = *own.find(next);
  CHECK(own.find(slot, *pack({1, 2, 3}))->version == 1);
  CHECK(own.contribution(slot).frame_revision == 1);
}

TEST_CASE("forger: a frame that nobody has makes nothing incomplete") {
  Fixture f(554);
  f.publish(10);
  REQUIRE(f.network.settle(5 * kSecond));
  const ContributionId of_one{1, 1, 0};
  f.say(f.forger.announcement({{.id = of_one, .latest = 10, .frame_revision = 1'000'000}}));
  CHECK(f.report().complete == f.report().contributions);
  // It is asked for, until somebody who is honest speaks of the contribution.
  f.network.run(3 * kSecond);
  const std::uint64_t requests = f.report().requests;
  f.network.run(60 * kSecond);
  CHECK(f.report().requests == requests);
  CHECK(f.report().complete == f.report().contributions);
}

TEST_CASE("forger: versions that are made up hide none that come") {
  Fixture f(553);
  f.publish(10);
  REQUIRE(f.network.settle(5 * kSecond));
  const ContributionId of_one{1, 1, 0};
  f.say(f.forger.announcement({{.id = of_one, .latest = 4'000'000'000U, .complete = true}}));
  f.say(f.forger.chunk(of_one, {11, 3'000'000'000U}, {50, 0, 0}, 2'000'000'000U));
  f.network.run(5 * kSecond);
  CHECK(f.report().complete == f.report().contributions);
  // These are lost, and covered by what was made up.
  f.network.set_link({.loss = 1.0});
  f.publish(5);
  f.network.run(kSecond);
  f.network.set_link({});
  f.network.run(20 * kSecond);
  const Replicas& replicas = f.network.robot(0).replicas();
  CHECK(replicas.find(*replicas.find(of_one), *pack({4, 0, 0}))->version == 15);
}

TEST_CASE("forger: a table that is full of names has room for who has more than a name") {
  Fixture f(554);
  for (std::uint32_t i = 0; i < 1000; ++i)
    f.say(f.forger.announcement({{.id = {1000 + i, 1, 0}, .latest = 1, .frame_revision = 1}}));
  CHECK(f.report().refused_contributions > 0);
  CHECK(f.report().contributions <= 16);
  f.publish(10);
  f.network.run(10 * kSecond);
  CHECK(f.report().displaced_contributions > 0);
  CHECK(f.network.robot(0).replicas().find({1, 1, 0}).ok());
}

TEST_CASE("forger: places that are kept for a robot's own are not filled by what it hears") {
  ExchangeConfig config;
  config.own_contributions = 3;
  ReplicasConfig replicas = Network::default_replicas();
  replicas.contributions = 8;
  Fixture f(555, replicas, config);
  for (std::uint32_t i = 0; i < 100; ++i) f.say(f.forger.frame({1000 + i, 1, 0}, 1));
  CHECK(f.report().refused_contributions > 0);
  CHECK(f.exchange().open(1, 1, Matrix34d::Identity()) == Status::kOk);
  CHECK(f.exchange().open(1, 2, Matrix34d::Identity()) == Status::kOk);
  CHECK(f.exchange().open(1, 3, Matrix34d::Identity()) == Status::kResourceExhausted);
}

TEST_CASE("forger: who has no place for a contribution asks seldom for its frame") {
  ReplicasConfig few = Network::default_replicas();
  few.contributions = 3;
  Network network(5, {}, oracle::announce_seed(560), few);
  for (int i = 0; i < 5; ++i)
    REQUIRE(network.robot(i).publish(*pack({i, 0, 0}), network.random(), 30).ok());
  network.run(60 * kSecond);
  const std::uint64_t before = network.robot(0).exchange().report().requests;
  network.run(300 * kSecond);
  CHECK(network.robot(0).exchange().report().requests - before < 60);
}

TEST_CASE("forger: blocks of nothing have a quota too") {
  ReplicasConfig replicas = Network::default_replicas();
  replicas.robot_blocks = 40;
  Fixture f(556, replicas);
  f.say(f.forger.frame(kOfTwo, 1));
  for (std::uint32_t i = 1; i <= 100; ++i)
    f.say(f.forger.chunk(kOfTwo, {i, i}, {static_cast<std::int32_t>(i), 0, 0}, i));
  CHECK(f.report().records_taken == 40);
  CHECK(f.report().records_refused == 60);
}

TEST_CASE("forger: a message with a bad end has no beginning") {
  Fixture f(557);
  std::vector<std::byte> bad =
      f.forger.announcement({{.id = {7, 1, 0}, .latest = 1}, {.id = {8, 1, 0}, .latest = 1}});
  bad.erase(bad.end() - static_cast<std::ptrdiff_t>(kTagBytes) - 1);
  Forger::seal(bad);
  const std::uint32_t before = f.report().contributions;
  f.say(bad);
  CHECK(f.report().refused_body == 1);
  CHECK(f.report().contributions == before);
}

TEST_CASE("forger: who has left is gone, though an older message comes after it") {
  Fixture f(558);
  const auto early = f.forger.announcement({});
  const auto leave = f.forger.datagram(DatagramKind::kLeave, [](ByteWriter&) {});
  f.say(leave);
  f.say(early);
  CHECK(f.exchange().peers().find(2)->left);
  f.say(f.forger.announcement({}));
  CHECK_FALSE(f.exchange().peers().find(2)->left);
}

TEST_CASE("forger: a robot that is full asks seldom") {
  ReplicasConfig small = Network::default_replicas();
  small.segments = 60;
  Fixture f(559, small);
  for (int i = 0; i < 40; ++i)
    static_cast<void>(f.network.robot(0).publish(*pack({i, 1, 0}), f.network.random(), 30));
  for (int i = 0; i < 40; ++i)
    static_cast<void>(f.network.robot(1).publish(*pack({i, 0, 0}), f.network.random(), 30));
  f.network.run(60 * kSecond);
  REQUIRE(f.report().records_refused > 0);
  const std::uint64_t before = f.report().requests;
  f.network.run(300 * kSecond);
  CHECK(f.report().requests - before < 40);
}

}  // namespace
}  // namespace tessera::network
