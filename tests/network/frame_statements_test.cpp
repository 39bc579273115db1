// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Links and priors over a network that loses, repeats and reorders: in the end all robots collect
// the same statements, whoever heard them from whom.
#include <catch2/catch.hpp>
#include <vector>

#include "network/team.hpp"

namespace tessera::network {
namespace {

constexpr Link kBad{.loss = 0.3, .delay_us = 20'000, .jitter_us = 120'000, .duplicate = 0.2};

struct FrameTeam : Team {
  using Team::Team;
  /// As this robot would state one; another one each time.
  [[nodiscard]] FrameLink link(int from, int to) {
    FrameLink link;
    link.from = static_cast<std::uint32_t>(from);
    link.to = static_cast<std::uint32_t>(to);
    link.from_epoch = robot(from).session();
    link.to_epoch = robot(to).session();
    link.revision = ++revision;
    link.T_from_to(0, 3) = random().uniform(-50.0, 50.0);
    return link;
  }
  void state_link(int from, int to) { REQUIRE(robot(from).exchange().state(link(from, to)).ok()); }
  void state_prior(int i, PriorKind kind) {
    REQUIRE(robot(i)
                .exchange()
                .state(StatedPrior{
                    .robot = static_cast<std::uint32_t>(i),
                    .epoch = robot(i).session(),
                    .kind = kind,
                    .covariance = FrameCovariance::isotropic(Point3d::Zero(), 0.5, 0.02)})
                .ok());
  }
  /// All that a robot holds, as bytes.
  [[nodiscard]] std::vector<std::byte> statements(int i) {
    std::vector<FrameLink> links(512);
    std::vector<StatedPrior> priors(64);
    const CollectedStatements found = collect(robot(i).replicas(), links, priors);
    REQUIRE(found.links_left_out + found.priors_left_out == 0);
    std::vector<std::byte> all;
    for (const FrameLink& one : std::span(links).first(found.links)) {
      std::array<std::byte, FrameLink::kBytes> bytes{};
      REQUIRE(encode_link(one, bytes) == Status::kOk);
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
    for (const StatedPrior& one : std::span(priors).first(found.priors)) {
      std::array<std::byte, StatedPrior::kBytes> bytes{};
      REQUIRE(encode_prior(one, bytes) == Status::kOk);
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
    return all;
  }
  [[nodiscard]] bool state_alike() {
    for (int i = 1; i < size(); ++i)
      if (statements(i) != statements(0)) return false;
    return true;
  }
  std::uint32_t revision = 0;
};

constexpr std::size_t bytes_of(std::size_t links, std::size_t priors) {
  return links * FrameLink::kBytes + priors * StatedPrior::kBytes;
}

TEST_CASE("frame statements: over a bad network all hold the same in the end") {
  const bool signs = GENERATE(false, true);
  FrameTeam team(4, 571, signs, kBad);
  for (int round = 0; round < 30; ++round) {
    const int from = team.random().below(4);
    const int to = (from + 1 + team.random().below(3)) % 4;
    team.state_link(from, to);
    if (round % 5 == 0) team.state_prior(from, static_cast<PriorKind>(round / 5 % 3));
    team.publish(from, 1, round);
    team.run(kSecond / 5);
  }
  for (int i = 0; i < 4; ++i) {
    team.state_link(i, (i + 1) % 4);
    team.state_prior(i, PriorKind::kVague);
  }
  REQUIRE(team.settle(60 * kSecond));
  CHECK(team.state_alike());
  CHECK(team.all_complete());
  CHECK(team.statements(0).size() >= bytes_of(4, 4));
  for (int i = 0; i < 4; ++i) {
    CHECK(team.report(i).refused_body == 0);
    CHECK(team.report(i).conflicts == 0);
  }
}

TEST_CASE("frame statements: who joins late hears them from a third one, and believes the author") {
  const bool signs = GENERATE(false, true);
  FrameTeam team(3, 572, signs, kBad);
  team.switch_off(2);
  team.state_prior(0, PriorKind::kExact);
  team.state_link(0, 1);
  team.state_link(0, 1);
  team.state_link(0, 2);
  team.run(20 * kSecond);
  REQUIRE(team.statements(1).size() == bytes_of(2, 1));
  team.switch_off(0);
  team.switch_on(2);
  REQUIRE(team.settle(60 * kSecond));
  CHECK(team.statements(2) == team.statements(0));
}

TEST_CASE(
    "frame statements: a robot that starts anew states anew, and those before stay until "
    "its floor is above them") {
  ExchangeConfig config;
  config.contributions_per_robot = 8;  // maps of all epochs stay
  FrameTeam team(3, 573, true, kBad, config);
  team.state_prior(0, PriorKind::kExact);
  team.state_link(0, 1);
  team.state_link(1, 0);
  REQUIRE(team.settle(60 * kSecond));
  const FrameLink before = team.link(0, 1);
  team.restart(0);
  REQUIRE(team.settle(60 * kSecond));
  CHECK(team.statements(0).size() == bytes_of(2, 1));
  // Nothing is stated of another epoch than that of the maps.
  CHECK(team.robot(0).exchange().state(before).status() == Status::kInvalidArgument);
  team.state_link(0, 2);
  REQUIRE(team.settle(60 * kSecond));
  CHECK(team.statements(2).size() == bytes_of(3, 1));
  CHECK(team.state_alike());
  // Of the newest two epochs, however often it starts.
  for (int i = 0; i < 3; ++i) {
    team.restart(0);
    team.state_link(0, 1);
    REQUIRE(team.settle(60 * kSecond));
  }
  CHECK(team.statements(2).size() == bytes_of(3, 0));
  CHECK(team.state_alike());
  team.restart(0, team.robot(0).session() + 1);
  REQUIRE(team.settle(60 * kSecond));
  CHECK(team.statements(2).size() == bytes_of(1, 0));
  CHECK(team.state_alike());
}

TEST_CASE("frame statements: on a quiet network one arrives within two seconds") {
  const int robots = GENERATE(2, 8);
  FrameTeam team(robots, 574);
  for (int i = 0; i < robots; ++i) team.publish(i, 3);
  REQUIRE(team.settle(20 * kSecond));
  std::int64_t worst_us = 0;
  for (int round = 0; round < 20; ++round) {
    team.run(3 * kSecond + 50'000 * team.random().below(20));
    const int from = team.random().below(robots);
    const std::int64_t stated_us = team.now_us();
    team.state_link(from, (from + 1) % robots);
    while (!team.state_alike()) {
      team.run(kTickUs);
      REQUIRE(team.now_us() - stated_us < 10 * kSecond);
    }
    worst_us = std::max(worst_us, team.now_us() - stated_us);
  }
  WARN(robots << " robots: at most " << static_cast<double>(worst_us) / 1e6 << " s");
  CHECK(worst_us < 2 * kSecond);
}

TEST_CASE("frame statements: nobody states for another, and what has no code is refused") {
  FrameTeam team(3, 575);
  Exchange& exchange = team.robot(1).exchange();
  CHECK(exchange.state(team.link(0, 1)).status() == Status::kInvalidArgument);
  FrameLink bad = team.link(1, 2);
  bad.revision = 0;
  CHECK(exchange.state(bad).status() == Status::kInvalidArgument);
  CHECK(exchange.state(StatedPrior{.robot = 0, .epoch = 1}).status() == Status::kInvalidArgument);
  CHECK(exchange.state(StatedPrior{.robot = 1, .epoch = 2}).status() == Status::kInvalidArgument);
  CHECK(exchange.state(StatedPrior{.robot = 1, .epoch = 1, .kind = PriorKind::kVague}).status() ==
        Status::kInvalidArgument);
  CHECK(team.report(1).contributions == 1);  // none was opened
  // Links to as many as there may be, and the prior beside them; one of those may be replaced.
  for (std::uint32_t to = 2; to < 2 + FrameStatements::kMostLinks; ++to)
    team.state_link(1, static_cast<int>(to) % 2 == 0 ? 2 : 0);
  FrameLink link = team.link(1, 2);
  for (std::uint32_t to = 100; to < 98 + FrameStatements::kMostLinks; ++to) {
    link.to = to;
    REQUIRE(exchange.state(link).ok());
  }
  link.to = 1000;
  CHECK(exchange.state(link).status() == Status::kResourceExhausted);
  team.state_prior(1, PriorKind::kUnknown);
  CHECK(exchange.state(link).status() == Status::kResourceExhausted);
  team.state_link(1, 2);
  team.state_prior(1, PriorKind::kExact);
}

TEST_CASE("frame statements: nothing is published before a map is") {
  AlignedMemory memory(Replicas::required_bytes(Network::default_replicas()) +
                       Exchange::required_bytes({}, kClasses + 2));
  Arena arena = memory.arena();
  Replicas replicas = *Replicas::make(arena, Network::default_replicas());
  Exchange exchange = *Exchange::make(arena, {}, store_of(replicas), crc_authenticator(),
                                      oracle::numbered_classes(kClasses));
  CHECK(exchange.state(StatedPrior{}).status() == Status::kInvalidArgument);
  CHECK(replicas.in_order().empty());
}

}  // namespace
}  // namespace tessera::network
