// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that are named: a line in the log when that begins and when it has ended, and the view.
#include "node/doubt_watch.hpp"

#include <fcntl.h>

#include <catch2/catch.hpp>

#include "base/file_descriptor.hpp"
#include "support/team.hpp"

namespace tessera {
namespace {

using oracle::honestly;
using oracle::striped_ground;
using oracle::swapped;

TEST_CASE("DoubtWatch: one line when a robot is named, one when it has not been for some time") {
  constexpr std::int64_t kSecond_us = 1'000'000;
  oracle::Team team(oracle::team_config());
  LogQueue log("test");
  const FileDescriptor nothing(::open("/dev/null", O_WRONLY | O_CLOEXEC));
  LogWriter writer(nothing.get(), false);
  DoubtWatch watch;
  std::int64_t now_us = kSecond_us;
  const auto lines_of_look = [&] {
    const std::uint64_t before = writer.lines();
    watch.look(team.global(), now_us, log);
    LogQueue* const queues[] = {&log};
    writer.write(queues);
    return writer.lines() - before;
  };
  const auto publish = [&](bool is_wrong, std::uint32_t version) {
    for (std::uint32_t robot = 0; robot < 3; ++robot)
      team.publish(striped_ground(robot, robot == 1 && is_wrong ? swapped : honestly), version);
    team.settle();
  };
  CHECK(lines_of_look() == 0);
  publish(true, 1);
  CHECK(lines_of_look() == 1);
  CHECK(lines_of_look() == 0);
  const DoubtedRobots doubted = watch.view();
  REQUIRE(doubted.count == 1);
  CHECK(doubted.robots[0].robot == 1);
  CHECK(doubted.robots[0].classes == 0b110);
  // To and fro: no lines.
  for (std::uint32_t version = 2; version < 10; ++version) {
    now_us += kSecond_us;
    publish(version % 2 == 1, version);
    CHECK(lines_of_look() == 0);
    CHECK(watch.view().count == 1);
  }
  publish(false, 10);
  CHECK(lines_of_look() == 0);
  now_us += DoubtWatch::kMemory_us;
  CHECK(lines_of_look() == 1);
  CHECK(watch.view().count == 0);
  CHECK(lines_of_look() == 0);
}

TEST_CASE("DoubtWatch: where more is always arriving, what is known is looked at after a while") {
  oracle::Team team(oracle::team_config());
  LogQueue log("test");
  DoubtWatch watch;
  for (std::uint32_t robot = 0; robot < 3; ++robot)
    team.publish(striped_ground(robot, robot == 1 ? swapped : honestly), 1);
  team.settle();
  team.publish(striped_ground(0, honestly), 2);
  team.publish(striped_ground(3, honestly), 1);
  REQUIRE(team.global().busy());
  watch.look(team.global(), 1, log);
  CHECK(watch.view().count == 0);
  watch.look(team.global(), 1 + DoubtWatch::kPatience_us, log);
  CHECK(watch.view().count == 1);
}

}  // namespace
}  // namespace tessera
