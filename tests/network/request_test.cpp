// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// When somebody asks, and what it is answered.
#include <catch2/catch.hpp>
#include <memory>

#include "network/forger.hpp"
#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr ContributionId kFirst{1, 1, 0};

std::unique_ptr<Robot> robot(std::uint32_t number, const ReplicasConfig& replicas,
                             bool signs = false) {
  RobotOptions options;
  if (signs) options.key = number;
  return std::make_unique<Robot>(number, 1, replicas, ExchangeConfig{}, options);
}

std::unique_ptr<Robot> robot(std::uint32_t number, bool signs = false) {
  return robot(number, Network::default_replicas(), signs);
}

/// A request for all versions, by one who has no frame and no statement.
std::vector<std::byte> request(Forger& asker, const ContributionId& of) {
  return asker.datagram(DatagramKind::kRequest, [&](ByteWriter& to) {
    RequestedContribution all{};
    all.type = RequestType::kGaps;
    all.id = of;
    all.count = 1;
    all.gap[0] = {1, kLastVersion};
    REQUIRE(write_requested(to, all));
  });
}

TEST_CASE("request: where nothing is lost nobody asks for what is announced and on its way") {
  Network network(4, {}, oracle::announce_seed(521));
  network.run(5 * kSecond);
  const auto requests = [&] {
    std::uint64_t sum = 0;
    for (int i = 0; i < network.size(); ++i) sum += network.robot(i).exchange().report().requests;
    return sum;
  };
  const std::uint64_t before = requests();
  // Always something waits to be sent, before which announcements go.
  for (int tick = 0; tick < 1000; ++tick) {
    for (int i = 0; i < network.size(); ++i)
      REQUIRE(network.robot(i).publish(*pack({tick % 50, i, 0}), network.random(), 5).ok());
    network.run(kTickUs);
  }
  REQUIRE(network.settle(kSecond));
  CHECK(requests() == before);
}

TEST_CASE("request: a first version that is lost is asked for as any other") {
  Network network(2, {}, oracle::announce_seed(522));
  REQUIRE(network.settle(3 * kSecond));
  network.run(kSecond);
  network.set_link(0, 1, {.loss = 1.0});
  REQUIRE(network.robot(0).publish(*pack({1, 2, 3}), network.random(), 40).ok());
  network.run(kSecond / 10);
  network.set_link(0, 1, {});
  CHECK(network.settle(3 * kSecond));
  CHECK(network.robot(1).exchange().report().diverged == 0);
}

TEST_CASE("request: who has no room asks seldom, also while blocks that it has change") {
  ReplicasConfig small = Network::default_replicas();
  small.blocks = 8;
  const auto origin = robot(1);
  const auto hearer = robot(2, small);
  oracle::Random random(oracle::announce_seed(523));
  std::int64_t now_us = 0;
  const auto publish = [&](std::int32_t x) {
    REQUIRE(origin->publish(*pack({x, 0, 0}), random, 40).ok());
    talk({origin.get(), hearer.get()}, now_us, kSecond / 5);
  };
  for (std::int32_t x = 0; x < 16; ++x) publish(x);
  talk({origin.get(), hearer.get()}, now_us, 30 * kSecond);
  const std::uint64_t before = hearer->exchange().report().requests;
  for (int i = 0; i < 150; ++i) publish(0);
  const std::uint64_t requests = hearer->exchange().report().requests - before;
  INFO(requests << " requests in 30 s");
  CHECK(requests <= 3);
}

TEST_CASE("request: what is held of versions of which nobody stated anything is compared too") {
  const auto a = robot(2);
  const auto b = robot(3);
  Forger origin(1);
  std::int64_t now_us = 0;
  for (Robot* const to : {a.get(), b.get()}) to->exchange().receive(origin.frame(kFirst, 1), 0);
  a->exchange().receive(origin.chunk(kFirst, {7, 7}, {1, 0, 0}, 7), 0);
  b->exchange().receive(origin.chunk(kFirst, {900, 900}, {2, 0, 0}, 900), 0);
  REQUIRE(a->content_digest() != b->content_digest());
  talk({a.get(), b.get()}, now_us, 20 * kSecond);
  CHECK(a->content_digest() == b->content_digest());
  CHECK(a->exchange().digest() == b->exchange().digest());
}

TEST_CASE("request: records that a robot made itself are no reason to answer it more") {
  const auto other = robot(1);
  oracle::Random random(oracle::announce_seed(525));
  for (std::int32_t x = 0; x < 400; ++x) REQUIRE(other->publish(*pack({x, 0, 0}), random, 60).ok());
  const auto asker = robot(2);
  std::int64_t now_us = 0;
  std::uint64_t session = 0;
  for (const auto& datagram : said(*asker, now_us, kSecond)) {
    ByteReader from(datagram);
    DatagramHeader header;
    REQUIRE(read_header(from, header));
    session = header.session;
    other->exchange().receive(datagram, now_us);
  }
  Forger asking(2, session, 1'000'000);
  const auto ask_for = [&](std::int64_t for_us, int blocks) {
    const ExchangeReport before = other->exchange().report();
    for (const std::int64_t until_us = now_us + for_us; now_us < until_us; now_us += kSecond / 10) {
      for (int i = 0; i < blocks; ++i) REQUIRE(asker->publish(*pack({i, 1, 0}), random, 100).ok());
      for (const auto& datagram : said(*asker, now_us, kSecond / 10))
        other->exchange().receive(datagram, now_us);
      other->exchange().receive(request(asking, kFirst), now_us);
      static_cast<void>(said(*other, now_us, kSecond / 10));
    }
    const ExchangeReport after = other->exchange().report();
    CHECK((after.records_taken > before.records_taken) == (blocks != 0));
    return after.answer_bytes - before.answer_bytes;
  };
  static_cast<void>(ask_for(60 * kSecond, 0));
  const std::uint64_t silent = ask_for(20 * kSecond, 0);
  const std::uint64_t publishing = ask_for(20 * kSecond, 40);
  INFO(silent << " bytes while it publishes nothing, " << publishing << " while it does");
  CHECK(publishing < silent + silent / 4);
}

TEST_CASE("request: of an epoch that its robot ended no signature is checked") {
  const auto hearer = robot(2, true);
  oracle::Random random(oracle::announce_seed(526));
  std::vector<std::vector<std::byte>> recorded;
  {
    const auto origin = robot(1, true);
    REQUIRE(origin->publish(*pack({1, 2, 3}), random, 40).ok());
    recorded = said(*origin, 0, 3 * kSecond);
  }
  RobotOptions later;
  later.key = 1;
  later.floor = 2;
  const auto origin =
      std::make_unique<Robot>(1, 2, Network::default_replicas(), ExchangeConfig{}, later);
  std::int64_t now_us = 0;
  talk({origin.get(), hearer.get()}, now_us, 5 * kSecond);
  REQUIRE(hearer->exchange().report().refused_epochs == 0);

  // Robot 3 passes on what is in the recording; frames have no proofs there, so it plays them
  // again.
  const std::uint64_t checks = hearer->signature_checks();
  std::uint64_t passed_on = 0;
  for (auto& datagram : recorded) {
    ByteReader from(datagram);
    DatagramHeader header;
    REQUIRE(read_header(from, header));
    if (header.kind != DatagramKind::kStatement && header.kind != DatagramKind::kFrame) continue;
    if (header.kind == DatagramKind::kStatement) header.sender = 3;
    header.sequence = 1'000 + ++passed_on;
    ByteWriter to(datagram);
    write_header(to, header);
    Forger::seal(datagram);
    hearer->exchange().receive(datagram, now_us);
  }
  REQUIRE(passed_on >= 2);
  CHECK(hearer->exchange().report().refused_epochs == passed_on);
  CHECK(hearer->signature_checks() == checks);
}

}  // namespace
}  // namespace tessera::network
