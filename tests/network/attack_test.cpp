// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What recordings, forged sessions, lost counters and members that lie can do: nothing that lasts
// (docs/design/threat-model.md).
#include <algorithm>
#include <catch2/catch.hpp>

#include "network/forger.hpp"
#include "network/team.hpp"

namespace tessera::network {
namespace {

TEST_CASE("attack: an exchange speaks, whatever its clock says first") {
  const std::int64_t hour_us = 3'600 * kSecond;
  for (const std::int64_t begin_us : {-hour_us, std::int64_t{-1}, std::int64_t{0}, hour_us}) {
    oracle::Random random(oracle::announce_seed(570));
    Robot robot(3, 1, Network::default_replicas(), {});
    REQUIRE(robot.publish(*pack({1, 2, 3}), random, 20).ok());
    CHECK(said(robot, begin_us, 2 * kSecond).size() > 4);
  }
}

TEST_CASE("attack: what was recorded of an epoch that is over is worth nothing") {
  Team team(3, 571);
  team.switch_off(2);
  // Robot 1's first epoch, recorded.
  team.publish(1, 20);
  const auto recorded = said(team.robot(1), Network::clock_us(1, 0), 3 * kSecond);
  team.restart(1, 2);
  team.publish(0, 10);
  team.publish(1, 5);
  REQUIRE(team.settle(20 * kSecond));
  const std::uint64_t before = team.robot(0).content_digest();
  for (int round = 0; round < 20; ++round) {
    for (const auto& datagram : recorded) team.say(0, datagram);
    team.run(kSecond / 2);
  }
  CHECK(team.robot(0).content_digest() == before);
  CHECK(team.report(0).refused_epochs > 0);
  CHECK_FALSE(team.robot(0).replicas().find({1, 1, 0}).ok());
  // A newcomer that hears the recording first loses it again.
  team.switch_on(2);
  for (const auto& datagram : recorded) team.say(2, datagram);
  REQUIRE(team.settle(20 * kSecond));
  CHECK_FALSE(team.robot(2).replicas().find({1, 1, 0}).ok());
}

TEST_CASE("attack: a robot that restarts a thousand times takes one robot's places") {
  Team team(3, 572);
  team.switch_off(2);
  team.publish(0, 10);
  for (std::uint32_t epoch = 2; epoch <= 1001; ++epoch) {
    // As `earlier = "keep"` has it: the newest earlier epoch counts on.
    team.restart(1, epoch - 1);
    team.publish(1, 3, static_cast<int>(epoch % 7));
    team.run(kSecond / 10);
  }
  CHECK(team.report(0).contributions <= 1 + ExchangeConfig{}.contributions_per_robot);
  team.switch_on(2);
  team.publish(2, 10);
  REQUIRE(team.settle(30 * kSecond));
  team.run(5 * kSecond);
  CHECK(team.all_complete());
  CHECK(team.report(0).contributions == 4);
  CHECK(team.robot(0).replicas().find({2, 1, 0}).ok());
  CHECK(team.robot(2).replicas().find({1, 1001, 0}).ok());
  CHECK_FALSE(team.robot(0).replicas().find({1, 999, 0}).ok());
}

TEST_CASE("attack: a robot that lost its counter goes on above it, and all are equal in 10 s") {
  const bool with_signatures = GENERATE(true, false);
  Team team(3, 573, with_signatures);
  for (int i = 0; i < 3; ++i) team.publish(i, 15);
  REQUIRE(team.settle(20 * kSecond));
  team.restart_without_counter(1);
  team.publish(1, 8, 3);
  const std::int64_t begin_us = team.now_us();
  Exchange& exchange = team.robot(1).exchange();
  while (!exchange.overtaken() && team.now_us() - begin_us < 5 * kSecond) team.run(kTickUs);
  REQUIRE(exchange.overtaken());
  CHECK(*exchange.overtaken() == 1);
  exchange.set_floor(2);
  REQUIRE(exchange.open(2, 0, Matrix34d::Identity()) == Status::kOk);
  team.publish(1, 8, 3);
  REQUIRE(team.settle(begin_us + 10 * kSecond - team.now_us()));
  CHECK_FALSE(exchange.overtaken());
  for (const int i : {0, 2}) {
    CHECK_FALSE(team.robot(i).replicas().find({1, 1, 0}).ok());
    const Replicas& replicas = team.robot(i).replicas();
    REQUIRE(replicas.find({1, 2, 0}).ok());
    CHECK(replicas.contribution(*replicas.find({1, 2, 0})).blocks == 8);
  }
}

TEST_CASE("attack: a lost counter shows by the floors that others kept over their own restart") {
  Team team(2, 587);
  team.restart(1);
  team.restart(1, 3);
  // Robot 0 was started after robot 1's epoch 3 and has nothing of it but its floor.
  team.restart(0);
  team.robot(0).exchange().set_floor_of(1, 3);
  team.restart_without_counter(1);
  team.publish(1, 8);
  Exchange& exchange = team.robot(1).exchange();
  for (int i = 0; i < 500 && !exchange.overtaken(); ++i) team.run(kTickUs);
  REQUIRE(exchange.overtaken());
  CHECK(*exchange.overtaken() == 3);
  exchange.set_floor(4);
  REQUIRE(exchange.open(4, 0, Matrix34d::Identity()) == Status::kOk);
  team.publish(1, 8);
  REQUIRE(team.settle(10 * kSecond));
  CHECK(team.robot(0).replicas().find({1, 4, 0}).ok());
  CHECK(team.all_complete());
}

TEST_CASE("attack: nobody is muted by a session that somebody made up") {
  Team team(2, 574, false);
  team.publish(0, 5);
  REQUIRE(team.settle(10 * kSecond));
  // One datagram in the name of robot 1, of the last session that there can be.
  Forger forger(1, ~std::uint64_t{0});
  for (int i = 0; i < 100; ++i)
    team.say(0, forger.datagram(DatagramKind::kLeave, [](ByteWriter&) {}));
  team.publish(0, 10, 20);
  team.restart(1);
  team.publish(1, 10);
  REQUIRE(team.settle(10 * kSecond));
  CHECK(team.all_complete());
  CHECK_FALSE(team.robot(0).exchange().peers().find(1)->left);
}

TEST_CASE("attack: repeated requests cost others a twenty-fifth of their rate") {
  Team team(4, 575);
  for (int i = 0; i < 3; ++i) team.publish(i, 300);
  REQUIRE(team.settle(20 * kSecond));
  // Robot 3 is a member that asks for everything again and again.
  std::uint64_t before = 0;
  std::uint64_t sequence = 1'000'000;
  constexpr int kSeconds = 60;
  for (int i = 0; i < 20 * 2 * kSeconds; ++i) {
    if (i == 20 * kSeconds) before = team.sent_bytes();
    for (std::uint32_t robot = 0; robot < 3; ++robot) {
      const auto datagram =
          Forger::request_for_all(3, std::uint64_t{1} << 32U | 3000U, ++sequence, {robot, 1, 0});
      for (int to_whom = 0; to_whom < 3; ++to_whom) team.say(to_whom, datagram);
    }
    team.run(kSecond / 20);
  }
  const double rate = static_cast<double>(team.sent_bytes() - before) / kSeconds;
  WARN("three robots send " << rate << " bytes a second");
  CHECK(rate < 200'000.0);
}

TEST_CASE("attack: two contents of one version end as one, and are counted") {
  const bool with_signatures = GENERATE(true, false);
  Team team(3, 576, with_signatures);
  // Member 9 publishes one thing to robot 0 and another to robot 1, in the same versions.
  std::array<std::unique_ptr<Robot>, 2> faces;
  for (const std::size_t face : {0U, 1U}) {
    RobotOptions options;
    if (with_signatures) options.key = 9;
    faces[face] =
        std::make_unique<Robot>(9, 1, Network::default_replicas(), ExchangeConfig{}, options);
    for (int x = 0; x < 20; ++x)
      REQUIRE(faces[face]->publish(*pack({x, 9, 0}), team.random(), 20).ok());
    for (const auto& datagram : said(*faces[face], 0, 2 * kSecond))
      team.say(static_cast<int>(face), datagram);
  }
  CHECK(team.robot(0).content_digest() != team.robot(1).content_digest());
  CHECK(team.robot(0).exchange().digest() != team.robot(1).exchange().digest());
  REQUIRE(team.settle(40 * kSecond));
  CHECK(team.report(0).conflicts + team.report(1).conflicts > 0);
}

TEST_CASE("attack: ranges that nobody signed make nothing complete") {
  Team team(2, 577, true, {.loss = 0.2});
  Forger forger(77);
  const auto empty_chunk = [&](std::uint32_t robot) {
    return forger.datagram(DatagramKind::kChunk, [&](ByteWriter& to) {
      write_chunk_header(to, {.id = {robot, 1, 0}, .range = {1, 100'000}, .relayed = true});
    });
  };
  for (int i = 0; i < 200; ++i) {
    if (i < 100) team.publish(0, 3, i % 30);
    if (i < 100) team.publish(1, 3, i % 30);
    for (const int to : {0, 1}) {
      std::vector<std::byte> datagram = empty_chunk(static_cast<std::uint32_t>(1 - to));
      datagram[3] |= std::byte{0x80};
      Forger::seal(datagram);
      team.say(to, datagram);
    }
    team.run(kSecond / 10);
    // Whoever says that it is complete holds what the other one published.
    for (const int i_robot : {0, 1}) {
      std::array<ContributionState, 16> states{};
      const std::size_t count = team.robot(i_robot).exchange().contributions(states);
      for (const ContributionState& state : std::span(states).first(count)) {
        if (state.id.robot == static_cast<std::uint32_t>(i_robot) || !state.complete) continue;
        const Replicas& own = team.robot(1 - i_robot).replicas();
        const Replicas& held = team.robot(i_robot).replicas();
        if (state.latest == team.report(1 - i_robot).published_parts)
          CHECK(held.contribution(*held.find(state.id)).blocks ==
                own.contribution(*own.find(state.id)).blocks);
      }
    }
  }
  REQUIRE(team.settle(30 * kSecond));
  CHECK(team.all_complete());
}

TEST_CASE("attack: of a frame one revision a second is taken, the newest at last") {
  Team team(2, 578);
  team.publish(0, 5);
  REQUIRE(team.settle(10 * kSecond));
  Matrix34d moved = Matrix34d::Identity();
  for (int i = 0; i < 500; ++i) {
    moved(0, 3) = i;
    REQUIRE(team.robot(0).exchange().move(1, 0, moved) == Status::kOk);
    team.run(kSecond / 50);
  }
  const Replicas& held = team.robot(1).replicas();
  CHECK(team.report(1).frames_early > 0);
  REQUIRE(team.settle(10 * kSecond));
  CHECK(held.contribution(*held.find({0, 1, 0})).frame_revision == 501);
}

TEST_CASE("attack: who is excluded and taken back is there again within 10 s") {
  Team team(3, 579);
  for (int i = 0; i < 3; ++i) team.publish(i, 20);
  REQUIRE(team.settle(10 * kSecond));
  REQUIRE(team.robot(0).exchange().exclude(2) == Status::kOk);
  team.run(3 * kSecond);
  CHECK_FALSE(team.robot(0).replicas().find({2, 1, 0}).ok());
  CHECK(team.robot(0).exchange().excluded().size() == 1);
  team.robot(0).exchange().include(2);
  REQUIRE(team.settle(10 * kSecond));
  CHECK(team.robot(0).replicas().find({2, 1, 0}).ok());
}

}  // namespace
}  // namespace tessera::network
