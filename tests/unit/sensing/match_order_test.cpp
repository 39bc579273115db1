// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The matching policy, rule by rule: order, stamps, memory.
#include <catch2/catch.hpp>
#include <limits>
#include <random>
#include <vector>

#include "unit/sensing/match_bench.hpp"

namespace tessera {
namespace {

TEST_CASE("matching: scans are given out by rising stamp, whatever the order they came in") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.scan(kLidar, 990);
  bench.scan(kRawLidar, 970);
  bench.scan(kLidar, 980);
  CHECK(bench.given() == -1);  // 970 waits for images, and the others for it.
  bench.now_ms += 100;
  CHECK(bench.given() == 970);
  CHECK(bench.given() == 980);
  CHECK(bench.given() == 990);
}

TEST_CASE("matching: a scan older than one of its sensor that was given out is refused") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.scan(kLidar, 980);
  CHECK(bench.given() == 980);
  bench.scan(kLidar, 970);
  CHECK(bench.report().out_of_order == 1);
  CHECK(bench.matcher.pending() == 0);
  // Of another sensor it is none.
  bench.scan(kRawLidar, 970);
  CHECK(bench.matcher.pending() == 1);
}

TEST_CASE("matching: a stamp that its sensor has had is refused, waiting or given out") {
  MatchBench bench;
  bench.scan(kLidar, 980);
  bench.scan(kLidar, 980);
  CHECK(bench.report().duplicates == 1);
  bench.poses(900, 1000);
  CHECK(bench.given() == 980);
  bench.scan(kLidar, 980);
  CHECK(bench.report().duplicates == 2);
  CHECK(bench.given() == -1);
}

TEST_CASE("matching: what is stamped ahead of now, or long before, is refused, of each kind") {
  MatchBench bench;
  for (const std::int64_t stamp_ms : {1021, 499}) {
    bench.scan(kLidar, stamp_ms);
    bench.image(0, stamp_ms);
    bench.pose(stamp_ms);
  }
  for (const TimelinessCounts& counts :
       {bench.report().scans, bench.report().image_stamps, bench.report().pose_stamps}) {
    CHECK(counts.future == 1);
    CHECK(counts.ancient == 1);
  }
  CHECK(bench.matcher.pending() == 0);
  bench.scan(kLidar, 1020);
  bench.scan(kLidar, 500);
  CHECK(bench.matcher.pending() == 2);
}

TEST_CASE("matching: stamps at the ends of the numbers are refused like others") {
  MatchBench bench;
  for (const std::int64_t stamp_us :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    Scan& slot = bench.matcher.next_scan();
    slot.sensor = kLidar;
    slot.has_components = true;
    slot.stamp_us = stamp_us;
    bench.matcher.add_scan(bench.time());
    bench.matcher.add_pose({.stamp_us = stamp_us}, bench.time());
  }
  CHECK(bench.report().scans.ancient + bench.report().scans.future == 2);
  CHECK(bench.report().pose_stamps.ancient + bench.report().pose_stamps.future == 2);
}

TEST_CASE("matching: images and poses that are not later than their last are refused") {
  MatchBench bench;
  bench.image(0, 950);
  bench.image(0, 950);
  bench.image(0, 940);
  bench.image(1, 940);
  CHECK(bench.report().images == 2);
  CHECK(bench.report().images_out_of_order == 2);
  bench.pose(950);
  bench.pose(950);
  bench.pose(940);
  CHECK(bench.report().poses == 1);
  CHECK(bench.report().poses_out_of_order == 2);
}

TEST_CASE("matching: sensors and cameras that are not configured are refused") {
  MatchBench bench;
  bench.scan(9, 950);
  bench.image(9, 950);
  CHECK(bench.report().unknown_sensor == 1);
  CHECK(bench.report().unknown_camera == 1);
  // A known number with another kind of message is unknown as well.
  Scan& slot = bench.matcher.next_scan();
  slot.kind = ScanKind::kCloud;
  slot.sensor = kRawLidar;
  slot.has_components = true;
  slot.stamp_us = 950 * kMs;
  bench.matcher.add_scan(bench.time());
  CHECK(bench.report().unknown_sensor == 2);
}

TEST_CASE("matching: a pose that is not rigid is refused") {
  MatchBench bench;
  StampedPose bad{.stamp_us = 950 * kMs};
  bad.T_map_body(0, 0) = 2.0;
  bench.matcher.add_pose(bad, bench.time());
  CHECK(bench.report().poses_not_rigid == 1);
}

TEST_CASE("matching: at N-1, N and N+1 scans that wait, the oldest of too many is dropped") {
  MatchBench bench;
  for (const std::int64_t stamp_ms : {950, 960, 970}) bench.scan(kLidar, stamp_ms);
  CHECK(bench.matcher.pending() == 3);
  CHECK(bench.report().superseded == 0);
  bench.scan(kLidar, 980);
  CHECK(bench.matcher.pending() == 3);
  CHECK(bench.report().superseded == 1);
  bench.poses(900, 1000);
  CHECK(bench.given() == 960);
}

TEST_CASE("matching: while the mapping thread is behind, only the newest that is ready is kept") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.scan(kLidar, 910);
  bench.scan(kLidar, 920);
  const Scan* const first = bench.matcher.take_ready(bench.time());
  const Scan* const second = bench.matcher.take_ready(bench.time());
  REQUIRE(second != nullptr);
  for (const std::int64_t stamp_ms : {930, 940, 950}) {
    bench.scan(kLidar, stamp_ms);
    CHECK(bench.matcher.take_ready(bench.time()) == nullptr);
  }
  CHECK(bench.matcher.pending() == 1);
  CHECK(bench.report().superseded == 2);
  bench.matcher.give_back(first);
  CHECK(bench.given() == 950);
  bench.matcher.give_back(second);
}

TEST_CASE("matching: a full track of poses forgets its oldest, a camera its oldest image") {
  MatchBench bench;
  bench.now_ms = 1200;
  for (std::int64_t at = 1000; at < 1200; at += 10) bench.pose(at);
  CHECK(bench.matcher.track().size() == 16);
  CHECK(bench.matcher.track().oldest_us() == 1040 * kMs);
  for (const std::int32_t camera : {0, 1})
    for (std::int64_t at = 1100; at <= 1130; at += 10) bench.image(camera, at);
  bench.scan(kRawLidar, 1105);
  const Scan* const slot = bench.matcher.take_ready(bench.time());
  REQUIRE(slot != nullptr);
  CHECK(slot->images()[0].stamp_us == 1110 * kMs);
}

TEST_CASE("matching: a step of the sensors' clock drops all that was stamped before it") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.image(0, 950);
  bench.scan(kLidar, 1005);
  bench.now_ms += 10;
  bench.clock_ahead_ms = 3'600'000;
  CHECK(bench.given() == -1);
  CHECK(bench.report().clock_steps == 1);
  CHECK(bench.report().dropped_by_step == 1);
  CHECK(bench.matcher.track().size() == 0);
  // And what is stamped in the new time is taken, forth and back.
  for (const std::int64_t ahead_ms : {std::int64_t{3'600'000}, std::int64_t{-3'600'000}}) {
    bench.clock_ahead_ms = ahead_ms;
    const std::int64_t stamp_now_ms = bench.now_ms + ahead_ms;
    bench.pose(stamp_now_ms - 10);
    bench.pose(stamp_now_ms);
    bench.scan(kLidar, stamp_now_ms - 5);
    CHECK(bench.given() == stamp_now_ms - 5);
  }
  CHECK(bench.report().clock_steps == 2);
}

TEST_CASE("matching: a clock that is slowly adjusted does not step") {
  MatchBench bench;
  for (int i = 0; i < 50; ++i) {
    bench.now_ms += 10;
    bench.clock_ahead_ms += 5;
    bench.pose(bench.now_ms + bench.clock_ahead_ms);
  }
  CHECK(bench.report().clock_steps == 0);
  CHECK(bench.report().poses == 50);
}

TEST_CASE("matching: a cloud's poses are thinned evenly, with the first and the last") {
  MatcherConfig config = sample_config();
  config.poses = 512;
  MatchBench bench(config);
  for (std::int64_t at = 800; at <= 1000; ++at) bench.pose(at);
  bench.scan(kLidar, 810, 180);
  const Scan* const slot = bench.matcher.take_ready(bench.time());
  REQUIRE(slot != nullptr);
  REQUIRE(slot->poses().size() == Scan::kMostPoses);
  CHECK(slot->poses().front().stamp_us == 810 * kMs);
  CHECK(slot->poses().back().stamp_us == 990 * kMs);
  for (std::size_t i = 1; i < slot->num_poses; ++i) {
    const std::int64_t step_us = slot->poses()[i].stamp_us - slot->poses()[i - 1].stamp_us;
    CHECK(step_us >= 2 * kMs);
    CHECK(step_us <= 3 * kMs);
  }
}

TEST_CASE("matching: each scan, image and pose ends in one counter, whatever comes") {
  constexpr unsigned kSeed = 17;
  INFO("seed " << kSeed);
  std::mt19937 random(kSeed);
  MatchBench bench;
  std::uint64_t scans = 0, images = 0, poses = 0;
  std::vector<const Scan*> held;
  std::int64_t last_given_us[6] = {};
  for (int i = 0; i < 20'000; ++i) {
    bench.now_ms += static_cast<std::int64_t>(random() % 8);
    if (random() % 2000 == 0) bench.clock_ahead_ms = static_cast<std::int64_t>(random() % 100'000);
    const std::int64_t now_ms = bench.now_ms + bench.clock_ahead_ms;
    const std::int64_t late_ms = static_cast<std::int64_t>(random() % 40);
    const std::int64_t odd_ms = random() % 50 == 0 ? 700 : 0;
    const std::int64_t stamp_ms = now_ms - late_ms - odd_ms + (random() % 90 == 0 ? 800 : 0);
    switch (random() % 4) {
      case 0: {
        const std::int32_t sensors[] = {kLidar, kRawLidar, kDepth, 4};
        bench.scan(sensors[random() % 4], stamp_ms, static_cast<std::int64_t>(random() % 30));
        ++scans;
        break;
      }
      case 1: {
        const std::int32_t cameras[] = {0, 1, kDepth, 3};
        bench.image(cameras[random() % 4], stamp_ms);
        ++images;
        break;
      }
      default:
        bench.pose(stamp_ms + 15);
        ++poses;
    }
    const Scan* const slot = bench.matcher.take_ready(bench.time());
    if (slot != nullptr) {
      // Rising for each sensor but for a step of the clock.
      if (bench.report().clock_steps == 0) REQUIRE(slot->stamp_us > last_given_us[slot->sensor]);
      last_given_us[slot->sensor] = slot->stamp_us;
      held.push_back(slot);
    }
    if (!held.empty() && random() % 3 == 0) {
      bench.matcher.give_back(held.front());
      held.erase(held.begin());
    }
    REQUIRE(held.size() <= 2);
  }
  const MatchReport& r = bench.report();
  CHECK(r.given > 100);
  CHECK(r.clock_steps > 0);
  CHECK(r.given + r.unknown_sensor + r.scans.future + r.scans.ancient + r.duplicates +
            r.out_of_order + r.without_pose + r.without_images + r.superseded + r.dropped_by_step +
            bench.matcher.pending() ==
        scans);
  CHECK(r.images + r.unknown_camera + r.image_stamps.future + r.image_stamps.ancient +
            r.images_out_of_order ==
        images);
  CHECK(r.poses + r.pose_stamps.future + r.pose_stamps.ancient + r.poses_out_of_order +
            r.poses_not_rigid ==
        poses);
}

TEST_CASE("matching: needs the memory that it says") {
  MatcherConfig config = sample_config();
  const std::size_t before = SensorMatcher::required_bytes(config);
  config.slot.points += 1000;
  // Three that wait, two given out, one that is written: 21 bytes a point each.
  CHECK(SensorMatcher::required_bytes(config) - before == 6 * 21 * 1000);
}

}  // namespace
}  // namespace tessera
