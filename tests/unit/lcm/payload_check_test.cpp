// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A link that checks what it takes: who is refused displaces nobody, however much he sends.
#include <catch2/catch.hpp>
#include <string>

#include "stranger.hpp"

namespace tessera {
namespace {

/// Takes what begins with a g, calls what begins with an f no datagram, what begins with an m of
/// another mission, and the rest forged.
PayloadVerdict judge(void* /*context*/, std::span<const std::byte> payload) noexcept {
  if (payload.front() == std::byte{'g'}) return PayloadVerdict::kTaken;
  if (payload.front() == std::byte{'m'}) return PayloadVerdict::kMission;
  return payload.front() == std::byte{'f'} ? PayloadVerdict::kFormat : PayloadVerdict::kTag;
}

/// A payload that judge() takes.
std::string good_payload(int number) {
  std::string text = std::to_string(number);
  text.insert(text.begin(), 'g');
  return text;
}

LinkConfig checked_config() {
  LinkConfig config = loopback_config();
  config.check.check = &judge;
  return config;
}

TEST_CASE("DatagramLink: what its check refuses takes no slot from what it takes") {
  if (!enter_own_network()) return;
  using namespace std::string_literals;
  constexpr int kHonest = 16;
  constexpr int kHostileEach = 100;
  LinkConfig config = checked_config();
  config.queue_slots = kHonest;
  const auto link = open_link(config);
  const auto honest = open_link(loopback_config());
  const Stranger stranger;
  const std::string forged = "LC02\0\0\0\0TESSERA\0none"s;
  const std::string misshapen = "LC02\0\0\0\0TESSERA\0ffff"s + std::string(1380, 'f');
  std::uint64_t hostile = 0;
  for (int i = 0; i < kHonest; ++i) {
    for (int k = 0; k < kHostileEach; ++k) stranger.send(k % 2 == 0 ? forged : misshapen);
    REQUIRE(honest->send(bytes_of(good_payload(i))));
    hostile += kHostileEach;
    // The socket's buffer may be small; what is lost there is not this test's.
    REQUIRE(eventually([&] {
      const LinkReport s = link->report();
      return s.refused_tag + s.refused_format == hostile &&
             s.received + s.queue_full == static_cast<std::uint64_t>(i) + 1;
    }));
  }
  const LinkReport s = link->report();
  CHECK(s.received == kHonest);
  CHECK(s.queue_full == 0);
  CHECK(s.queue_peak == kHonest);
  CHECK(s.kernel_dropped == 0);
  CHECK(s.missing == 0);
  CHECK(s.refused_tag == hostile / 2);
  CHECK(s.refused_format == hostile / 2);
  Buffer buffer;
  for (int i = 0; i < kHonest; ++i) CHECK(text_of(link->receive(buffer).bytes) == good_payload(i));
}

TEST_CASE("DatagramLink: what is of another mission is counted as such") {
  if (!enter_own_network()) return;
  const auto link = open_link(checked_config());
  const auto honest = open_link(loopback_config());
  for (const char* const payload : {"m1", "m2", "g3"}) REQUIRE(honest->send(bytes_of(payload)));
  REQUIRE(eventually([&] { return link->report().received == 1; }));
  CHECK(link->report().refused_mission == 2);
  CHECK(link->report().refused_tag + link->report().refused_format == 0);
}

TEST_CASE(
    "DatagramLink: what its check refuses makes no number missing, and takes no sender's place") {
  if (!enter_own_network()) return;
  using namespace std::string_literals;
  const auto link = open_link(checked_config());
  const auto honest = open_link(loopback_config());
  REQUIRE(honest->send(bytes_of("g0")));
  // Each socket is a sender of its own, with numbers far apart.
  for (int i = 0; i < 100; ++i) {
    const Stranger stranger;
    stranger.send("LC02\0\0\0\1TESSERA\0x"s);
    stranger.send("LC02\0\0\1\0TESSERA\0x"s);
    stranger.send("LC03\0\0\2\0\0\0\0\1\0\0\0\0\0\0\0\1"s);
  }
  REQUIRE(eventually([&] { return link->report().fragments == 100; }));
  CHECK(link->report().missing == 0);
  REQUIRE(honest->send_on("OTHER", bytes_of("x")));
  // As one that was damaged on its way.
  REQUIRE(honest->send(bytes_of("x")));
  REQUIRE(honest->send(bytes_of("g1")));
  REQUIRE(eventually([&] { return link->report().received == 2; }));
  CHECK(link->report().refused_tag == 201);
  CHECK(link->report().missing == 1);
}

TEST_CASE("DatagramLink: a side channel takes what its check does, and displaces nothing") {
  if (!enter_own_network()) return;
  using namespace std::string_literals;
  constexpr int kForged = 200;
  LinkConfig config = checked_config();
  config.queue_slots = 2;
  config.side = {.channel = "SIDE", .check = {nullptr, &judge}, .queue_slots = 2};
  const auto link = open_link(config);
  const auto honest = open_link(loopback_config());
  const Stranger stranger;
  for (int i = 0; i < kForged; ++i) stranger.send("LC02\0\0\0\0SIDE\0none"s);
  REQUIRE(eventually([&] { return link->side_report().refused_tag == kForged; }));
  REQUIRE(honest->send_on("SIDE", bytes_of("f")));
  REQUIRE(honest->send_on("OTHER", bytes_of("g")));
  for (const char* const payload : {"g1", "g2", "g3"})
    REQUIRE(honest->send_on("SIDE", bytes_of(payload)));
  REQUIRE(honest->send(bytes_of("g4")));
  REQUIRE(honest->send(bytes_of("g5")));
  REQUIRE(eventually([&] { return link->report().received == 2; }));
  const SideReport side = link->side_report();
  CHECK(side.received == 2);
  CHECK(side.queue_full == 1);
  CHECK(side.refused_format == 1);
  CHECK(link->report().queue_full == 0);
  CHECK(link->report().refused_tag == 0);
  CHECK(link->report().other_channel == 1);
  Buffer buffer;
  CHECK(text_of(link->receive_side(buffer)) == "g1");
  CHECK(text_of(link->receive_side(buffer)) == "g2");
  CHECK(link->receive_side(buffer).empty());
  CHECK(text_of(link->receive(buffer).bytes) == "g4");
}

}  // namespace
}  // namespace tessera
