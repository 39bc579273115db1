// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Datagrams of those who mean harm: nothing changes, and each refusal is counted.
#include <catch2/catch.hpp>
#include <cstring>

#include "network/forger.hpp"
#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

std::uint64_t refusals(const ExchangeReport& report) {
  return report.refused_size + report.refused_format + report.refused_mission + report.refused_tag +
         report.refused_signature + report.refused_configuration + report.refused_replay +
         report.refused_robot + report.refused_excluded + report.refused_peers +
         report.refused_body;
}

/// What a network of two said while a few blocks were published.
std::vector<std::vector<std::byte>> recorded(Network& network) {
  std::vector<std::vector<std::byte>> all;
  std::vector<std::byte> datagram(kMostDatagramBytes);
  for (std::int64_t now_us = 0; now_us < 2'000'000; now_us += kTickUs) {
    if (now_us % 200'000 == 0) {
      const auto block = static_cast<std::int32_t>(now_us / 200'000);
      REQUIRE(network.robot(0).publish(*pack({block, 0, 0}), network.random(), 50).ok());
    }
    while (const std::size_t size = network.robot(0).exchange().send(now_us, datagram))
      all.emplace_back(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return all;
}

TEST_CASE("hostile: damaged and made-up datagrams change nothing, and each is counted") {
  Network network(2, {}, oracle::announce_seed(531));
  const std::vector<std::vector<std::byte>> good = recorded(network);
  oracle::Random random(532);
  Exchange& exchange = network.robot(1).exchange();
  for (const auto& datagram : good) exchange.receive(datagram, 2'000'000);
  const std::uint64_t digest = exchange.digest();
  const std::uint64_t content = network.robot(1).content_digest();
  const ExchangeReport before = exchange.report();
  constexpr int kDatagrams = 300000;
  for (int i = 0; i < kDatagrams; ++i) {
    std::vector<std::byte> bytes;
    if (random.below(4) == 0) {
      bytes.resize(static_cast<std::size_t>(random.below(100)));
      for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(256));
      if (bytes.size() > 3 && random.below(2) == 0) std::memcpy(bytes.data(), "TS\2\3", 4);
    } else {
      const auto& original =
          good[static_cast<std::size_t>(random.below(static_cast<int>(good.size())))];
      bytes = original;
      // Changes may undo each other.
      while (bytes == original) {
        for (int change = 1 + random.below(3); change > 0; --change) {
          const auto at = static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())));
          bytes[at] ^= static_cast<std::byte>(1 + random.below(255));
        }
      }
    }
    exchange.receive(bytes, 2'000'000 + i);
  }
  const ExchangeReport after = exchange.report();
  CHECK(refusals(after) - refusals(before) == kDatagrams);
  CHECK(exchange.digest() == digest);
  CHECK(network.robot(1).content_digest() == content);
  CHECK(after.contributions == before.contributions);
}

TEST_CASE("hostile: well tagged bodies of any bytes are read within bounds, and break nothing") {
  Network network(2, {}, oracle::announce_seed(533));
  const std::vector<std::vector<std::byte>> good = recorded(network);
  oracle::Random random(534);
  Exchange& exchange = network.robot(1).exchange();
  for (int i = 0; i < 100000; ++i) {
    std::vector<std::byte> bytes =
        good[static_cast<std::size_t>(random.below(static_cast<int>(good.size())))];
    const std::size_t body = bytes.size() - kHeaderBytes - kTagBytes;
    for (int change = 1 + random.below(4); change > 0 && body > 0; --change) {
      bytes[kHeaderBytes + static_cast<std::size_t>(random.below(static_cast<int>(body)))] =
          static_cast<std::byte>(random.below(3) == 0 ? 255 : random.below(256));
    }
    if (random.below(5) == 0 && body > 0)
      bytes.resize(bytes.size() - static_cast<std::size_t>(random.below(static_cast<int>(body))));
    // A new number each, or it would be taken for a repeat.
    ByteWriter sequence{std::span<std::byte>(bytes).subspan(24, 8)};
    sequence.u64(1000U + static_cast<std::uint32_t>(i));
    Forger::seal(bytes);
    exchange.receive(bytes, 3'000'000 + i);
    std::vector<std::byte> answer(kMostDatagramBytes);
    if (i % 16 == 0) static_cast<void>(exchange.send(3'000'000 + i, answer));
  }
  const ReplicasUsage usage = network.robot(1).replicas().usage();
  CHECK(usage.segments <= Network::default_replicas().segments);
  CHECK(exchange.report().contributions <= 16);
  CHECK(exchange.report().refused_body > 0);
  // It still hears who means well.
  REQUIRE(network.robot(1).publish(*pack({1, 2, 3}), network.random(), 20).ok());
}

TEST_CASE("hostile: what was recorded says nothing new, and who has another map is told apart") {
  Network network(2, {}, oracle::announce_seed(535));
  const std::vector<std::vector<std::byte>> good = recorded(network);
  Exchange& exchange = network.robot(1).exchange();
  for (const auto& datagram : good) exchange.receive(datagram, 2'000'000);
  const std::uint64_t digest = exchange.digest();
  const ExchangeReport before = exchange.report();
  for (const auto& datagram : good) exchange.receive(datagram, 900'000'000);
  CHECK(exchange.digest() == digest);
  CHECK(exchange.report().refused_replay > before.refused_replay);
  CHECK(exchange.report().records_taken == before.records_taken);

  ExchangeConfig finer;
  finer.resolution_m = 0.05;
  Robot other(7, 1, Network::default_replicas(), finer);
  std::vector<std::byte> datagram(kMostDatagramBytes);
  for (std::int64_t now_us = 0; now_us < 1'000'000; now_us += kTickUs) {
    while (const std::size_t size = other.exchange().send(now_us, datagram))
      exchange.receive(std::span(datagram).first(size), now_us);
  }
  CHECK(exchange.report().refused_configuration > 0);
  CHECK(exchange.digest() == digest);
  bool told = false;
  for (const Peer& peer : exchange.peers().all())
    told = told || (peer.robot == 7 && peer.mismatch && peer.mismatch->resolution_m == 0.05);
  CHECK(told);
}

}  // namespace
}  // namespace tessera::network
