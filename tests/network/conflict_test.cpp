// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot that signs two contents of one version: the proof of it reaches everybody, and what
// follows is what the fleet's policy says (docs/design/exchange.md).
#include <array>

#include "network/forger.hpp"
#include "network/team.hpp"
#include "tessera/exchange/conflicts.hpp"

namespace tessera::network {
namespace {

constexpr std::uint32_t kLiar = 9;

ExchangeConfig with(ConflictPolicy policy) {
  ExchangeConfig config;
  config.conflicts = policy;
  return config;
}

std::unique_ptr<Robot> process_of(std::uint32_t robot, std::uint32_t epoch,
                                  const ExchangeConfig& config, std::uint32_t random_bits) {
  return std::make_unique<Robot>(robot, epoch, Network::default_replicas(), config,
                                 RobotOptions{.key = robot, .random_bits = random_bits});
}

/// Robot 9 says one thing to robot 0 and another one to robot 1, in the same versions of an epoch.
void lie(Team& team, std::uint32_t epoch, const ExchangeConfig& config) {
  for (const int face : {0, 1}) {
    const auto liar = process_of(kLiar, epoch, config, static_cast<std::uint32_t>(face));
    for (int x = 0; x < 20; ++x) REQUIRE(liar->publish(*pack({x, 9, 0}), team.random(), 20).ok());
    for (const auto& datagram : said(*liar, 0, 2 * kSecond)) team.say(face, datagram);
  }
}

bool holds(Team& team, int robot, const ContributionId& id) {
  return team.robot(robot).replicas().find(id).ok();
}

TEST_CASE("conflict: the proof reaches everybody, also who comes later, whatever is lost") {
  const double loss = GENERATE(0.0, 0.5);
  Team team(4, 580, true, {.loss = loss});
  team.switch_off(3);
  lie(team, 1, {});
  REQUIRE(team.settle(60 * kSecond));
  team.switch_on(3);
  team.run(5 * kSecond);
  REQUIRE(team.settle(60 * kSecond));
  // They may agree before the last one has the proof.
  const auto all_know = [&] {
    bool know = true;
    for (int i = 0; i < 4; ++i) know = know && team.report(i).conflict_proofs == 1;
    return know;
  };
  for (int s = 0; s < 30 && !all_know(); ++s) team.run(kSecond);
  for (int i = 0; i < 4; ++i) {
    CHECK(team.report(i).conflict_proofs == 1);
    CHECK(team.report(i).conflicts > 0);
    // By the policy alarm one of the two contents counts, everywhere the same.
    CHECK(holds(team, i, {kLiar, 1, 0}));
    CHECK(team.robot(i).content_digest() == team.robot(0).content_digest());
  }
}

TEST_CASE("conflict: the policy exclude ends the epoch everywhere, and gives its places back") {
  const ExchangeConfig config = with(ConflictPolicy::kExclude);
  Team team(4, 581, true, {}, config);
  team.switch_off(3);
  team.publish(0, 5);
  lie(team, 1, config);
  team.run(3 * kSecond);
  team.switch_on(3);
  // A newcomer that hears the liar first.
  const auto liar = process_of(kLiar, 1, config, 7);
  REQUIRE(liar->publish(*pack({0, 9, 0}), team.random(), 20).ok());
  for (const auto& datagram : said(*liar, 0, kSecond)) team.say(3, datagram);
  REQUIRE(team.settle(20 * kSecond));
  for (int i = 0; i < 4; ++i) {
    CHECK_FALSE(holds(team, i, {kLiar, 1, 0}));
    CHECK(team.report(i).conflict_proofs == 1);
    CHECK(team.report(i).banned == 0);
    CHECK(team.robot(i).replicas().usage().replica_blocks == 5);
  }
  // What it says in another epoch counts.
  const auto later = process_of(kLiar, 2, config, 8);
  REQUIRE(later->publish(*pack({0, 9, 0}), team.random(), 20).ok());
  for (const auto& datagram : said(*later, 0, kSecond)) team.say(2, datagram);
  REQUIRE(team.settle(20 * kSecond));
  CHECK(holds(team, 0, {kLiar, 2, 0}));
}

TEST_CASE("conflict: the third proof excludes the robot") {
  const ExchangeConfig config = with(ConflictPolicy::kExclude);
  Team team(4, 582, true, {}, config);
  team.switch_off(3);
  for (const std::uint32_t epoch : {1U, 2U, 3U}) {
    CHECK(team.report(2).banned == 0);
    lie(team, epoch, config);
    team.run(10 * kSecond);
  }
  const auto liar = process_of(kLiar, 4, config, 0);
  REQUIRE(liar->publish(*pack({0, 9, 0}), team.random(), 20).ok());
  const auto all = said(*liar, 0, kSecond);
  for (int i = 0; i < 3; ++i) {
    CHECK(team.report(i).conflict_proofs == 3);
    CHECK(team.report(i).banned == 1);
    for (const auto& datagram : all) team.say(i, datagram);
    CHECK_FALSE(holds(team, i, {kLiar, 4, 0}));
    CHECK(team.report(i).refused_excluded > 0);
    // The list that an operator gives is another one.
    CHECK(team.robot(i).exchange().excluded().empty());
  }
  // Who comes later hears the robot first, and then the proofs of what it did before.
  team.switch_on(3);
  for (const auto& datagram : all) team.say(3, datagram);
  CHECK(holds(team, 3, {kLiar, 4, 0}));
  team.run(10 * kSecond);
  CHECK(team.report(3).banned == 1);
  CHECK_FALSE(holds(team, 3, {kLiar, 4, 0}));
}

TEST_CASE("conflict: a robot whose epoch was ended goes on in one above") {
  const ExchangeConfig config = with(ConflictPolicy::kExclude);
  Team team(3, 583, true, {}, config);
  team.publish(2, 5);
  REQUIRE(team.settle(10 * kSecond));
  // Another process has its key and its epoch.
  const auto twin = process_of(2, 1, config, 77);
  for (int x = 0; x < 5; ++x) REQUIRE(twin->publish(*pack({x, 8, 0}), team.random(), 20).ok());
  for (const auto& datagram : said(*twin, 0, kSecond)) team.say(0, datagram);
  Exchange& origin = team.robot(2).exchange();
  for (int i = 0; i < 500 && !origin.overtaken(); ++i) team.run(kTickUs);
  REQUIRE(origin.overtaken());
  origin.set_floor(*origin.overtaken() + 1);
  REQUIRE(origin.open(2, 0, Matrix34d::Identity()) == Status::kOk);
  team.publish(2, 5);
  REQUIRE(team.settle(20 * kSecond));
  for (const int i : {0, 1}) {
    CHECK_FALSE(holds(team, i, {2, 1, 0}));
    CHECK(holds(team, i, {2, 2, 0}));
  }
  CHECK(team.all_complete());
}

TEST_CASE("conflict: two blocks of one version are one") {
  Team team(3, 584);
  // The same versions, of other blocks.
  for (const int face : {0, 1}) {
    const auto liar = process_of(kLiar, 1, {}, static_cast<std::uint32_t>(face));
    for (int x = 0; x < 20; ++x)
      REQUIRE(liar->publish(*pack({x, 9 + face, 0}), team.random(), 20).ok());
    for (const auto& datagram : said(*liar, 0, 2 * kSecond)) team.say(face, datagram);
  }
  REQUIRE(team.settle(60 * kSecond));
  for (int i = 0; i < 3; ++i) CHECK(team.report(i).conflict_proofs == 1);
  CHECK(team.robot(0).content_digest() == team.robot(1).content_digest());
  CHECK(team.robot(0).content_digest() == team.robot(2).content_digest());
}

TEST_CASE("conflict: what is no proof counts for nothing") {
  const ExchangeConfig config = with(ConflictPolicy::kExclude);
  Team team(2, 585, true, {}, config);
  team.publish(0, 5);
  team.publish(1, 5);
  REQUIRE(team.settle(10 * kSecond));
  ToySignatures key(0);
  ToySignatures other(1);
  const ContributionId id{0, 1, 0};
  const auto details = [&] {
    ConfigurationDetails of = details_of_network();
    of.conflicts = ConflictPolicy::kExclude;
    return of;
  }();
  const auto side = [&](ToySignatures& by, const RecordFacts& facts,
                        std::array<std::byte, kMostProofBytes>& proof) {
    const Signatures signatures = by.signatures();
    HashTree tree;
    tree.add(leaf_of(signatures, id, facts));
    Signature signature{};
    signatures.sign(signatures.context,
                    root_message(details.checksum(), id, 1, tree.root(signatures)), signature);
    return ConflictBody::Side{
        .record = facts,
        .statement = {},
        .proof = std::span<const std::byte>(proof).first(write_proof(tree, 0, signature, proof))};
  };
  const auto say = [&](const ConflictBody& conflict) {
    Forger forger(77);
    auto datagram = forger.datagram(DatagramKind::kConflict,
                                    [&](ByteWriter& to) { REQUIRE(write_conflict(to, conflict)); });
    datagram[3] |= std::byte{0x80};
    ByteWriter configuration(std::span<std::byte>(datagram).subspan(8, 4));
    configuration.u32(details.checksum());
    Forger::seal(datagram);
    team.say(1, datagram);
  };
  std::array<std::array<std::byte, kMostProofBytes>, 2> proofs{};
  const RecordFacts one{.version = 3, .first = 3, .layers = 15, .block = {1, 2, 3}};
  RecordFacts two = one;
  two.block.x = 7;
  const RecordFacts later{.version = 4, .first = 4, .layers = 15, .block = {1, 2, 3}};
  const std::uint64_t refused = team.report(1).refused_signature;
  // The same twice; two versions; one side signed by another robot.
  say({.id = id, .side = {side(key, one, proofs[0]), side(key, one, proofs[1])}});
  say({.id = id, .side = {side(key, one, proofs[0]), side(key, later, proofs[1])}});
  say({.id = id, .side = {side(key, one, proofs[0]), side(other, two, proofs[1])}});
  CHECK(team.report(1).refused_signature == refused + 3);
  CHECK(team.report(1).conflict_proofs == 0);
  CHECK(holds(team, 1, id));
  // And one that is.
  say({.id = id, .side = {side(key, one, proofs[0]), side(key, two, proofs[1])}});
  CHECK(team.report(1).conflict_proofs == 1);
  CHECK_FALSE(holds(team, 1, id));
}

TEST_CASE("conflict: a fleet that does not sign counts it and has no proof") {
  Team team(2, 586, false);
  for (const int face : {0, 1}) {
    Robot liar(kLiar, 1, Network::default_replicas(), {}, {});
    for (int x = 0; x < 20; ++x) REQUIRE(liar.publish(*pack({x, 9, 0}), team.random(), 20).ok());
    for (const auto& datagram : said(liar, 0, 2 * kSecond)) team.say(face, datagram);
  }
  REQUIRE(team.settle(60 * kSecond));
  CHECK(team.report(0).conflicts + team.report(1).conflicts > 0);
  CHECK(team.report(0).conflict_proofs == 0);
}

}  // namespace
}  // namespace tessera::network
