// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A newcomer lacks 13 MB of records and proofs of a robot that is gone, and one robot answers,
// while a member asks for everything again and again: what the newcomer waits for is the budget.
#include <catch2/catch.hpp>

#include "network/forger.hpp"
#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::uint32_t kOrigin = 7;
constexpr std::uint32_t kAttacker = 9;
constexpr int kKnows = 0;
constexpr int kNewcomer = 1;
constexpr double kWantedBytes = 13e6;
constexpr std::int32_t kBlocksAside = 256;

ReplicasConfig large() {
  return {
      .segments = 1U << 19U, .blocks = 1U << 16U, .contributions = 8, .robot_segments = 1U << 19U};
}

/// The origin publishes until there is so much, the one that knows hears all, and the origin is
/// gone. Returns the bytes of the records and their proofs.
double teach(Network& network) {
  ExchangeConfig config;
  config.contributions = large().contributions;
  config.bytes_per_s = 100'000'000;
  config.burst_bytes = 100'000'000;
  Robot origin(kOrigin, 1, large(), config, {.key = kOrigin});
  Robot& knows = network.robot(kKnows);
  const Replicas& held = knows.replicas();
  std::vector<std::byte> record(kMostDatagramBytes);
  const auto held_bytes = [&] {
    double bytes = 0.0;
    const Replicas::Slot slot = *held.find({kOrigin, 1, 0});
    for (std::uint32_t at = held.contribution(slot).first_block; at != 0;
         at = held.record(at).next) {
      // The first byte is the length of the proof, which is not sent.
      if (held.record(at).live != 0)
        bytes += static_cast<double>(held.read_wire(held.record(at), record).size()) - 1.0;
    }
    return bytes;
  };
  std::int64_t now_us = 0;
  for (std::int32_t published = 0;;) {
    for (int i = 0; i < 1000; ++i, ++published) {
      const auto key = *pack({published % kBlocksAside, published / kBlocksAside, 0});
      REQUIRE(origin.publish(key, network.random(), 20).ok());
    }
    now_us += 2 * kSecond;
    for (const auto& datagram : said(origin, now_us, 1))
      knows.exchange().receive(datagram, Network::clock_us(kKnows, 0));
    if (const double bytes = held_bytes(); bytes >= kWantedBytes) {
      WARN(published << " records, " << bytes / published << " bytes each");
      REQUIRE(knows.exchange().report().complete == 2);
      return bytes;
    }
  }
}

void measure(double loss, double most) {
  Network network(2, {}, oracle::announce_seed(720), large(), {}, true);
  network.switch_off(kNewcomer);
  const double budget_s = teach(network) / ExchangeConfig{}.bytes_per_s;
  network.run(5 * kSecond);
  network.set_link({.loss = loss});
  network.switch_on(kNewcomer);
  const std::int64_t begin_us = network.now_us();
  std::uint64_t sequence = 0;
  double seconds = 0.0;
  bool agree = false;
  while (!agree && seconds < 10.0 * budget_s) {
    const auto attack =
        Forger::request_for_all(kAttacker, std::uint64_t{1} << 32U, ++sequence, {kOrigin, 1, 0});
    for (int i = 0; i < network.size(); ++i)
      network.robot(i).exchange().receive(attack, Network::clock_us(i, network.now_us()));
    network.run(kSecond / 20);
    seconds = 1e-6 * static_cast<double>(network.now_us() - begin_us);
    agree = network.agree();
  }
  WARN("loss " << loss << ": " << seconds << " s, " << seconds / budget_s << " times the budget");
  REQUIRE(agree);
  CHECK(seconds <= most * budget_s);
}

TEST_CASE("newcomer: 13 MB come within 1.3 times what the budget takes, while a member asks") {
  measure(0.0, 1.3);
}

// What is lost has to go again: 1.43 times as much as without loss.
TEST_CASE("newcomer: with three of ten datagrams lost within 1.9 times") { measure(0.3, 1.9); }

}  // namespace
}  // namespace tessera::network
