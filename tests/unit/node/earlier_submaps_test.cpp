// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/earlier_submaps.hpp"

#include <catch2/catch.hpp>
#include <filesystem>

#include "maps/kept_submaps.hpp"
#include "support/small_map.hpp"
#include "support/temporary_folder.hpp"
#include "tessera/robot/robot.hpp"
#include "unit/robot/small_team.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;

/// A robot in its second start, with submaps 0 .. 2 of the first, of which files say so much.
struct Restarted {
  Restarted() : one(config()) {
    std::vector<SubmapFrame> frames(4);
    for (SubmapFrame& frame : frames) frame.frame = *encode_rigid(shift_of(0.0, 0.0));
    REQUIRE(one.robot->sharer().restore_frames(frames, 0, true) == Status::kOk);
  }
  static RobotConfig config() {
    RobotConfig config = small_robot_config(1);
    config.epoch = 2;
    config.most_submaps = 6;
    config.first_submap = config.submaps_before = 3;
    config.exchange.own_contributions = 6;
    config.exchange.contributions = config.global.replicas.contributions = 16;
    return config;
  }
  void write(const test::TemporaryFolder& folder, std::uint32_t number) {
    SmallMap map(config().map, 2);
    for (int i = 0; i < 100; ++i)
      REQUIRE(hit(map.map, {8 * i, 8 * static_cast<std::int32_t>(number), 0}, 1, 2.0F) ==
              Status::kOk);
    std::vector<KeyedIndex> workspace = workspace_for(map.map);
    REQUIRE(save_map(map.map, {.robot = 1, .epoch = 1}, workspace,
                     KeptSubmaps::path_of(folder.file("kept"), number))
                .ok());
    rows.push_back({});
    rows.back().number = number;
  }
  /// Seconds of ticks, with a look after each.
  bool run(EarlierSubmaps& earlier, int seconds, std::uint64_t records) {
    bool failed = false;
    for (std::int64_t end_us = now_us + seconds * kSecond_us; now_us < end_us;
         now_us += kSecond_us / 20) {
      static_cast<void>(one.robot->tick(now_us));
      earlier.tick(one.robot->sharer(), now_us, records);
      failed = !earlier.look().ok() || failed;
    }
    return !failed;
  }
  SmallRobotMemory one;
  std::vector<SubmapRow> rows;
  std::int64_t now_us = kSecond_us;
};

TEST_CASE("EarlierSubmaps: what nobody sends is published from its files, after a while") {
  const test::TemporaryFolder folder;
  Restarted robot;
  for (const std::uint32_t number : {0U, 2U}) robot.write(folder, number);
  EarlierSubmaps earlier(folder.file("kept"), robot.rows);
  REQUIRE(robot.run(earlier, 19, 0));
  // As long as something comes it waits.
  for (std::uint64_t records = 1; records < 10; ++records) REQUIRE(robot.run(earlier, 1, records));
  CHECK(earlier.published() == 0);
  REQUIRE(robot.run(earlier, 10, 9));
  CHECK(earlier.published() == 2);
  for (const std::uint32_t submap : {0U, 2U})
    CHECK_FALSE(robot.one.robot->sharer().is_missing(submap));
  CHECK(robot.one.robot->sharer().is_missing(1));
  robot.one.robot->finish();
  CHECK(robot.one.robot->global().map().usage().label_voxels == 200);
  REQUIRE(robot.run(earlier, 30, 9));
  CHECK(earlier.published() == 2);
}

TEST_CASE("EarlierSubmaps: a file that is damaged is left out once, and the next one follows") {
  const test::TemporaryFolder folder;
  Restarted robot;
  for (const std::uint32_t number : {0U, 1U}) robot.write(folder, number);
  const std::string path = KeptSubmaps::path_of(folder.file("kept"), 0);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EarlierSubmaps earlier(folder.file("kept"), robot.rows);
  CHECK_FALSE(robot.run(earlier, 30, 0));
  CHECK(earlier.published() == 1);
  CHECK(robot.one.robot->sharer().is_missing(0));
  CHECK_FALSE(robot.one.robot->sharer().is_missing(1));
  CHECK(robot.run(earlier, 30, 0));
}

}  // namespace
}  // namespace tessera
