// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Ten million datagrams of those who have not got the fleet's key, by the seal that robots use.
#include <catch2/catch.hpp>
#include <chrono>
#include <cstring>

#include "link/datagram_seal.hpp"
#include "network/simulated_network.hpp"
#include "support/cloud.hpp"

namespace tessera::network {
namespace {

using Datagram = std::vector<std::byte>;
constexpr std::uint64_t kDatagrams = 10'000'000;

DatagramSeal seal_of(unsigned char secret) {
  SecretKey key;
  key.bytes().fill(secret);
  const Outcome<Mission> mission = Mission::make("flood");
  REQUIRE(mission.ok());
  Outcome<DatagramSeal> seal = DatagramSeal::make(key, *mission, KeyUse::kDatagram);
  REQUIRE(seal.ok());
  return std::move(*seal);
}

std::uint64_t refusals(const ExchangeReport& report) {
  return report.refused_size + report.refused_format + report.refused_tag + report.refused_mission +
         report.refused_signature + report.refused_configuration + report.refused_replay +
         report.refused_robot + report.refused_excluded + report.refused_peers +
         report.refused_body + report.own_echoes;
}

bool is_data(const Datagram& datagram) {
  const auto kind = static_cast<DatagramKind>(datagram[3]);
  return kind == DatagramKind::kChunk || kind == DatagramKind::kFrame ||
         kind == DatagramKind::kStatement;
}

/// What a robot says while it publishes for two seconds.
std::vector<Datagram> recorded(Robot& robot, oracle::Random& random) {
  std::vector<Datagram> all;
  Datagram datagram(kMostDatagramBytes);
  for (std::int64_t now_us = 0; now_us < 2'000'000; now_us += kTickUs) {
    if (now_us % 200'000 == 0) {
      const auto block = static_cast<std::int32_t>(now_us / 200'000);
      REQUIRE(robot.publish(*pack({block, 0, 0}), random, 50).ok());
    }
    while (const std::size_t size = robot.exchange().send(now_us, datagram))
      all.emplace_back(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return all;
}

Datagram at_random(oracle::Random& random) {
  Datagram bytes(static_cast<std::size_t>(random.below(100)));
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(256));
  if (bytes.size() > 3 && random.below(2) == 0) {
    const std::array<std::byte, 4> header{std::byte{'T'}, std::byte{'S'}, std::byte{1},
                                          static_cast<std::byte>(1 + random.below(5))};
    std::copy(header.begin(), header.end(), bytes.begin());
  }
  return bytes;
}

/// Other bytes, or another length.
Datagram changed(const Datagram& original, oracle::Random& random) {
  Datagram bytes = original;
  if (random.below(16) == 0) {
    const auto size = static_cast<std::size_t>(random.below(1500));
    bytes.resize(size == bytes.size() ? size + 1 : size);
    return bytes;
  }
  // Changes may undo each other.
  while (bytes == original) {
    for (int change = 1 + random.below(3); change > 0; --change) {
      const auto at = static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())));
      bytes[at] ^= static_cast<std::byte>(1 + random.below(255));
    }
  }
  return bytes;
}

/// In the name of any robot and session, with a number that was never heard, by another key.
Datagram forged(const Datagram& original, const DatagramSeal& seal, oracle::Random& random) {
  Datagram bytes = original;
  ByteWriter sender{std::span<std::byte>(bytes).subspan(12, 20)};
  sender.u32(static_cast<std::uint32_t>(random.below(4)));
  sender.u64(static_cast<std::uint64_t>(1 + random.below(3)) << 32U);
  sender.u64(static_cast<std::uint64_t>(1'000'000 + random.below(1'000'000)));
  const std::span<std::byte> all(bytes);
  seal.tag(all.first(all.size() - kTagBytes), all.last<kTagBytes>());
  return bytes;
}

TEST_CASE("hostile: ten million datagrams without the key change nothing, and each is counted") {
  oracle::Random random(oracle::announce_seed(541));
  DatagramSeal fleet = seal_of(1);
  const DatagramSeal stranger = seal_of(2);
  const ReplicasConfig replicas = Network::default_replicas();
  Robot speaker(0, 1, replicas, {}, {.authenticator = fleet.authenticator()});
  Robot robot(1, 1, replicas, {}, {.authenticator = fleet.authenticator()});
  const std::vector<Datagram> good = recorded(speaker, random);
  Exchange& exchange = robot.exchange();
  // Twice: a chunk that came before its frame is heard the second time.
  for (int time = 0; time < 2; ++time) {
    for (const Datagram& datagram : good) exchange.receive(datagram, 2'000'000);
  }
  REQUIRE(robot.content_digest() != Robot(1, 1, replicas, {}).content_digest());
  const std::uint64_t digest = exchange.digest();
  const std::uint64_t content = robot.content_digest();
  const ExchangeReport before = exchange.report();
  std::uint64_t heard = 0;
  const auto start = std::chrono::steady_clock::now();
  for (std::uint64_t i = 0; i < kDatagrams; ++i) {
    const Datagram& original =
        good[static_cast<std::size_t>(random.below(static_cast<int>(good.size())))];
    const std::int64_t now_us = 2'000'000 + static_cast<std::int64_t>(i);
    switch (random.below(8)) {
      case 0:
      case 1:
        exchange.receive(at_random(random), now_us);
        break;
      case 2:
        // Blocks and frames are told from older ones by their versions, not refused.
        heard += is_data(original) ? 1U : 0U;
        exchange.receive(original, now_us);
        break;
      case 3:
        exchange.receive(forged(original, stranger, random), now_us);
        break;
      default:
        exchange.receive(changed(original, random), now_us);
    }
  }
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  const ExchangeReport after = exchange.report();
  CHECK(after.received - before.received == kDatagrams);
  CHECK(refusals(after) - refusals(before) == kDatagrams - heard);
  CHECK(exchange.digest() == digest);
  CHECK(robot.content_digest() == content);
  CHECK(after.records_taken == before.records_taken);
  CHECK(after.contributions == before.contributions);
  CHECK(after.peers == before.peers);
  CHECK(after.waiting_answers == before.waiting_answers);
  WARN(kDatagrams << " datagrams in " << elapsed.count() << " s: " << heard
                  << " recorded ones that are no news; refused by size "
                  << after.refused_size - before.refused_size << ", format "
                  << after.refused_format - before.refused_format << ", tag "
                  << after.refused_tag - before.refused_tag << ", as replayed "
                  << after.refused_replay - before.refused_replay);
}

}  // namespace
}  // namespace tessera::network
