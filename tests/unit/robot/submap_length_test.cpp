// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How long submaps are where places or memory are short.
#include <catch2/catch.hpp>
#include <vector>

#include "submap_course.hpp"

namespace tessera {
namespace {

TEST_CASE("Submap: as places become rare they become longer, and the way never ends in one") {
  RobotConfig config = config_at_first(34);
  config.exchange.contributions = config.global.replicas.contributions = 40;
  config.exchange.own_contributions = 34;
  config.global.replicas.blocks = 16384;
  config.global.replicas.segments = config.global.replicas.robot_segments = 65536;
  config.submap_cuts.length_m = 1.0;
  Course course(config);
  std::vector<int> begun_at;  // 30 places, and 4 for jumps
  for (int step = 0; step <= 160; ++step) {
    const std::uint32_t number = course.drive_to(1.0 * step, 0.0);
    if (number == begun_at.size()) begun_at.push_back(step);
  }
  REQUIRE(begun_at.size() == 30);
  for (std::size_t i = 1; i < begun_at.size(); ++i) {
    const int length = i <= 15 ? 1 : i <= 22 ? 2 : i <= 26 ? 4 : i <= 28 ? 8 : 16;
    INFO("submap " << i);
    CHECK(begun_at[i] - begun_at[i - 1] == length);
  }
}

TEST_CASE("Submap: one that fills its memory ends before its way does") {
  RobotConfig config = config_at_first(8);
  config.submap_cuts.length_m = 40.0;
  config.map.storage_bytes = 12 * SlabPool::kPageBytes;
  Course course(config);
  Robot& robot = *course.one.robot;
  int step = 0;
  while (robot.maps().number() == 0 && step < 39) course.drive_to(4.0 * step++, 0.0);
  CHECK(robot.maps().number() == 1);
  CHECK(robot.mapper().submaps().by_memory == 1);
  CHECK(robot.maps().note_of(0).length_m >= 8.0);
  CHECK(robot.maps().note_of(0).length_m < 40.0);
}

}  // namespace
}  // namespace tessera
