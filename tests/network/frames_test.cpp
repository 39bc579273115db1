// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames of many submaps: what a correction of them costs.
#include <algorithm>
#include <catch2/catch.hpp>

#include "network/moved_submaps.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::uint32_t kSubmaps = 100;
/// LCM puts its own 8 bytes and the channel's 8 in front.
constexpr std::size_t kOnTheWire = 16;

/// A robot with so many submaps beside its first, each of 90 m.
std::unique_ptr<Robot> robot_of_submaps(std::uint32_t number, bool signs = true) {
  auto made = roomy_robot(number, signs);
  oracle::Random random(17);
  for (std::uint32_t submap = 1; submap <= kSubmaps; ++submap) {
    REQUIRE(made->exchange().open(1, submap, moved(submap, 0.0)) == Status::kOk);
    for (const BlockCoord block : {BlockCoord{-53, -47, -4}, BlockCoord{61, 40, 9}})
      REQUIRE(made->publish(*pack(block), random, 1).ok());
  }
  return made;
}

void correct(Robot& robot, double by) {
  for (std::uint32_t submap = 1; submap <= kSubmaps; ++submap)
    REQUIRE(robot.exchange().move(1, submap, moved(submap, by)) == Status::kOk);
}

/// Of robot 1's submaps how many a robot holds where they are moved to by so much.
std::uint32_t held_at(const Robot& robot, double by) {
  std::uint32_t found = 0;
  for (std::uint32_t submap = 1; submap <= kSubmaps; ++submap)
    found += holds(robot, submap, moved(submap, by)) ? 1U : 0U;
  return found;
}

std::uint64_t frame_datagrams(const std::vector<std::vector<std::byte>>& all) {
  return static_cast<std::uint64_t>(std::count_if(all.begin(), all.end(), [](const auto& one) {
    return kind_of(one) == DatagramKind::kFrame;
  }));
}

std::size_t bytes_on_the_wire(const std::vector<std::vector<std::byte>>& all) {
  std::size_t bytes = 0;
  for (const auto& datagram : all) bytes += datagram.size() + kOnTheWire;
  return bytes;
}

TEST_CASE("frames: a correction of 100 submaps adds at most 6,400 bytes to what a robot says") {
  const bool signs = GENERATE(true, false);
  const auto corrected = robot_of_submaps(1, signs);
  const auto same = robot_of_submaps(1, signs);
  const auto hearer = roomy_robot(2, signs);
  constexpr std::int64_t kBegin = 60 * kSecond;
  for (const auto& datagram : said(*corrected, 0, kBegin)) hearer->exchange().receive(datagram, 0);
  static_cast<void>(said(*same, 0, kBegin));
  REQUIRE(held_at(*hearer, 0.0) == kSubmaps);
  correct(*corrected, 1.0);
  const auto now = said(*corrected, kBegin, kTickUs);
  const auto after = said(*corrected, kBegin + kTickUs, 2 * kSecond);
  for (const auto& datagram : now) hearer->exchange().receive(datagram, kBegin);
  // An eighth may have been sent just before, and waits.
  CHECK(held_at(*hearer, 1.0) >= kSubmaps / 8 * 7);
  for (const auto& datagram : after) hearer->exchange().receive(datagram, kBegin + kTickUs);
  CHECK(held_at(*hearer, 1.0) == kSubmaps);
  const std::size_t usual = bytes_on_the_wire(said(*same, kBegin, kTickUs + 2 * kSecond));
  const std::size_t bytes = bytes_on_the_wire(now) + bytes_on_the_wire(after) - usual;
  UNSCOPED_INFO(bytes << " bytes in all, " << bytes_on_the_wire(now) << " at once, in "
                      << frame_datagrams(now) << " datagrams");
  CHECK(bytes <= 6'400);
  CHECK(bytes_on_the_wire(now) <= 6'400);
  CHECK(frame_datagrams(now) <= 7);
}

TEST_CASE("frames: of each datagram of a correction one signature is checked") {
  const auto origin = robot_of_submaps(1);
  const auto hearer = roomy_robot(2);
  for (const auto& datagram : said(*origin, 0, 20 * kSecond))
    hearer->exchange().receive(datagram, 0);
  correct(*origin, 1.0);
  const std::uint64_t before = hearer->signature_checks();
  std::uint64_t datagrams = 0;
  for (const auto& datagram : said(*origin, 20 * kSecond, 2 * kSecond)) {
    if (kind_of(datagram) != DatagramKind::kFrame) continue;
    ++datagrams;
    hearer->exchange().receive(datagram, 20 * kSecond);
  }
  CHECK(held_at(*hearer, 1.0) == kSubmaps);
  CHECK(hearer->signature_checks() - before <= datagrams);
  CHECK(datagrams < kSubmaps / 4);
}

TEST_CASE("frames: who never heard a robot gets its frames from one who did, and checks each") {
  const bool signs = GENERATE(true, false);
  auto origin = robot_of_submaps(1, signs);
  const auto witness = roomy_robot(2, signs);
  std::int64_t now_us = 0;
  talk({origin.get(), witness.get()}, now_us, 20 * kSecond);
  correct(*origin, 2.0);
  talk({origin.get(), witness.get()}, now_us, 5 * kSecond);
  REQUIRE(held_at(*witness, 2.0) == kSubmaps);
  origin.reset();
  const auto newcomer = roomy_robot(3, signs);
  const std::uint64_t before = witness->exchange().report().frames;
  talk({witness.get(), newcomer.get()}, now_us, 20 * kSecond);
  CHECK(held_at(*newcomer, 2.0) == kSubmaps);
  CHECK(newcomer->exchange().report().refused_signature == 0);
  CHECK(newcomer->exchange().report().refused_body == 0);
  CHECK(newcomer->exchange().digest() == witness->exchange().digest());
  CHECK(witness->exchange().report().frames - before < 2 * kSubmaps + 10);
}

TEST_CASE("frames: those that are lost are asked for together, and come together") {
  const auto origin = robot_of_submaps(1);
  const auto hearer = roomy_robot(2);
  std::int64_t now_us = 0;
  talk({origin.get(), hearer.get()}, now_us, 20 * kSecond);
  correct(*origin, 3.0);
  const auto is_frame = [](const Robot& /*to*/, std::span<const std::byte> datagram) {
    return kind_of(datagram) == DatagramKind::kFrame;
  };
  talk({origin.get(), hearer.get()}, now_us, kTickUs, is_frame);
  std::uint64_t datagrams = 0;
  talk({origin.get(), hearer.get()}, now_us, 10 * kSecond,
       [&](const Robot& /*to*/, std::span<const std::byte> datagram) {
         datagrams += kind_of(datagram) == DatagramKind::kFrame ? 1U : 0U;
         return false;
       });
  CHECK(held_at(*hearer, 3.0) == kSubmaps);
  // One with each announcement, and these: each is missed when an announcement names it.
  CHECK(datagrams <= 10 + kSubmaps / 3);
}

}  // namespace
}  // namespace tessera::network
