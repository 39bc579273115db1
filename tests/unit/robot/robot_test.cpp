// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "small_team.hpp"

namespace tessera {
namespace {

TEST_CASE("Robot: takes just the memory that it says, and no less will do") {
  const RobotConfig config = small_robot_config(1);
  const ClassTable classes = small_robot_classes();
  const std::size_t bytes = Robot::required_bytes(config, classes.num_components());
  AlignedMemory memory(bytes);
  Arena enough(memory.span());
  CHECK(Robot::make(enough, config, classes, {}, {}).ok());
  CHECK(enough.remaining_bytes() == 0);
  for (const std::size_t less :
       {std::size_t{0}, kArenaAlignment, bytes / 2, bytes - kArenaAlignment}) {
    Arena arena(memory.span().first(less));
    CHECK(Robot::make(arena, config, classes, {}, {}).status() == Status::kResourceExhausted);
  }
  Arena askew(memory.span().subspan(8));
  CHECK(Robot::make(askew, config, classes, {}, {}).status() == Status::kResourceExhausted);
}

TEST_CASE("Robot: its size is known when it is compiled") {
  constexpr RobotSettings kSettings;
  static_assert(Robot::required_bytes(kSettings, 21) ==
                arena_bytes<Robot>(1) + Mapper::required_bytes(kSettings) +
                    Sharer::required_bytes(kSettings, 21) +
                    arena_bytes<PlacedBox>(kSettings.exchange.teammates) +
                    arena_bytes<WatchedPoint>(Objections::kMostPoints));
  CHECK(Robot::required_bytes(kSettings, 21) > required_bytes(kSettings.map));
}

/// All that a robot sends, tick by tick.
template <class Tick, class Send>
std::vector<std::byte> all_sent(Tick&& tick, Send&& send) {
  std::vector<std::byte> sent;
  std::array<std::byte, kMostDatagramBytes> datagram{};
  for (std::int64_t now_us = 0; now_us < 60 * kTick_us; now_us += kTick_us) {
    tick(now_us);
    while (const std::size_t bytes = send(now_us, datagram))
      sent.insert(sent.end(), datagram.begin(),
                  datagram.begin() + static_cast<std::ptrdiff_t>(bytes));
  }
  return sent;
}

TEST_CASE("Mapper and Sharer: apart they do what they do as one robot, byte by byte") {
  const RobotConfig config = small_robot_config(1);
  const ClassTable classes = small_robot_classes();
  SmallRobotMemory one(config);
  AlignedMemory memory(Mapper::required_bytes(config) +
                       Sharer::required_bytes(config, classes.num_components()));
  Arena arena(memory.span());
  Mapper& mapper = **Mapper::make(arena, config, classes, {});
  Sharer& sharer = **Sharer::make(arena, config, classes, {});
  const std::vector<std::byte> together = all_sent(
      [&](std::int64_t now_us) {
        if (now_us < 10 * kTick_us)
          one.robot->integrate(StreetPart(static_cast<int>(now_us / kTick_us)).view(), now_us);
        static_cast<void>(one.robot->tick(now_us));
      },
      [&](std::int64_t now_us, std::span<std::byte> into) {
        return one.robot->send(now_us, into);
      });
  const std::vector<std::byte> apart = all_sent(
      [&](std::int64_t now_us) {
        if (now_us < 10 * kTick_us) {
          const StreetPart part(static_cast<int>(now_us / kTick_us));
          mapper.integrate(part.view(), now_us);
          sharer.note_scan(mapper.maps(), 0, now_us, part.view().T_map_sensor);
        }
        static_cast<void>(sharer.tick(mapper.maps(), now_us));
      },
      [&](std::int64_t now_us, std::span<std::byte> into) { return sharer.send(now_us, into); });
  CHECK(together.size() > 10'000);
  CHECK(together == apart);
  CHECK(digest_of(one.robot->map()) == digest_of(mapper.map()));
}

TEST_CASE("Publisher: cleared, it publishes all anew, and lets go of nothing that was published") {
  RobotConfig config = small_robot_config(1);
  config.most_submaps = 2;
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  robot.integrate(StreetPart(1).view(), 0);
  REQUIRE(settle(robot, now_us) <= 1000);
  const std::uint64_t first = robot.publisher().totals().published;
  const std::uint64_t before = digest_of(robot.global().map());
  REQUIRE(robot.new_submap(Matrix34d::Identity()) == Status::kOk);
  const ScanView nothing;
  robot.integrate(nothing, 0);
  REQUIRE(settle(robot, now_us) <= 1000);
  REQUIRE(robot.sharer().submap().submap == 1);
  CHECK(robot.publisher().blocks() == 0);
  CHECK(robot.publisher().totals().published == first);
  CHECK(digest_of(robot.global().map()) == before);
  robot.integrate(StreetPart(1).view(), 0);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.publisher().totals().published == 2 * first);
}

}  // namespace
}  // namespace tessera
