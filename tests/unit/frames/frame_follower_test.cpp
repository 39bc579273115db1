// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/frame_follower.hpp"

#include <limits>

#include "team_scene.hpp"

namespace tessera {
namespace {

constexpr Instant at_ms(std::int64_t ms) { return Instant::at_us(1000 * ms); }

Matrix34d drawn_frame(oracle::Random& random, double reach_m) {
  Quaternion q{normal(random), normal(random), normal(random), normal(random)};
  normalise(q);
  return transform_of(q, {random.uniform(-reach_m, reach_m), random.uniform(-reach_m, reach_m),
                          random.uniform(-reach_m, reach_m)});
}

TEST_CASE("FrameFollower: no step is over its limits, and the last one ends at the target") {
  oracle::Random random(261);
  for (int round = 0; round < 60; ++round) {
    // Near ones, ones of any turn, and nearly half a turn.
    const Matrix34d start = drawn_frame(random, 100.0);
    const Point3d p_map{random.uniform(-300, 300), random.uniform(-300, 300), 1.0};
    Matrix34d target = drawn_frame(random, 20.0);
    if (round % 3 == 0)
      target = product(start, motion_about(p_map, {0.3, -0.2, 0.1}, {0, 0, 0.02}));
    if (round % 3 == 1) target = product(start, motion_about(p_map, {2, 0, 0}, {0, 0, 1e4}));
    FrameFollower follower;
    REQUIRE(follower.use_at_once(start) == Status::kOk);
    REQUIRE(follower.follow(target) == Status::kOk);
    CHECK_FALSE(follower.arrived());
    std::int64_t ms = 0;
    int steps = 0;
    while (!follower.arrived() && steps < 20'000) {
      const Matrix34d before = follower.frame();
      REQUIRE(follower.step(p_map, at_ms(ms += 100)));
      const Matrix34d& after = follower.frame();
      REQUIRE((apply(after, p_map) - apply(before, p_map)).norm() <= 0.1 + 1e-9);
      REQUIRE(angle_between(before, after) <= FrameFollower::kMostStep_rad + 1e-8);
      ++steps;
    }
    CHECK(follower.frame() == target);
    // No more of them than 0.8 of the limits need.
    const double way_m = (apply(start, p_map) - apply(target, p_map)).norm();
    const double way = std::max(way_m / FrameFollower::kMostStep_m,
                                angle_between(start, target) / FrameFollower::kMostStep_rad);
    CHECK(steps <= 2 + way / 0.8);
    CHECK_FALSE(follower.step(p_map, at_ms(ms += 100)));
  }
}

TEST_CASE("FrameFollower: ten steps a second at most, whatever the caller does") {
  FrameFollower follower;
  REQUIRE(follower.use_at_once(Matrix34d::Identity()) == Status::kOk);
  Matrix34d target = Matrix34d::Identity();
  target(0, 3) = 5.0;
  REQUIRE(follower.follow(target) == Status::kOk);
  int steps = 0;
  for (int ms = 0; ms < 1000; ++ms) steps += follower.step(Point3d::Zero(), at_ms(ms)) ? 1 : 0;
  CHECK(steps == 10);
  CHECK(follower.frame()(0, 3) == Approx(1.0));
  CHECK_FALSE(follower.step(Point3d::Zero(), at_ms(500)));  // back in time
  CHECK(follower.step(Point3d::Zero(), at_ms(1000)));
  CHECK_FALSE(follower.step(Point3d::Zero(), at_ms(1099)));
}

TEST_CASE("FrameFollower: a step is measured where the robot is, not at the map's origin") {
  Matrix34d target = motion_about(Point3d::Zero(), Point3d::Zero(), {0, 0, 0.005});
  FrameFollower at_origin;
  REQUIRE(at_origin.use_at_once(Matrix34d::Identity()) == Status::kOk);
  FrameFollower far = at_origin;
  REQUIRE(at_origin.follow(target) == Status::kOk);
  REQUIRE(far.follow(target) == Status::kOk);
  REQUIRE(at_origin.step(Point3d::Zero(), at_ms(0)));
  CHECK(at_origin.arrived());
  REQUIRE(far.step({100, 0, 0}, at_ms(0)));
  CHECK_FALSE(far.arrived());
  CHECK(apply(far.frame(), {100, 0, 0}).y() == Approx(0.1));
}

TEST_CASE(
    "FrameFollower: what users give is in use at once, also amid the steps to another frame") {
  FrameFollower follower;
  Matrix34d target = Matrix34d::Identity();
  target(1, 3) = 40.0;
  CHECK_FALSE(follower.in_use());
  CHECK_FALSE(follower.step(Point3d::Zero(), at_ms(0)));
  // The first frame has none before it from which it could step.
  REQUIRE(follower.follow(Matrix34d::Identity()) == Status::kOk);
  CHECK(follower.arrived());
  REQUIRE(follower.follow(target) == Status::kOk);
  REQUIRE(follower.step(Point3d::Zero(), at_ms(100)));
  Matrix34d given = Matrix34d::Identity();
  given(2, 3) = 7.0;
  REQUIRE(follower.use_at_once(given) == Status::kOk);
  CHECK(follower.frame() == given);
  CHECK(follower.arrived());
  CHECK_FALSE(follower.step(Point3d::Zero(), at_ms(200)));
}

TEST_CASE("FrameFollower: a withdrawal stops the use; what comes after is used at once") {
  FrameFollower follower;
  Matrix34d target = Matrix34d::Identity();
  REQUIRE(follower.use_at_once(target) == Status::kOk);
  target(0, 3) = 1.0;
  REQUIRE(follower.follow(target) == Status::kOk);
  follower.withdraw();
  CHECK_FALSE(follower.in_use());
  CHECK_FALSE(follower.arrived());
  CHECK_FALSE(follower.step(Point3d::Zero(), at_ms(0)));
  REQUIRE(follower.follow(target) == Status::kOk);
  CHECK(follower.in_use());
  CHECK(follower.frame() == target);
}

TEST_CASE("FrameFollower: a target that is no rigid transform changes nothing") {
  FrameFollower follower;
  Matrix34d bad = Matrix34d::Identity();
  bad(0, 0) = 2.0;
  CHECK(follower.follow(bad) == Status::kInvalidArgument);
  CHECK(follower.use_at_once(bad) == Status::kInvalidArgument);
  CHECK_FALSE(follower.in_use());
  REQUIRE(follower.follow(Matrix34d::Identity()) == Status::kOk);
  bad(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK(follower.follow(bad) == Status::kInvalidArgument);
  CHECK(follower.use_at_once(bad) == Status::kInvalidArgument);
  CHECK(follower.arrived());
}

}  // namespace
}  // namespace tessera
