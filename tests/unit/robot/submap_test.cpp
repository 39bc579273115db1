// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <limits>

#include "submap_course.hpp"

namespace tessera {
namespace {

/// Ticks until the submap that has ended is published.
int publish_ended(Robot& robot, std::int64_t& now_us) {
  int ticks = 0;
  do {
    static_cast<void>(robot.tick(now_us += kTick_us));
  } while (++ticks < 1000 && robot.sharer().submap().ending);
  return ticks;
}

TEST_CASE("Submap: one that has ended is published whole, while the next one is mapped") {
  const RobotConfig config = config_at_first();
  SmallRobotMemory one(config);
  REQUIRE(one.robot != nullptr);
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  robot.integrate(StreetPart(1).view(), 0);
  robot.integrate(StreetPart(2).view(), 0);
  REQUIRE(robot.new_submap(kSecond) == Status::kOk);
  CHECK(robot.maps().number() == 0);
  robot.integrate(StreetPart(3).view(), 0);  // the first scan of the second
  CHECK(robot.maps().number() == 1);
  CHECK(robot.sharer().submap().submap == 0);
  static_cast<void>(robot.tick(now_us += kTick_us));
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().submap().lost_blocks == 0);
  CHECK(robot.sharer().submap().cut_short == 0);
  CHECK(robot.sharer().frame() == kSecond);
  CHECK(robot.mapper().submaps().by_request == 1);
  CHECK(robot.global().replicas().usage().contributions == 2);
  CHECK(digest_of(robot.global().map()) == digest_by_hand(config, {1, 2}, 3));
  CHECK(robot.publisher().totals().emptied == 0);
}

TEST_CASE("Submap: one that has ended holds nothing off, however much waits") {
  RobotConfig config = config_at_first();
  config.budget.compared = 16;
  config.publisher.staleness_us = 10'000'000;
  config.publisher.free_staleness_us = 20'000'000;
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  robot.integrate(StreetPart(1).view(), 0);
  const auto ticks_of_all =
      static_cast<int>(robot.map().block_count() / config.budget.compared + 3);
  REQUIRE(ticks_of_all >= 8);
  REQUIRE(ticks_of_all < 40);
  REQUIRE(robot.new_submap(kSecond) == Status::kOk);
  robot.integrate(StreetPart(2).view(), 0);
  std::int64_t now_us = 0;
  CHECK(publish_ended(robot, now_us) <= ticks_of_all);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().submap().lost_blocks == 0);
  CHECK(robot.sharer().submap().cut_short == 0);
}

TEST_CASE("Submap: what its ticks do not do is counted as lost") {
  RobotConfig config = config_at_first();
  config.submap_ticks = 1;
  config.budget.label_bytes = 100;
  config.budget.free_bytes = 100;
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  robot.integrate(StreetPart(1).view(), 0);
  const std::uint64_t blocks = robot.map().block_count();
  REQUIRE(robot.new_submap(kSecond) == Status::kOk);
  robot.integrate(StreetPart(2).view(), 0);
  const PublisherReport report = robot.tick(kTick_us);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().submap().cut_short == 0);  // all of it was looked at
  CHECK(report.published > 0);
  CHECK(robot.sharer().submap().lost_blocks == report.waiting + report.free_waiting);
  CHECK(robot.sharer().submap().lost_blocks == blocks - report.published);
}

TEST_CASE("Submap: what cannot be a submap is refused, and all goes on as before") {
  SmallRobotMemory one(config_at_first());
  Robot& robot = *one.robot;
  Matrix34d mirrored = Matrix34d::Identity();
  mirrored(0, 0) = -1.0;
  CHECK(robot.new_submap(mirrored) == Status::kInvalidArgument);
  std::int64_t now_us = 0;
  for (std::uint32_t submap = 1; submap <= 3; ++submap) {
    robot.integrate(StreetPart(static_cast<int>(submap)).view(), 0);
    REQUIRE(robot.new_submap(kSecond) == (submap == 3 ? Status::kBusy : Status::kOk));
    CHECK(robot.new_submap(kSecond) == Status::kBusy);
    robot.integrate(StreetPart(5).view(), 0);
    REQUIRE(settle(robot, now_us) <= 1000);
    if (submap == 2) REQUIRE(robot.new_submap(kSecond) == Status::kOk);  // there is none left
  }
  CHECK(robot.maps().number() == 2);
  CHECK(robot.sharer().submap().submap == 2);
  CHECK(robot.mapper().submaps().late > 0);
  CHECK(robot.mapper().submaps().left_out == 0);
  const std::uint64_t published = robot.publisher().totals().published;
  robot.integrate(StreetPart(7).view(), 0);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.publisher().totals().published > published);

  SmallRobotMemory whole(small_robot_config(1));
  CHECK(whole.robot->new_submap(kSecond) == Status::kInvalidArgument);
}

TEST_CASE("Submap: after so long a way another one begins, in the same frame") {
  RobotConfig config = config_at_first(8);
  config.submap_cuts.length_m = 8.0;
  Course course(config);
  Robot& robot = *course.one.robot;
  CHECK(course.drive_to(100.0, 0.0) == 0);  // where it begins is no way
  CHECK(course.drive_to(105.0, 0.0) == 0);
  CHECK(course.drive_to(105.0, 2.9) == 0);
  CHECK(course.drive_to(105.0, 3.1) == 1);
  CHECK(robot.maps().note_of(0).length_m == Approx(7.9));
  CHECK(robot.maps().note_of(0).first_scan == 0);
  CHECK(robot.maps().note_of(0).last_scan == 2);
  CHECK(robot.maps().before() == &robot.maps().of(0));
  CHECK(robot.sharer().frame() == kFirst);
  CHECK(course.drive_to(105.0, 10.0) == 1);
  CHECK(course.drive_to(105.0, 8.0) == 2);
  CHECK(robot.mapper().submaps().by_length == 2);
  CHECK(robot.sharer().submap().lost_blocks == 0);
}

TEST_CASE(
    "Submap: a jump begins one at once, in the world as it is mapped; the last are for that") {
  RobotConfig config = config_at_first(16);
  config.exchange.contributions = config.global.replicas.contributions = 20;
  config.exchange.own_contributions = 16;
  config.global.replicas.blocks = 16384;
  config.global.replicas.segments = config.global.replicas.robot_segments = 65536;
  config.submap_cuts.length_m = 1.0;
  config.submap_cuts.jump_m = 50.0;
  Course course(config);
  Robot& robot = *course.one.robot;
  course.drive_to(0.0, 0.0);
  course.drive_to(0.5, 0.0);
  REQUIRE(robot.set_frame(0, kSecond) == Status::kOk);
  CHECK(course.drive_to(100.0, 0.0) == 1);
  CHECK(robot.sharer().frame() == kFirst);
  CHECK(robot.maps().before() == nullptr);
  CHECK(robot.mapper().submaps().by_jump == 1);
  for (int step = 1; step < 100; ++step) course.drive_to(100.0 + 1.1 * step, 0.0);
  CHECK(robot.maps().number() == 13);  // two are left
  CHECK(course.drive_to(0.0, 0.0) == 14);
  CHECK(course.drive_to(100.0, 0.0) == 15);
  CHECK(course.last.pose == Status::kOk);
  CHECK(course.drive_to(0.0, 0.0) == 15);
  CHECK(course.last.pose == Status::kBusy);
  CHECK(robot.mapper().submaps().left_out == 1);
}

TEST_CASE("Submap: while the one before is needed the current one goes on, beyond a jump nothing") {
  RobotConfig config = config_at_first(8);
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  LocalMaps& maps = robot.mapper().maps();
  maps.require(LocalMaps::User::kKeeping);
  std::int64_t now_us = 0;
  robot.integrate(StreetPart(1).view(), 0);
  const std::uint64_t first = digest_of(robot.map());
  robot.mapper().end_submap(std::nullopt);
  robot.integrate(StreetPart(2).view(), 0);
  REQUIRE(maps.number() == 1);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK_FALSE(maps.ended(LocalMaps::User::kPublishing).has_value());
  REQUIRE(maps.ended(LocalMaps::User::kKeeping) == std::optional<std::uint32_t>(0));
  CHECK(digest_of(maps.of(0)) == first);
  robot.mapper().end_submap(std::nullopt);
  CHECK(robot.integrate(StreetPart(3).view(), 0).pose == Status::kOk);
  CHECK(maps.number() == 1);
  CHECK(robot.mapper().submaps().late == 1);
  robot.mapper().end_submap(SubmapEnd::kJump);
  const std::uint64_t second = digest_of(robot.map());
  CHECK(robot.integrate(StreetPart(4).view(), 0).pose == Status::kBusy);
  CHECK(digest_of(robot.map()) == second);
  maps.note_done(LocalMaps::User::kKeeping);
  CHECK(robot.integrate(StreetPart(4).view(), 0).pose == Status::kOk);
  CHECK(maps.number() == 2);
  // One that is gone holds nothing up.
  maps.dismiss(LocalMaps::User::kKeeping);
  REQUIRE(settle(robot, now_us) <= 1000);
  robot.mapper().end_submap(std::nullopt);
  robot.integrate(StreetPart(5).view(), 0);
  CHECK(maps.number() == 3);
  CHECK(robot.mapper().submaps().left_out == 1);
}

TEST_CASE("Submap: a reader finds what only the one before has, unless poses jumped") {
  SmallRobotMemory one(config_at_first());
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  MapReader reader(robot.maps());
  const StreetPart part(1);
  ScanView view = part.view();
  robot.integrate(view, 0);
  const VoxelCoord there = *robot.map().lattice().voxel_of(Point3f(part.points.data()));
  const Estimate before = robot.map().query(there);
  REQUIRE(before.label != 0);
  robot.mapper().end_submap(std::nullopt);
  view.T_map_sensor = shift_of(200.0, 0.0);
  robot.integrate(view, 0);
  REQUIRE(robot.map().query(there).state == VoxelState::kUnknown);
  CHECK(reader.query(there)->label == before.label);
  CHECK_FALSE(reader.lacks(block_of(there)));
  // Beyond a jump it lies elsewhere.
  REQUIRE(settle(robot, now_us) <= 1000);
  robot.mapper().end_submap(SubmapEnd::kJump);
  robot.integrate(view, 0);
  REQUIRE(robot.maps().number() == 2);
  CHECK(reader.query(there)->state == VoxelState::kUnknown);
  CHECK(reader.lacks(block_of(there)));
}

/// A robot whose index is gone through in many ticks, and points alone in blocks of their own.
RobotConfig config_of_slow_rounds() {
  RobotConfig config = config_at_first();
  config.inference.mode = InferenceMode::kCounting;
  config.inference.free_space.enabled = false;
  config.budget.entries = 512;
  config.map.storage_bytes = 4U << 20U;
  return config;
}

void integrate_block(Robot& robot, int number) {
  const float points[3] = {2.5F, 0.9F, 0.9F};
  const std::uint8_t road = 1;
  ScanView scan{.points = points, .stride_floats = 3, .count = 1, .components = &road};
  scan.T_map_sensor = shift_of(1.6 * (number % 64), 1.6 * (number / 64));
  robot.integrate(scan, 0);
}

TEST_CASE("Submap: what a round of many ticks has passed is published before the submap is done") {
  SmallRobotMemory one(config_of_slow_rounds());
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  int blocks = 0;
  while (blocks < 1200) integrate_block(robot, blocks++);
  for (int tick = 0; tick < 15; ++tick) {  // in the middle of a round
    integrate_block(robot, blocks++);
    static_cast<void>(robot.tick(now_us += kTick_us));
  }
  REQUIRE(robot.new_submap(kSecond) == Status::kOk);
  integrate_block(robot, blocks);
  REQUIRE(robot.map().block_count() == 1);
  CHECK(publish_ended(robot, now_us) > 3);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().submap().lost_blocks == 0);
  CHECK(robot.publisher().totals().published >= static_cast<std::uint64_t>(blocks));
}

TEST_CASE("Submap: what is no setting of one") {
  RobotConfig config = config_at_first();
  config.submap_ticks = 0;
  CHECK(SmallRobotMemory(config).robot == nullptr);
  for (const double length_m : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    config = config_at_first();
    config.submap_cuts.length_m = length_m;
    CHECK(SmallRobotMemory(config).robot == nullptr);
  }
  config = config_at_first(1);
  CHECK(SmallRobotMemory(config).robot == nullptr);
  config = config_at_first(0);
  config.submap_cuts.length_m = 10.0;
  CHECK(SmallRobotMemory(config).robot == nullptr);
  config = config_at_first();
  config.window = WindowConfig{};
  CHECK(SmallRobotMemory(config).robot == nullptr);
}

}  // namespace
}  // namespace tessera
