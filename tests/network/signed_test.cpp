// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// With signatures no robot speaks for another, though it has the fleet's key and passes on what the
// other said.
#include <algorithm>
#include <catch2/catch.hpp>

#include "network/forger.hpp"
#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;

struct Team : Network {
  Team(int robots, const Link& link, std::uint64_t seed)
      : Network(robots, link, oracle::announce_seed(seed), default_replicas(), {}, true) {}
  /// Each robot that is on publishes so many blocks, one a tenth of a second.
  void publish(int blocks, const std::vector<int>& robots) {
    for (int block = 0; block < blocks; ++block) {
      for (const int i : robots) {
        const int x = random().below(40);
        const int voxels = 1 + random().below(200);
        REQUIRE(robot(i).publish(*pack({x, i, 0}), random(), voxels).ok());
      }
      run(kSecond / 10);
    }
  }
};

bool is_chunk(const std::vector<std::byte>& datagram) {
  return (datagram[3] & std::byte{0x7f}) == std::byte{3};
}

TEST_CASE(
    "signatures: a team over a bad network agrees, late joiners hear of robots that are gone") {
  Team team(4, {.loss = 0.1, .jitter_us = 80'000, .duplicate = 0.05, .corrupt = 0.02}, 561);
  team.switch_off(3);
  team.publish(40, {0, 1, 2});
  team.restart(1);
  team.publish(10, {0, 1, 2});
  REQUIRE(team.settle(120 * kSecond));
  team.switch_off(0);
  team.switch_off(1);
  team.switch_on(3);
  REQUIRE(team.settle(120 * kSecond));
  const Replicas& late = team.robot(3).replicas();
  for (const ContributionId id : {ContributionId{0, 1, 0}, {1, 1, 0}, {1, 2, 0}, {2, 1, 0}})
    CHECK(late.contribution(*late.find(id)).blocks > 0);
  for (int i = 0; i < 4; ++i) CHECK(team.robot(i).exchange().report().refused_signature == 0);
}

TEST_CASE("signatures: one check does for all records that were signed together") {
  Team team(2, {}, 562);
  team.publish(1, {0});
  for (int i = 0; i < 200; ++i)
    REQUIRE(team.robot(0).publish(*pack({i, 5, 0}), team.random(), 5).ok());
  REQUIRE(team.settle(10 * kSecond));
  const ExchangeReport report = team.robot(1).exchange().report();
  CHECK(report.records_taken >= 200);
  CHECK(team.robot(1).signature_checks() < report.records_taken / 4);
}

TEST_CASE("signatures: what is heard again is not checked again") {
  Team team(2, {}, 566);
  for (int i = 0; i < 40; ++i)
    REQUIRE(team.robot(0).publish(*pack({i, 5, 0}), team.random(), 5).ok());
  const auto all = said(team.robot(0), 0, 5 * kSecond);
  CHECK(std::any_of(all.begin(), all.end(), is_chunk));
  Exchange& exchange = team.robot(1).exchange();
  for (const auto& datagram : all) exchange.receive(datagram, 0);
  CHECK(exchange.report().records_taken == 40);
  const std::uint64_t before = team.robot(1).signature_checks();
  for (const auto& datagram : all) exchange.receive(datagram, 1);
  CHECK(team.robot(1).signature_checks() == before);
}

TEST_CASE("signatures: nothing that a robot said can be changed by who has the fleet's key") {
  Team team(2, {}, 567);
  for (int i = 0; i < 40; ++i)
    REQUIRE(team.robot(0).publish(*pack({i, 5, 0}), team.random(), 5).ok());
  const auto all = said(team.robot(0), 0, 5 * kSecond);
  Exchange& exchange = team.robot(1).exchange();
  for (const auto& datagram : all) exchange.receive(datagram, 0);
  const std::uint64_t content = team.robot(1).content_digest();
  oracle::Random& random = team.random();
  for (int round = 0; round < 20'000; ++round) {
    std::vector<std::byte> changed =
        all[static_cast<std::size_t>(random.below(static_cast<int>(all.size())))];
    const auto end = static_cast<int>(changed.size() - kTagBytes);
    const int first = static_cast<int>(kHeaderBytes);
    changed[static_cast<std::size_t>(first + random.below(end - first))] ^=
        static_cast<std::byte>(1 + random.below(255));
    ByteWriter sequence{std::span<std::byte>(changed).subspan(24, 8)};
    sequence.u64(1000U + static_cast<std::uint64_t>(round));
    Forger::seal(changed);
    exchange.receive(changed, kSecond + round);
  }
  CHECK(team.robot(1).content_digest() == content);
  CHECK(exchange.report().refused_signature > 5'000);
}

TEST_CASE("signatures: what was signed of another map is not taken for this one") {
  Team team(1, {}, 568);
  ExchangeConfig finer;
  finer.resolution_m = 0.05;
  Robot other(5, 1, Network::default_replicas(), finer, {.key = 5});
  REQUIRE(other.publish(*pack({1, 2, 3}), team.random(), 20).ok());
  for (std::vector<std::byte> datagram : said(other, 0, 5 * kSecond)) {
    ByteWriter configuration{std::span<std::byte>(datagram).subspan(8, 4)};
    configuration.u32(details_of_network().checksum());
    Forger::seal(datagram);
    team.robot(0).exchange().receive(datagram, 0);
  }
  CHECK(team.robot(0).exchange().report().refused_signature > 2);
  CHECK(team.robot(0).exchange().report().records_taken == 0);
  CHECK_FALSE(team.robot(0).replicas().find({5, 1, 0}).ok());
}

TEST_CASE("signatures: a record of any size can be passed on, beside whatever it was signed with") {
  Team team(3, {.loss = 0.1}, 569);
  team.switch_off(2);
  oracle::Random& random = team.random();
  std::size_t longest = 0;
  for (int i = 0; i < 600; ++i) {
    const int voxels = i % 4 == 0 ? 600 + random.below(1500) : 1 + random.below(5);
    const Result<std::uint32_t> bytes = team.robot(0).publish(*pack({i, 0, 0}), random, voxels);
    REQUIRE(bytes.ok());
    longest = std::max<std::size_t>(longest, *bytes);
    if (i % 20 == 0) team.run(kSecond / 10);
  }
  CHECK(longest > kMostCodedBytes);  // So there are parts, and wholes just below.
  REQUIRE(team.settle(60 * kSecond));
  team.switch_off(0);
  team.switch_on(2);
  REQUIRE(team.settle(60 * kSecond));
  CHECK(team.robot(2).exchange().report().refused_body == 0);
}

TEST_CASE("signatures: who signs by another key is not heard in a robot's name") {
  Team team(2, {}, 563);
  team.publish(10, {0, 1});
  REQUIRE(team.settle(10 * kSecond));
  Exchange& exchange = team.robot(0).exchange();
  const std::uint64_t digest = exchange.digest();
  const std::uint64_t content = team.robot(0).content_digest();
  // Robot 2, which has the fleet's key, says it were robot 1, in a session that is newer.
  Robot forger(1, 9, Network::default_replicas(), {}, {.key = 2});
  REQUIRE(forger.exchange().open(1, 0, Matrix34d::Identity()) == Status::kOk);
  for (int i = 0; i < 30; ++i) REQUIRE(forger.publish(*pack({i, 1, 0}), team.random(), 40).ok());
  const auto datagrams = said(forger, team.now_us(), 3 * kSecond);
  for (const auto& datagram : datagrams) exchange.receive(datagram, team.now_us());
  const ExchangeReport report = exchange.report();
  CHECK(report.refused_signature > datagrams.size() / 2);
  CHECK(team.robot(0).content_digest() == content);
  CHECK(exchange.digest() == digest);
  // Nor does the robot itself seem to have started anew.
  team.publish(3, {1});
  REQUIRE(team.settle(10 * kSecond));
}

TEST_CASE("signatures: what is passed on is what its origin said, or nothing") {
  Team team(3, {}, 564);
  team.publish(20, {0});
  REQUIRE(team.settle(10 * kSecond));
  team.switch_off(0);
  team.restart(2);
  // What robot 1 answers to the one that knows nothing.
  std::vector<std::vector<std::byte>> passed_on;
  std::vector<std::byte> datagram(kMostDatagramBytes);
  for (std::int64_t now_us = 0; now_us < 5 * kSecond; now_us += kTickUs) {
    const std::int64_t at_us = team.now_us() + now_us;
    while (const std::size_t size =
               team.robot(2).exchange().send(Network::clock_us(2, at_us), datagram))
      team.robot(1).exchange().receive(std::span(datagram).first(size),
                                       Network::clock_us(1, at_us));
    while (const std::size_t size =
               team.robot(1).exchange().send(Network::clock_us(1, at_us), datagram)) {
      passed_on.emplace_back(datagram.begin(),
                             datagram.begin() + static_cast<std::ptrdiff_t>(size));
      if (!is_chunk(passed_on.back()))
        team.robot(2).exchange().receive(passed_on.back(), Network::clock_us(2, at_us));
    }
  }
  std::uint64_t taken = 0;
  oracle::Random& random = team.random();
  for (int round = 0; round < 20'000; ++round) {
    std::vector<std::byte> changed =
        passed_on[static_cast<std::size_t>(random.below(static_cast<int>(passed_on.size())))];
    if (!is_chunk(changed)) continue;
    // Within the records: the range is said by whoever passes them on.
    const std::size_t first = kHeaderBytes + 21;
    const int within = static_cast<int>(changed.size() - first - kTagBytes);
    changed[first + static_cast<std::size_t>(random.below(within))] ^=
        static_cast<std::byte>(1 + random.below(255));
    Forger::seal(changed);
    team.robot(2).exchange().receive(changed, Network::clock_us(2, team.now_us() + 6 * kSecond));
    taken = team.robot(2).exchange().report().records_taken;
  }
  CHECK(team.robot(2).exchange().report().refused_signature > 20);
  CHECK(taken > 0);
  // Each record that was taken is as robot 1 has it.
  const Replicas& heard = team.robot(2).replicas();
  const Replicas& known = team.robot(1).replicas();
  const Replicas::Slot heard_slot = *heard.find({0, 1, 0});
  const Replicas::Slot known_slot = *known.find({0, 1, 0});
  std::vector<std::byte> a(1U << 14U);
  std::vector<std::byte> b(1U << 14U);
  for (std::uint32_t at = heard.contribution(heard_slot).first_block; at != 0;
       at = heard.record(at).next) {
    const Replicas::Replica& part = heard.record(at);
    if (part.live == 0) continue;
    const Replicas::Replica* same = known.find(known_slot, {part.key});
    while (same != nullptr && same->version != part.version) same = known.next_part(*same);
    REQUIRE(same != nullptr);
    const auto bytes = heard.read(part, a);
    const auto wanted = known.read(*same, b);
    CHECK(std::equal(bytes.begin(), bytes.end(), wanted.begin(), wanted.end()));
  }
}

TEST_CASE("signatures: who passes on what is known with false proofs ends nobody's answer") {
  Team team(2, {}, 570);
  team.publish(20, {0});
  REQUIRE(team.settle(10 * kSecond));
  Exchange& exchange = team.robot(1).exchange();
  const std::int64_t now_us = Network::clock_us(1, team.now_us());
  constexpr std::uint32_t kAsker = 2;
  constexpr std::uint64_t kSession = std::uint64_t{1} << 40U;
  const auto request = Forger::request_for_all(kAsker, kSession, 1, {0, 1, 0});
  exchange.receive(request, now_us);
  std::vector<std::vector<std::byte>> chunks = said(team.robot(1), now_us, 3 * kSecond);
  chunks.erase(std::remove_if(chunks.begin(), chunks.end(),
                              [](const auto& datagram) { return !is_chunk(datagram); }),
               chunks.end());
  REQUIRE_FALSE(chunks.empty());
  exchange.receive(Forger::request_for_all(kAsker, kSession, 2, {0, 1, 0}), now_us + 3 * kSecond);
  std::uint64_t sequence = 0;
  const auto pass_on = [&](std::vector<std::byte> chunk) {
    ByteWriter sender{std::span<std::byte>(chunk).subspan(12, 20)};
    sender.u32(3);
    sender.u64(kSession);
    sender.u64(++sequence);
    Forger::seal(chunk);
    exchange.receive(chunk, now_us + 3 * kSecond);
  };
  for (const auto& chunk : chunks) {
    // Within the records: a range that ends sooner is as good.
    for (std::size_t at = kHeaderBytes + 21; at < chunk.size() - kTagBytes; ++at) {
      std::vector<std::byte> changed = chunk;
      changed[at] ^= static_cast<std::byte>(1 + team.random().below(255));
      pass_on(changed);
    }
  }
  CHECK(sequence > 1'000);
  CHECK(exchange.report().answers_saved == 0);
  for (const auto& chunk : chunks) pass_on(chunk);
  CHECK(exchange.report().answers_saved > 0);
}

TEST_CASE("signatures: fleets with and without them do not hear each other") {
  Team team(1, {}, 565);
  Robot without(5, 1, Network::default_replicas(), {});
  for (const auto& datagram : said(team.robot(0), 0, 2 * kSecond))
    without.exchange().receive(datagram, 0);
  for (const auto& datagram : said(without, 0, 2 * kSecond))
    team.robot(0).exchange().receive(datagram, 0);
  for (const Robot* robot : {&team.robot(0), &without}) {
    const ExchangeReport report = robot->exchange().report();
    CHECK(report.refused_signature == report.received);
    CHECK(report.contributions == 1);
  }
}

}  // namespace
}  // namespace tessera::network
