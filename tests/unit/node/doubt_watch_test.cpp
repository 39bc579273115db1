// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that are named: a line in the log when that begins and when it ends, and the view.
#include "node/doubt_watch.hpp"

#include <catch2/catch.hpp>
#include <memory>

#include "support/team.hpp"

namespace tessera {
namespace {

using oracle::OracleContribution;
using oracle::Team;

/// A floor of classes 1 and 2, which a robot may take for each other.
OracleContribution floor_of(std::uint32_t robot, bool swapped) {
  OracleContribution contribution;
  contribution.id = {robot, 0, 0};
  for (std::int64_t y = 0; y < 32; ++y) {
    for (std::int64_t x = 0; x < 64; ++x) {
      oracle::OracleCounts counts(oracle::kTeamClasses + 2);
      counts[(y < 16) != swapped ? 1 : 2] = 3.0;
      contribution.voxels[{x, y, 0}] = counts;
    }
  }
  return contribution;
}

TEST_CASE("DoubtWatch: a robot is named until its classes are as most robots see them") {
  Team team(oracle::team_config());
  auto log = std::make_unique<LogQueue>("test");
  DoubtWatch watch;
  for (std::uint32_t robot = 0; robot < 3; ++robot) team.publish(floor_of(robot, robot == 1), 1);
  watch.look(team.global(), 0, *log);  // half of it is not fused yet
  CHECK(watch.view().count == 0);
  team.settle();
  for (int i = 0; i < 3; ++i) watch.look(team.global(), i, *log);
  const DoubtedRobots doubted = watch.view();
  REQUIRE(doubted.count == 1);
  CHECK(doubted.robots[0].robot == 1);
  CHECK(doubted.robots[0].classes == 0b110);
  CHECK(doubted.robots[0].reliability < 0.7F);
  team.publish(floor_of(1, false), 2);
  team.settle();
  watch.look(team.global(), 3, *log);
  CHECK(watch.view().count == 0);
}

}  // namespace
}  // namespace tessera
