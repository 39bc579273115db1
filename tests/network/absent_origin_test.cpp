// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An origin is gone: those who stay end at the join of what they have.
#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>

#include "network/forger.hpp"
#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

constexpr BlockCoord kBlock{1, 2, 3};
constexpr std::int64_t kSecond = 1'000'000;

std::unique_ptr<Robot> robot(std::uint32_t number, std::uint32_t session, bool signs) {
  RobotOptions options;
  if (signs) options.key = number;
  return std::make_unique<Robot>(number, session, Network::default_replicas(), ExchangeConfig{},
                                 options);
}

/// Each hears all that the others say, but who is deaf none of a kind.
void talk(const std::vector<Robot*>& robots, const Robot* deaf, std::int64_t& now_us,
          std::int64_t for_us, DatagramKind kind = DatagramKind::kStatement) {
  talk(robots, now_us, for_us, [&](const Robot& to, std::span<const std::byte> datagram) {
    return &to == deaf && kind_of(datagram) == kind;
  });
}

TEST_CASE("network: records whose statement nobody knows any more are shared all the same") {
  const bool signs = GENERATE(false, true);
  std::int64_t now_us = 0;
  oracle::Random random(oracle::announce_seed(511));
  auto origin = robot(1, 1, signs);
  const auto witness = robot(2, 1, signs);
  REQUIRE(origin->publish(*pack(kBlock), random, 40).ok());
  talk({origin.get(), witness.get()}, nullptr, now_us, 5 * kSecond);
  origin.reset();

  // The witness answers somebody who asks, and it is heard by one who was told of no statement.
  const auto hearer = robot(3, 1, signs);
  talk({witness.get(), hearer.get()}, hearer.get(), now_us, 5 * kSecond);
  const auto asker = robot(4, 1, signs);
  talk({witness.get(), hearer.get(), asker.get()}, hearer.get(), now_us, 5 * kSecond);
  REQUIRE(asker->replicas().find({1, 1, 0}).ok());
  REQUIRE(asker->content_digest() == witness->content_digest());
  REQUIRE(hearer->content_digest() == witness->content_digest());

  const auto newcomer = robot(5, 1, signs);
  talk({hearer.get(), newcomer.get()}, nullptr, now_us, 10 * kSecond);
  CHECK(newcomer->content_digest() == hearer->content_digest());
  CHECK(newcomer->exchange().digest() == hearer->exchange().digest());
}

TEST_CASE("network: who knows no statement finds records of all versions that another one has") {
  const bool signs = GENERATE(false, true);
  std::int64_t now_us = 0;
  oracle::Random random(oracle::announce_seed(514));
  auto origin = robot(1, 1, signs);
  const auto witness = robot(2, 1, signs);
  for (std::int32_t i = 0; i < 100; ++i) REQUIRE(origin->publish(*pack({i, 0, 0}), random, 1).ok());
  talk({origin.get(), witness.get()}, nullptr, now_us, 5 * kSecond);
  origin.reset();
  const auto hearer = robot(3, 1, signs);
  const auto asker = robot(4, 1, signs);
  talk({witness.get(), hearer.get(), asker.get()}, hearer.get(), now_us, 10 * kSecond);
  REQUIRE(hearer->content_digest() == witness->content_digest());

  // It has to find them itself: the other one does not know that it is there, so sends nothing
  // unasked.
  const auto newcomer = robot(5, 1, signs);
  talk({hearer.get(), newcomer.get()}, hearer.get(), now_us, 10 * kSecond, DatagramKind::kAnnounce);
  CHECK(hearer->exchange().report().diverged == 0);
  CHECK(newcomer->content_digest() == hearer->content_digest());
}

TEST_CASE("network: of forty robots one has the last of an origin, and all get it") {
  ReplicasConfig replicas = Network::default_replicas();
  replicas.contributions = 48;
  Network network(40, {}, oracle::announce_seed(512), replicas);
  REQUIRE(network.robot(0).publish(*pack(kBlock), network.random(), 40).ok());
  // They do not announce all at once: between any two announcements is less time than before a
  // request.
  for (int i = 1; i < network.size(); ++i) network.switch_off(i);
  for (int i = 1; i < network.size(); ++i) {
    network.switch_on(i);
    network.run(kSecond / 40);
  }
  REQUIRE(network.settle(20 * kSecond));
  for (int to = 2; to < network.size(); ++to) network.set_link(0, to, {.loss = 1.0});
  REQUIRE(network.robot(0).publish(*pack(kBlock), network.random(), 40).ok());
  network.run(kSecond / 5);
  network.switch_off(0);
  REQUIRE_FALSE(network.agree());
  // Most of those who announce are behind.
  CHECK(network.settle(10 * kSecond));
}

TEST_CASE("network: who has all places of an absent robot full gets a higher one of it") {
  const bool signs = GENERATE(false, true);
  std::int64_t now_us = 0;
  oracle::Random random(oracle::announce_seed(513));
  auto origin = robot(1, 1, signs);
  const auto near = robot(2, 1, signs);
  const auto far = robot(3, 1, signs);
  const std::uint32_t places = ExchangeConfig{}.contributions_per_robot;
  for (std::uint32_t submap = 1; submap <= places; ++submap) {
    if (submap == places) talk({origin.get(), near.get(), far.get()}, nullptr, now_us, 3 * kSecond);
    REQUIRE(origin->exchange().open(1, submap, Matrix34d::Identity()) == Status::kOk);
    REQUIRE(origin->publish(*pack(kBlock), random, 40).ok());
  }
  talk({origin.get(), near.get()}, nullptr, now_us, 3 * kSecond);
  const ContributionId last{1, 1, places};
  REQUIRE(near->replicas().find(last).ok());
  REQUIRE_FALSE(far->replicas().find(last).ok());
  origin.reset();
  talk({near.get(), far.get()}, nullptr, now_us, 10 * kSecond);
  CHECK(far->replicas().find(last).ok());
  CHECK(far->exchange().digest() == near->exchange().digest());
}

TEST_CASE("network: more blocks of one version than a list has are told apart all the same") {
  std::int64_t now_us = 0;
  const auto a = robot(2, 1, false);
  const auto b = robot(3, 1, false);
  Forger origin(1);
  const ContributionId id{1, 1, 0};
  for (Robot* const to : {a.get(), b.get()}) to->exchange().receive(origin.frame(id, 1), now_us);
  constexpr std::int32_t kBlocks = 1'100;
  for (std::int32_t i = 0; i <= kBlocks; ++i) {
    Robot& to = i < kBlocks ? *a : *b;
    to.exchange().receive(origin.chunk(id, {7, 7}, {i, 0, 0}, 7), now_us);
  }
  REQUIRE(a->exchange().digest() != b->exchange().digest());
  talk({a.get(), b.get()}, nullptr, now_us, 60 * kSecond);
  CHECK(a->exchange().digest() == b->exchange().digest());
}

TEST_CASE(
    "network: of two frames that a robot signs as one revision all who hear both keep the same") {
  std::vector<std::vector<std::byte>> frames;
  for (const double x_m : {1.0, 2.0}) {
    const auto twin = robot(1, 1, true);
    // Their datagrams have other numbers.
    const auto before_us = static_cast<std::int64_t>(x_m) * kSecond;
    static_cast<void>(said(*twin, 0, before_us));
    Matrix34d moved = Matrix34d::Identity();
    moved(0, 3) = x_m;
    REQUIRE(twin->exchange().move(1, 0, moved) == Status::kOk);
    for (auto& datagram : said(*twin, before_us, kSecond)) {
      if (kind_of(datagram) == DatagramKind::kFrame) frames.push_back(std::move(datagram));
    }
  }
  REQUIRE(frames.size() == 2);
  const auto a = robot(2, 1, true);
  const auto b = robot(3, 1, true);
  for (const std::size_t which : {0U, 1U}) {
    const std::int64_t now_us = static_cast<std::int64_t>(2 * which + 2) * kSecond;
    a->exchange().receive(frames[which], now_us);
    b->exchange().receive(frames[1 - which], now_us);
  }
  const auto place_of = [](const Robot& of) {
    const Replicas& held = of.replicas();
    return held.contribution(*held.find({1, 1, 0})).T_global_local.to_local({0, 0, 0});
  };
  CHECK(place_of(*a) == VoxelCoord{-10, 0, 0});
  CHECK(place_of(*b) == place_of(*a));
}

}  // namespace
}  // namespace tessera::network
