// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The matching policy, rule by rule: what a scan waits for.
#include <catch2/catch.hpp>

#include "unit/sensing/match_bench.hpp"

namespace tessera {
namespace {

TEST_CASE("matching: a cloud is given out as soon as poses lie on both sides of its stamp") {
  MatchBench bench;
  bench.scan(kLidar, 995);
  CHECK(bench.given() == -1);
  bench.pose(990);
  CHECK(bench.given() == -1);
  bench.pose(1000);
  const Scan* const slot = bench.matcher.take_ready(bench.time());
  REQUIRE(slot != nullptr);
  CHECK(slot->T_map_body(0, 3) == Approx(995));
  CHECK(slot->T_map_sensor(0, 3) == Approx(995));
  CHECK(slot->T_map_sensor(2, 3) == Approx(2));
  REQUIRE(slot->poses().size() == 2);
  CHECK(slot->poses()[0].stamp_us == 990 * kMs);
  CHECK(slot->poses()[1].stamp_us == 1000 * kMs);
  CHECK(slot->num_images == 0);
  CHECK_FALSE(slot->images_missing);
}

TEST_CASE("matching: a sweep waits for the pose at its last point, not at its stamp alone") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.scan(kLidar, 950, 60);
  CHECK(bench.given() == -1);
  bench.pose(1010);
  CHECK(bench.given() == 950);
  CHECK(bench.report().sweep_beyond_poses == 0);
}

TEST_CASE("matching: where poses end within the sweep, it is taken after max_wait_us, counted") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.scan(kLidar, 950, 60);
  bench.now_ms += 99;
  CHECK(bench.given() == -1);
  bench.now_ms += 1;
  CHECK(bench.given() == 950);
  CHECK(bench.report().sweep_beyond_poses == 1);
}

TEST_CASE("matching: without a pose at its stamp a cloud is dropped after max_wait_us") {
  MatchBench bench;
  bench.scan(kLidar, 995);
  bench.pose(990);
  bench.now_ms += 100;
  CHECK(bench.given() == -1);
  CHECK(bench.report().without_pose == 1);
  CHECK(bench.matcher.pending() == 0);
}

TEST_CASE("matching: poses that will never be near its stamp drop a cloud at once") {
  MatchBench bench;
  bench.scan(kLidar, 900);
  bench.pose(810);
  bench.pose(970);  // 160 ms later: farther apart than max_pose_gap_us.
  CHECK(bench.given() == -1);
  CHECK(bench.report().without_pose == 1);
  bench.scan(kLidar, 800);  // Before all poses.
  CHECK(bench.given() == -1);
  CHECK(bench.report().without_pose == 2);
}

TEST_CASE("matching: no pose is interpolated between those before and after they were forgotten") {
  MatchBench bench;
  bench.poses(900, 950);
  bench.scan(kLidar, 975);
  bench.matcher.forget_poses();
  bench.poses(990, 1000);  // Near enough, but of another frame.
  CHECK(bench.given() == -1);
  CHECK(bench.report().without_pose == 1);
  CHECK(bench.matcher.pending() == 0);
  bench.scan(kLidar, 995);
  CHECK(bench.given() == 995);
}

TEST_CASE("matching: a raw cloud waits for each camera to reach its stamp, and takes the nearest") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.image(0, 940);
  bench.image(1, 930);
  bench.scan(kRawLidar, 950);
  CHECK(bench.given() == -1);  // Both could still have a nearer one.
  bench.image(0, 965);
  CHECK(bench.given() == -1);
  bench.image(1, 955);
  const Scan* const slot = bench.matcher.take_ready(bench.time());
  REQUIRE(slot != nullptr);
  REQUIRE(slot->images().size() == 2);
  CHECK(slot->images()[0].camera == 0);
  CHECK(slot->images()[0].stamp_us == 940 * kMs);
  CHECK(slot->images()[0].components()[3] == static_cast<std::uint8_t>(940));
  CHECK(slot->images()[1].stamp_us == 955 * kMs);
  CHECK_FALSE(slot->images_missing);
}

TEST_CASE("matching: an image before the stamp will do if the camera's next one is farther") {
  MatchBench bench;
  bench.poses(900, 1000);
  for (const std::int32_t camera : {0, 1}) {
    bench.image(camera, 850);
    bench.image(camera, 945);
  }
  // Every 95 ms: the next is at 1040, and 945 is 5 ms away.
  bench.scan(kRawLidar, 950);
  CHECK(bench.given() == 950);
}

TEST_CASE("matching: of two images that are as near, the earlier is taken") {
  MatchBench bench;
  bench.poses(900, 1000);
  for (const std::int32_t camera : {0, 1}) {
    bench.image(camera, 940);
    bench.image(camera, 960);
  }
  bench.scan(kRawLidar, 950);
  const Scan* const slot = bench.matcher.take_ready(bench.time());
  REQUIRE(slot != nullptr);
  CHECK(slot->images()[0].stamp_us == 940 * kMs);
}

TEST_CASE("matching: an image over max_image_offset_us away is none") {
  for (const std::int64_t offset_ms : {50, 51}) {
    MatchBench bench;
    bench.poses(800, 1010);
    bench.image(0, 900 + offset_ms);
    bench.image(1, 900);
    bench.scan(kRawLidar, 900);
    CHECK(bench.given() == 900);
    CHECK(bench.report().partly_unlabelled == (offset_ms > 50 ? 1 : 0));
  }
}

TEST_CASE("matching: after max_wait_us a raw cloud is taken with the images that there are") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.image(1, 940);
  bench.scan(kRawLidar, 950);
  bench.now_ms += 99;
  CHECK(bench.given() == -1);
  bench.now_ms += 1;
  const Scan* const slot = bench.matcher.take_ready(bench.time());
  REQUIRE(slot != nullptr);
  CHECK(slot->images_missing);
  REQUIRE(slot->images().size() == 1);
  CHECK(slot->images()[0].camera == 1);
  CHECK(bench.report().partly_unlabelled == 1);
  bench.matcher.give_back(slot);
  bench.scan(kRawLidar, 999);
  bench.now_ms += 100;
  CHECK(bench.given() == 999);
  CHECK(bench.report().unlabelled == 1);
}

TEST_CASE("matching: with missing_images = drop a cloud without all of its images is dropped") {
  MatcherConfig config = sample_config();
  config.missing_images = MissingImages::kDrop;
  MatchBench bench(config);
  bench.poses(900, 1000);
  bench.image(1, 950);
  bench.scan(kRawLidar, 950);
  bench.now_ms += 100;
  CHECK(bench.given() == -1);
  CHECK(bench.report().without_images == 1);
  // A cloud that is labelled needs none.
  bench.scan(kLidar, 950);
  CHECK(bench.given() == 950);
}

TEST_CASE("matching: a depth image needs the labels of its own camera and stamp") {
  MatchBench bench;
  bench.poses(900, 1000);
  bench.image(0, 950);
  bench.image(kDepth, 949);
  bench.scan(kDepth, 950);
  CHECK(bench.given() == -1);
  bench.image(kDepth, 950);
  const Scan* const slot = bench.matcher.take_ready(bench.time());
  REQUIRE(slot != nullptr);
  CHECK(slot->kind == ScanKind::kDepthImage);
  REQUIRE(slot->images().size() == 1);
  CHECK(slot->images()[0].camera == kDepth);
  CHECK(slot->images()[0].stamp_us == 950 * kMs);
}

}  // namespace
}  // namespace tessera
