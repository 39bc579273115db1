// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where robots have a key and do not sign, who has the key can say anything in anybody's name. What
// a robot says itself, unasked, ends it.
#include "network/forger.hpp"
#include "network/team.hpp"

namespace tessera::network {
namespace {

constexpr ContributionId kOfOne{1, 1, 0};
constexpr std::uint64_t kFar = std::uint64_t{1} << 40U;

/// Two robots that hold the same, and one who speaks as robot 1, in its session, with numbers that
/// it has not come to.
struct Forged : Team {
  explicit Forged(std::uint64_t seed, int robots = 2) : Team(robots, seed, false) {
    for (int i = 0; i < 2; ++i) publish(i, 5);
    for (int i = 2; i < robots; ++i) switch_off(i);
    REQUIRE(settle(10 * kSecond));
  }
  [[nodiscard]] const Peer& one() { return *robot(0).exchange().peers().find(1); }
  [[nodiscard]] Forger as_one() { return Forger(1, one().control.session, kFar); }
  [[nodiscard]] bool holds(const ContributionId& id) { return robot(0).replicas().find(id).ok(); }
};

TEST_CASE("unsigned: who is said to have left is there again, also where both are said to") {
  Forged team(590);
  const auto leave = [](ByteWriter&) {};
  Forger zero(0, team.robot(1).exchange().peers().find(0)->control.session, kFar);
  Forger one = team.as_one();
  team.say(0, one.datagram(DatagramKind::kLeave, leave));
  team.say(1, zero.datagram(DatagramKind::kLeave, leave));
  CHECK(team.one().left);
  team.run(kSecond);
  // Their own numbers are far below: nothing that they say counts yet.
  CHECK(team.one().left);
  team.run(9 * kSecond);
  CHECK_FALSE(team.one().left);
  CHECK_FALSE(team.robot(1).exchange().peers().find(0)->left);
  team.publish(1, 5, 20);
  REQUIRE(team.settle(10 * kSecond));
}

TEST_CASE("unsigned: a frame gives way to the robot's own, also of an earlier revision") {
  Forged team(591);
  const Replicas& held = team.robot(0).replicas();
  const auto revision = [&] { return held.contribution(*held.find(kOfOne)).frame_revision; };
  team.run(2 * kSecond);
  Forger one = team.as_one();
  team.say(0, one.frame(kOfOne, 1'000'000));
  CHECK(revision() == 1'000'000);
  // It is asked for what it announced, and does not wait for its turn.
  team.run(4 * kSecond);
  CHECK(revision() == 1);
  CHECK(team.all_complete());
  CHECK(team.agree());
}

TEST_CASE("unsigned: others are believed about a robot's frame while it is not heard") {
  Forged team(599);
  const Replicas& held = team.robot(0).replicas();
  const auto revision = [&] { return held.contribution(*held.find(kOfOne)).frame_revision; };
  Forger other(9);
  team.run(2 * kSecond);
  team.say(0, other.frame(kOfOne, 7));
  CHECK(revision() == 1);
  team.switch_off(1);
  team.run(5 * kSecond);
  team.say(0, other.frame(kOfOne, 7));
  CHECK(revision() == 7);
  team.switch_on(1);
  team.run(4 * kSecond);
  CHECK(revision() == 1);
  CHECK(team.all_complete());
}

TEST_CASE("unsigned: recordings of a robot that is off are not taken for itself") {
  Forged team(600, 3);
  // What it says is recorded by who hears it.
  const std::vector<std::byte> recorded = team.as_one().chunk(kOfOne, {1, 1}, {0, 1, 0}, 1);
  team.run(kSecond);
  team.switch_off(1);
  team.run(5 * kSecond);
  Forger other(9);
  for (int i = 0; i < 10; ++i) {
    team.say(0, recorded);
    team.run(kSecond);
  }
  const Replicas& held = team.robot(0).replicas();
  team.say(0, other.frame(kOfOne, 7));
  CHECK(held.contribution(*held.find(kOfOne)).frame_revision == 7);
}

TEST_CASE("unsigned: a false frame does not come back from those who missed the true one") {
  constexpr int kRobots = 10;
  Team team(kRobots, 598, false, {.loss = 0.3});
  for (int i = 0; i < kRobots; ++i) team.publish(i, 1);
  REQUIRE(team.settle(60 * kSecond));
  Forger one(1, team.robot(0).exchange().peers().find(1)->control.session, kFar);
  for (int i = 0; i < kRobots; ++i) {
    if (i != 1) team.say(i, one.frame(kOfOne, 1'000'000));
  }
  REQUIRE_FALSE(team.agree());
  team.run(30 * kSecond);
  CHECK(team.agree());
  CHECK(team.all_complete());
}

TEST_CASE("unsigned: epochs that a robot does not announce go, and what it announces stays") {
  Forged team(592);
  Forger one = team.as_one();
  for (const std::uint32_t epoch : {2U, 77U, ~std::uint32_t{0}})
    team.say(0, one.frame({1, epoch, 0}, 1));
  CHECK(team.holds({1, 77, 0}));
  team.run(5 * kSecond);
  for (const std::uint32_t epoch : {2U, 77U, ~std::uint32_t{0}})
    CHECK_FALSE(team.holds({1, epoch, 0}));
  CHECK(team.holds(kOfOne));
  REQUIRE(team.settle(20 * kSecond));
}

TEST_CASE("unsigned: what a robot denies does not come back from those it has not reached") {
  constexpr int kRobots = 14;
  Team team(kRobots, 597, false);
  for (int i = 0; i < kRobots; ++i) team.publish(i, 1);
  REQUIRE(team.settle(20 * kSecond));
  const auto holders = [&](const ContributionId& id) {
    int count = 0;
    for (int i = 0; i < kRobots; ++i) count += team.robot(i).replicas().find(id).ok() ? 1 : 0;
    return count;
  };
  Forger one(1, team.robot(0).exchange().peers().find(1)->control.session, kFar);
  // Half of them drop it while the others have only begun to doubt.
  for (const std::uint32_t between : {1'200'000U, 1'300'000U, 1'400'000U, 1'500'000U, 1'600'000U}) {
    const ContributionId id{1, 77, between};
    for (const int first : {2, 3}) {
      for (int i = first; i < kRobots; i += 2) team.say(i, one.frame(id, 1));
      REQUIRE(holders(id) > 0);
      team.run(between);
    }
    team.run(5 * kSecond);
    CHECK(holders(id) == 0);
  }
  REQUIRE(team.settle(20 * kSecond));
}

TEST_CASE("unsigned: a record of a far version has the robot publish anew, and then is gone") {
  Forged team(593);
  Forger one = team.as_one();
  team.say(0, one.chunk(kOfOne, {2'000'000'000, 2'000'000'000}, {7, 7, 7}, 2'000'000'000));
  Exchange& origin = team.robot(1).exchange();
  for (int i = 0; i < 3000 && !origin.overtaken(); ++i) team.run(kTickUs);
  REQUIRE(origin.overtaken());
  CHECK(*origin.overtaken() == 1);
  origin.set_floor(2);
  // Until it is above, it says that it is to go on.
  CHECK(origin.overtaken());
  REQUIRE(origin.open(2, 0, Matrix34d::Identity()) == Status::kOk);
  CHECK_FALSE(origin.overtaken());
  team.publish(1, 5);
  REQUIRE(team.settle(20 * kSecond));
  CHECK(team.all_complete());
  CHECK_FALSE(team.holds(kOfOne));
  CHECK(team.holds({1, 2, 0}));
}

TEST_CASE("unsigned: the last epoch that there is raises no robot out of reach") {
  Forged team(594);
  const std::uint32_t last = ~std::uint32_t{0};
  team.say(1, Forger(77).datagram(DatagramKind::kStatement, [&](ByteWriter& to) {
    REQUIRE(write_statement(to, {.id = {1, last, 0},
                                 .range = {1, 1},
                                 .latest = 1,
                                 .records = 1,
                                 .frame_revision = 1,
                                 .floor = last,
                                 .session = 77}));
  }));
  CHECK_FALSE(team.robot(1).exchange().overtaken());
}

TEST_CASE("unsigned: robots that do not exist give their places to who is there") {
  Forged team(595, 3);
  for (std::uint32_t i = 0; i < 40; ++i) {
    Forger nobody(1000 + i);
    team.say(0, nobody.frame({1000 + i, 1, 0}, 1));
  }
  CHECK(team.report(0).contributions == 16);
  team.run(11 * kSecond);
  team.switch_on(2);
  team.publish(2, 5);
  team.run(20 * kSecond);
  CHECK(team.holds({2, 1, 0}));
  CHECK(team.holds(kOfOne));
  std::array<ContributionState, 16> states{};
  const std::size_t count = team.robot(0).exchange().contributions(states);
  for (const ContributionState& state : std::span(states).first(count))
    CHECK((state.id.robot >= 1000 || state.complete));
}

TEST_CASE("unsigned: an honest network that delays and repeats takes nobody for somebody else") {
  Team team(3, 596, false,
            {.loss = 0.1, .delay_us = 5'000, .jitter_us = 200'000, .duplicate = 0.2});
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 3; ++i) team.publish(i, 3, round % 6);
    team.run(kSecond / 2);
  }
  REQUIRE(team.settle(60 * kSecond));
  for (int i = 0; i < 3; ++i) {
    CHECK(team.report(i).ended_contributions == 0);
    CHECK(team.report(i).twins == 0);
    CHECK(team.report(i).impostors == 0);
    CHECK_FALSE(team.robot(i).exchange().overtaken());
  }
}

TEST_CASE("unsigned: ranges that somebody says are empty hide nothing that is there") {
  Forged team(596, 3);
  Forger relay(9);
  const auto lie = [&](std::uint32_t first, std::uint32_t last) {
    team.say(0, relay.empty_chunk(kOfOne, {first, last}));
  };
  // More wide ranges beyond the last version than coverage keeps.
  for (std::uint32_t i = 0; i < 1100; ++i) lie(100'000 + 2'000 * i, 101'000 + 2'000 * i);
  team.switch_off(1);
  team.switch_on(2);
  // And while the newcomer is answered, that there is nothing to send.
  for (int i = 0; i < 500; ++i) {
    lie(1, 5);
    team.run(10'000);
  }
  CHECK(team.report(2).complete == 3);
  CHECK(team.robot(2).replicas().find(kOfOne).ok());
  CHECK(team.robot(0).content_digest() == team.robot(2).content_digest());
}

}  // namespace
}  // namespace tessera::network
