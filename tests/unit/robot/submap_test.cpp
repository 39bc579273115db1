// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <limits>

#include "small_team.hpp"

namespace tessera {
namespace {

const Matrix34d kFirst = shift_of(1.0, -2.0);
const Matrix34d kSecond = shift_of(8.0, 4.0);

/// The global map of both parts, each from a map and a publisher of its own: submaps by hand.
std::uint64_t digest_by_hand(RobotConfig config, std::initializer_list<int> first, int second) {
  const ClassTable classes = small_robot_classes();
  const int components = classes.num_components();
  AlignedMemory memory(GlobalMap::required_bytes(config.global, components) +
                       Exchange::required_bytes(config.exchange, components) +
                       2 * (Mapper::required_bytes(config) +
                            Publisher::required_bytes(config.publisher, components)));
  Arena arena(memory.span());
  GlobalMap global = *GlobalMap::make(arena, config.global, classes);
  Exchange exchange =
      *Exchange::make(arena, config.exchange, store_of(global), crc_authenticator(), classes);
  for (std::uint32_t submap = 0; submap < 2; ++submap) {
    REQUIRE(exchange.open(config.epoch, submap, submap == 0 ? kFirst : kSecond) == Status::kOk);
    Mapper& mapper = **Mapper::make(arena, config, classes, {});
    Publisher publisher = *Publisher::make(arena, config.publisher, config.map, components);
    if (submap == 0) {
      for (const int part : first) mapper.integrate(StreetPart(part).view(), 0);
    } else {
      mapper.integrate(StreetPart(second).view(), 0);
    }
    for (std::int64_t tick = 0; tick < 200; ++tick)
      publisher.tick(mapper.map(), tick * kTick_us, config.budget, publication_of(exchange));
    REQUIRE(publisher.waiting() == 0);
  }
  while (global.busy()) global.step(100'000);
  return digest_of(global.map());
}

RobotConfig config_at_first() {
  RobotConfig config = small_robot_config(1);
  config.T_global_map = kFirst;
  return config;
}

TEST_CASE("Submap: one that ends is published whole, and the next begins with an empty map") {
  const RobotConfig config = config_at_first();
  SmallRobotMemory one(config);
  REQUIRE(one.robot != nullptr);
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  robot.integrate(StreetPart(1).view(), 0);
  REQUIRE(robot.new_submap(kSecond) == Status::kOk);
  CHECK(robot.sharer().submap().ending);
  CHECK_FALSE(robot.idle());
  robot.integrate(StreetPart(2).view(), 0);  // still of the first
  while (robot.sharer().submap().ending) static_cast<void>(robot.tick(now_us += kTick_us));
  CHECK(robot.map().block_count() == 0);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().submap().lost_blocks == 0);
  CHECK(robot.sharer().submap().cut_short == 0);
  robot.integrate(StreetPart(3).view(), 0);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.global().replicas().usage().contributions == 2);
  CHECK(digest_of(robot.global().map()) == digest_by_hand(config, {1, 2}, 3));
  CHECK(robot.publisher().totals().emptied == 0);
}

TEST_CASE("Submap: each is moved on its own, as if it had always been there") {
  RobotConfig config = config_at_first();
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  robot.integrate(StreetPart(1).view(), 0);
  REQUIRE(robot.new_submap(shift_of(20.0, 0.0)) == Status::kOk);
  REQUIRE(settle(robot, now_us) <= 1000);
  robot.integrate(StreetPart(2).view(), 0);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.set_frame(2, kFirst) == Status::kInvalidArgument);
  REQUIRE(robot.set_frame(1, kSecond) == Status::kOk);
  CHECK(robot.sharer().frame() == kSecond);
  REQUIRE(robot.set_frame(0, shift_of(3.0, 3.0)) == Status::kOk);
  CHECK(robot.sharer().frame() == kSecond);
  REQUIRE(robot.set_frame(0, kFirst) == Status::kOk);
  robot.finish();
  CHECK(digest_of(robot.global().map()) == digest_by_hand(config, {1}, 2));
}

TEST_CASE("Submap: one that ends holds nothing off, however much waits") {
  RobotConfig config = config_at_first();
  config.budget.compared = 16;
  config.publisher.staleness_us = 10'000'000;
  config.publisher.free_staleness_us = 20'000'000;
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  robot.integrate(StreetPart(1).view(), 0);
  const std::size_t ticks_of_all = robot.map().block_count() / config.budget.compared + 3;
  REQUIRE(ticks_of_all >= 8);
  REQUIRE(ticks_of_all < 40);
  REQUIRE(robot.new_submap(kSecond) == Status::kOk);
  std::size_t ticks = 0;
  std::int64_t now_us = 0;
  for (; robot.sharer().submap().ending; ++ticks) static_cast<void>(robot.tick(now_us += kTick_us));
  CHECK(ticks <= ticks_of_all);
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
  const PublisherReport report = robot.tick(kTick_us);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().submap().cut_short == 1);
  CHECK(report.published > 0);
  CHECK(robot.sharer().submap().lost_blocks == report.waiting + report.free_waiting);
  CHECK(robot.sharer().submap().lost_blocks == blocks - report.published);
  // Nothing of it is published later.
  std::int64_t now_us = kTick_us;
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.publisher().totals().published == report.published);
}

TEST_CASE("Submap: what cannot be a submap is refused, and all goes on as before") {
  RobotConfig config = config_at_first();
  config.exchange.contributions = config.global.replicas.contributions = 2;
  config.exchange.own_contributions = 1;
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  Matrix34d mirrored = Matrix34d::Identity();
  mirrored(0, 0) = -1.0;
  CHECK(robot.new_submap(mirrored) == Status::kInvalidArgument);
  CHECK(robot.sharer().open_submap(robot.map()) == Status::kInvalidArgument);
  std::int64_t now_us = 0;
  for (std::uint32_t submap = 1; submap <= 2; ++submap) {
    robot.integrate(StreetPart(1).view(), 0);
    REQUIRE(robot.new_submap(kSecond) == Status::kOk);
    CHECK(robot.new_submap(kSecond) == Status::kBusy);
    REQUIRE(settle(robot, now_us) <= 1000);
  }
  // There were places for two.
  CHECK(robot.sharer().submap().last == Status::kResourceExhausted);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().submap().opened == 1);
  CHECK(robot.map().block_count() > 0);
  const std::uint64_t published = robot.publisher().totals().published;
  robot.integrate(StreetPart(5).view(), 0);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.publisher().totals().published > published);
  CHECK(robot.publisher().totals().emptied == 0);
}

TEST_CASE("Submap: after so long a way another one begins, with the same frame") {
  RobotConfig config = config_at_first();
  config.submap_length_m = 8.0;
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  const StreetPart part(1);
  ScanView view = part.view();
  const auto drive_to = [&](double x_m, double y_m) {
    view.T_map_sensor = shift_of(x_m, y_m);
    robot.integrate(view, 0);
    REQUIRE(settle(robot, now_us) <= 1000);
    return robot.sharer().submap().submap;
  };
  CHECK(drive_to(100.0, 0.0) == 0);  // where it begins is no way
  CHECK(drive_to(105.0, 0.0) == 0);
  CHECK(drive_to(105.0, 2.9) == 0);
  CHECK(drive_to(1e9, 2.9) == 0);  // out of the grid
  CHECK(drive_to(105.0, 3.1) == 1);
  CHECK(robot.map().block_count() == 0);
  CHECK(robot.sharer().frame() == kFirst);
  CHECK(drive_to(105.0, 10.0) == 1);
  CHECK(drive_to(105.0, 8.0) == 2);
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

TEST_CASE("Submap: what changes behind a round of many ticks is published or counted as lost") {
  for (const int scanned_ticks : {30, 1000}) {
    RobotConfig config = config_of_slow_rounds();
    config.submap_ticks = 80;
    SmallRobotMemory one(config);
    Robot& robot = *one.robot;
    int blocks = 0;
    std::int64_t now_us = 0;
    while (blocks < 1200) integrate_block(robot, blocks++);
    REQUIRE(settle(robot, now_us) <= 1000);
    REQUIRE(robot.map().block_count() == 1200);
    REQUIRE(robot.new_submap(kSecond) == Status::kOk);
    int ticks = 0;
    for (; robot.sharer().submap().ending; ++ticks) {
      if (ticks < scanned_ticks) integrate_block(robot, blocks++);
      static_cast<void>(robot.tick(now_us += kTick_us));
    }
    INFO("scans for " << scanned_ticks << " ticks; it took " << ticks);
    const SubmapReport report = robot.sharer().submap();
    // Of the lost, those that changed since the last whole round began may have been published.
    const std::uint64_t known = robot.publisher().totals().published + report.lost_blocks;
    CHECK(known >= static_cast<std::uint64_t>(blocks));
    CHECK(known <= static_cast<std::uint64_t>(blocks) + (scanned_ticks == 30 ? 0 : 10));
    CHECK(ticks > 30);
    CHECK(ticks <= 80);
    CHECK((report.lost_blocks == 0) == (scanned_ticks == 30));
    CHECK(robot.map().block_count() == 0);
  }
}

TEST_CASE("Submap: what is written between its last tick and its end is counted as lost") {
  const RobotConfig config = config_of_slow_rounds();
  const ClassTable classes = small_robot_classes();
  AlignedMemory memory(Mapper::required_bytes(config) +
                       Sharer::required_bytes(config, classes.num_components()));
  Arena arena(memory.span());
  Mapper& mapper = **Mapper::make(arena, config, classes, {});
  Sharer& sharer = **Sharer::make(arena, config, classes, {});
  mapper.integrate(StreetPart(1).view(), 0);
  REQUIRE(sharer.request_submap(kSecond) == Status::kOk);
  std::int64_t now_us = 0;
  while (!sharer.submap_due()) static_cast<void>(sharer.tick(mapper.map(), now_us += kTick_us));
  const std::size_t before = mapper.map().block_count();
  REQUIRE(sharer.publisher().totals().published == before);
  const StreetPart part(2);
  ScanView late = part.view();
  late.T_map_sensor = shift_of(100.0, 0.0);
  mapper.integrate(late, 0);
  const std::size_t after = mapper.map().block_count();
  REQUIRE(after > before);
  REQUIRE(sharer.open_submap(mapper.map()) == Status::kOk);
  CHECK(sharer.submap().lost_blocks == after - before);
}

TEST_CASE("Submap: a loop closure while one ends for its length moves the next one too") {
  RobotConfig config = config_at_first();
  config.submap_length_m = 8.0;
  SmallRobotMemory one(config);
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  const StreetPart part(1);
  ScanView view = part.view();
  robot.integrate(view, 0);
  view.T_map_sensor = shift_of(9.0, 0.0);
  robot.integrate(view, 0);
  REQUIRE(robot.sharer().submap().ending);
  REQUIRE(robot.set_frame(0, kSecond) == Status::kOk);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().frame() == kSecond);
  // What was asked for with a frame of its own has that.
  REQUIRE(robot.new_submap(kFirst) == Status::kOk);
  REQUIRE(robot.set_frame(1, shift_of(3.0, 3.0)) == Status::kOk);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.sharer().submap().submap == 2);
  CHECK(robot.sharer().frame() == kFirst);
}

TEST_CASE("Submap: what is no setting of one") {
  RobotConfig config = config_at_first();
  config.submap_ticks = 0;
  CHECK(SmallRobotMemory(config).robot == nullptr);
  config.submap_ticks = 1;
  for (const double length_m : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    config.submap_length_m = length_m;
    CHECK(SmallRobotMemory(config).robot == nullptr);
  }
}

}  // namespace
}  // namespace tessera
