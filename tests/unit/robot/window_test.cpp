// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot with a moving window: what it maps and what others have of it are what they are without.
#include <algorithm>
#include <catch2/catch.hpp>
#include <set>

#include "small_team.hpp"
#include "support/memory_archive.hpp"

namespace tessera {
namespace {

constexpr int kScans = 40;

RobotConfig with_window(RobotConfig config) {
  WindowConfig window;
  window.radius_m = 15.0;  // scans reach 13.5 m
  window.hysteresis_m = 1.6;
  window.reserve = {4, 4, 4, 8};
  config.window = window;
  config.archived_blocks = 4096;
  return config;
}

RobotConfig street_config() {
  RobotConfig config = small_robot_config(1);
  config.map.storage_bytes = 8U << 20U;
  config.global.map.storage_bytes = 8U << 20U;
  return config;
}

/// A robot that drives down the street, 2 m a scan.
struct Driver {
  explicit Driver(const RobotConfig& config) : memory(config), robot(*memory.robot) {}
  void scan(int part, int ticks) {
    const StreetPart street(part);
    ScanView view = street.view();
    view.T_map_sensor = shift_of(2.0 * part, 0.0);
    robot.integrate(view, now_us);
    for (int i = 0; i < ticks; ++i) static_cast<void>(robot.tick(now_us += kTick_us));
  }
  void drive(int from, int to, int ticks = 4) {
    for (int part = from; part != to; part += from < to ? 1 : -1) scan(part, ticks);
  }
  SmallRobotMemory memory;
  Robot& robot;
  std::int64_t now_us = 0;
};

std::set<std::uint64_t> keys_of(const LocalMap& map) {
  std::set<std::uint64_t> keys;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) keys.insert(item.key);
  return keys;
}

/// Voxels of which others have a label, or none, where the robot's own map says another.
std::size_t other_labels(const LocalMap& own, const LocalMap& global) {
  std::size_t count = 0;
  for (const auto& observed : oracle::observed_voxels(own)) {
    const auto along = [&](std::size_t axis) {
      return static_cast<std::int32_t>(observed.first[axis]);
    };
    const VoxelCoord at{along(0), along(1), along(2)};
    count += own.query(at).state != global.query(at).state ? 1U : 0U;
  }
  return count;
}

TEST_CASE("Robot: with a window it maps the same, and others have all that it has left behind") {
  Driver whole(street_config());
  Driver bounded(with_window(street_config()));
  oracle::MemoryArchive archive(bounded.robot.map());
  bounded.robot.mapper().set_archive(archive.interface());

  whole.drive(0, kScans);
  bounded.drive(0, kScans);
  REQUIRE(settle(whole.robot, whole.now_us) < 1000);
  REQUIRE(settle(bounded.robot, bounded.now_us) < 1000);

  const WindowReport& window = bounded.robot.mapper().window();
  CHECK(window.evicted > 300);
  CHECK(window.unpublished_blocks == 0);
  CHECK(window.lost_blocks == 0);
  CHECK(bounded.robot.map().block_count() < whole.robot.map().block_count() / 2);
  CHECK(bounded.robot.publisher().totals().emptied == 0);
  CHECK(keys_of(bounded.robot.global().map()) == keys_of(whole.robot.global().map()));
  const std::size_t differ = other_labels(whole.robot.map(), bounded.robot.global().map());
  CHECK(differ <= other_labels(whole.robot.map(), whole.robot.global().map()) + 20);

  // And back: what it has left behind returns, and nothing is published that others have.
  whole.drive(kScans, 0);
  bounded.drive(kScans, 0);
  for (const std::uint64_t key : archive.keys())
    REQUIRE(archive.reload(bounded.robot.mapper().map(), BlockKey{key}) == Status::kOk);
  CHECK(digest_of(bounded.robot.map()) == digest_of(whole.robot.map()));
  CHECK(bounded.robot.mapper().window().reloaded > 300);
  CHECK(bounded.robot.publisher().totals().emptied == 0);
}

TEST_CASE("Robot: where memory is short blocks leave unpublished, counted, and nothing is lost") {
  RobotConfig config = with_window(street_config());
  config.window->reserve = {4096, 4096, 4096, 65536};  // never there: always short
  Driver bounded(config);
  Driver whole(street_config());
  oracle::MemoryArchive archive(bounded.robot.map());
  bounded.robot.mapper().set_archive(archive.interface());
  bounded.drive(0, kScans, 0);  // no tick: nobody publishes
  whole.drive(0, kScans, 0);
  CHECK(bounded.robot.mapper().window().unpublished_blocks > 300);
  REQUIRE(settle(bounded.robot, bounded.now_us) < 1000);
  CHECK(bounded.robot.publisher().totals().emptied == 0);
  for (const std::uint64_t key : archive.keys())
    REQUIRE(archive.reload(bounded.robot.mapper().map(), BlockKey{key}) == Status::kOk);
  CHECK(digest_of(bounded.robot.map()) == digest_of(whole.robot.map()));
}

TEST_CASE("Robot: who may wait makes room before a scan, and is told when there is none") {
  RobotConfig config = with_window(street_config());
  config.window->radius_m = 1000.0;
  config.window->evicts_near = true;
  Driver bounded(config);
  oracle::MemoryArchive archive(bounded.robot.map());
  bounded.robot.mapper().set_archive(archive.interface());
  bounded.drive(0, 10);
  ScanView next = StreetPart(10).view();
  CHECK(bounded.robot.mapper().make_room(next));
  CHECK(bounded.robot.mapper().window().evicted == 0);

  config.window->reserve = {1 << 20, 1, 1, 1};  // more than there is
  Driver pressed(config);
  oracle::MemoryArchive kept(pressed.robot.map());
  pressed.robot.mapper().set_archive(kept.interface());
  pressed.drive(0, 10, 0);
  kept.full = true;
  CHECK_FALSE(pressed.robot.mapper().make_room(next));
  kept.full = false;
  CHECK(pressed.robot.mapper().make_room(next));  // nothing is left that could leave
  CHECK(pressed.robot.map().block_count() == 0);
  // Of blocks without evidence nothing is kept.
  CHECK(pressed.robot.mapper().window().near_evicted >= kept.keys().size());
  CHECK(kept.keys().size() > 100);
  // A scan that is refused moves nothing.
  next.T_map_sensor.setZero();
  CHECK(pressed.robot.mapper().make_room(next));
}

TEST_CASE("Robot: with a window and no archive blocks stay, as others have them") {
  Driver bounded(with_window(street_config()));
  bounded.drive(0, kScans);
  CHECK(bounded.robot.mapper().window().evicted == 0);
  CHECK(bounded.robot.mapper().window().evictions_refused > 0);
  CHECK(bounded.robot.mapper().window().lost_blocks == 0);
}

/// Voxels that two maps do not say the same of, or one has alone.
std::size_t differing(const LocalMap& a, const LocalMap& b) {
  return other_labels(a, b) + other_labels(b, a);
}

TEST_CASE(
    "Robot: what is published of blocks that left and came back is that of a map without a "
    "window") {
  RobotConfig config = street_config();
  config.publisher.evidence_factor = 1.001F;  // whatever changes is published
  Driver whole(config);
  Driver bounded(with_window(config));
  oracle::MemoryArchive archive(bounded.robot.map());
  bounded.robot.mapper().set_archive(archive.interface());
  // There, back over what has left, and once more: evidence is added to what others have already.
  for (Driver* driver : {&whole, &bounded}) {
    driver->drive(0, kScans);
    driver->drive(kScans, 0);
    driver->drive(0, kScans);
    driver->drive(kScans, 0);
  }
  REQUIRE(settle(whole.robot, whole.now_us) < 1000);
  REQUIRE(settle(bounded.robot, bounded.now_us) < 1000);
  CHECK(bounded.robot.mapper().window().reloaded > 600);
  CHECK(bounded.robot.publisher().totals().emptied == 0);
  // Centroids began anew where blocks had left, so that a little goes elsewhere in the turned
  // frame.
  CHECK(keys_of(bounded.robot.global().map()) == keys_of(whole.robot.global().map()));
  CHECK(differing(whole.robot.global().map(), bounded.robot.global().map()) <= 20);
}

TEST_CASE("Robot: a map that is cleared is withdrawn, with what is archived of it") {
  RobotConfig config = street_config();
  config.publisher.evidence_factor = 1.001F;  // whatever changes is published
  Driver bounded(with_window(config));
  oracle::MemoryArchive archive(bounded.robot.map());
  bounded.robot.mapper().set_archive(archive.interface());
  bounded.drive(0, kScans);
  REQUIRE(settle(bounded.robot, bounded.now_us) < 1000);
  REQUIRE(archive.keys().size() > 300);
  REQUIRE(bounded.robot.mapper().clear());
  CHECK(archive.keys().empty());
  bounded.scan(3, 100);  // so many ticks the publisher takes to go through all that it published
  REQUIRE(settle(bounded.robot, bounded.now_us) < 1000);
  Driver fresh(config);
  fresh.scan(3, 4);
  REQUIRE(settle(fresh.robot, fresh.now_us) < 1000);
  CHECK(bounded.robot.publisher().totals().emptied > 300);
  CHECK(digest_of(bounded.robot.global().map()) == digest_of(fresh.robot.global().map()));
}

TEST_CASE("Robot: in a new epoch archived blocks are published as they return") {
  Driver bounded(with_window(street_config()));
  oracle::MemoryArchive archive(bounded.robot.map());
  bounded.robot.mapper().set_archive(archive.interface());
  bounded.drive(0, kScans);
  REQUIRE(settle(bounded.robot, bounded.now_us) < 1000);
  REQUIRE(bounded.robot.sharer().reopen(2, 2) == Status::kOk);
  REQUIRE(settle(bounded.robot, bounded.now_us) < 1000);
  CHECK(keys_of(bounded.robot.global().map()) == keys_of(bounded.robot.map()));
  bounded.drive(kScans, 0);
  REQUIRE(settle(bounded.robot, bounded.now_us) < 1000);
  std::set<std::uint64_t> all = keys_of(bounded.robot.map());
  const std::set<std::uint64_t> published = keys_of(bounded.robot.global().map());
  CHECK(std::ranges::includes(published, all));
  CHECK(published.size() > 300);
}

}  // namespace
}  // namespace tessera
