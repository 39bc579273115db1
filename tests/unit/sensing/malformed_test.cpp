// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Messages that nobody meant, over a real network.
#include <array>
#include <catch2/catch.hpp>
#include <random>

#include "unit/sensing/port_bench.hpp"

namespace tessera {
namespace {

TEST_CASE("SensorPort: 10,000 malformed messages are each counted, and the next scan is heard") {
  if (!enter_own_network()) return;
  SensorPortConfig config = port_config();
  config.matcher.slot.points = 100;
  const auto port = open_port(config);
  const auto sender = open_sender();
  constexpr unsigned kSeed = 12;
  INFO("seed " << kSeed);
  std::mt19937 random(kSeed);
  const std::vector<std::byte> good = SampleSweep(50, 1).message(port->stamp_now_us());
  const std::array<const char*, 6> channels{"TESSERA_SEMANTIC_CLOUD", "TESSERA_CLOUD",
                                            "TESSERA_LABEL_IMAGE",    "TESSERA_DEPTH_IMAGE",
                                            "TESSERA_POSE",           "ANYTHING"};
  for (int i = 0; i < 10'000; ++i) {
    std::vector<std::byte> bad = good;
    // The fingerprint is right now and then, so that what is behind it is looked at.
    for (int changes = 1 + static_cast<int>(random() % 8); changes > 0; --changes) {
      const std::size_t at = random() % 2 == 0 ? 8 + random() % 28 : random() % bad.size();
      bad[at] = static_cast<std::byte>(random());
    }
    if (random() % 2 == 0) bad.resize(1 + random() % bad.size());
    REQUIRE(sender->send(channels[random() % channels.size()], bad));
    if (i % 16 == 0) port->step(0);
  }
  const auto seen = [&] { return port->report().link.messages; };
  REQUIRE(eventually_stepped(*port, [&] { return seen() == 10'000; }));
  const SensorReport r = port->report();
  std::uint64_t counted = r.other_channel + r.poses_invalid;
  for (const std::uint64_t fault : r.faults) counted += fault;
  const MatchReport& m = r.match;
  counted += m.given + m.unknown_sensor + m.scans.future + m.scans.ancient + m.duplicates +
             m.out_of_order + m.without_pose + m.superseded;
  // All but those that wait: at most as many as may.
  CHECK(counted <= 10'000);
  CHECK(counted + config.matcher.pending_scans >= 10'000);
  const std::int64_t now_us = port->stamp_now_us();
  REQUIRE(sender->send("TESSERA_POSE", pose_message(now_us - 2'000, 1)));
  REQUIRE(sender->send("TESSERA_SEMANTIC_CLOUD", SampleSweep(50, 3).message(now_us)));
  REQUIRE(sender->send("TESSERA_POSE", pose_message(now_us, 2)));
  const SampleSweep last(50, 3);
  CHECK(eventually_stepped(*port, [&] {
    Scan* const slot = port->front();
    if (slot == nullptr) return false;
    const bool is_last = last.is_in(*slot);
    port->pop();
    return is_last;
  }));
}

}  // namespace
}  // namespace tessera
