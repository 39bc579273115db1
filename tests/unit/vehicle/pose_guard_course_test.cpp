// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Jumps that the speed allows and the acceleration does not: poses at the rate of the scans.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "vehicle/pose_guard.hpp"

namespace tessera {
namespace {

/// Poses of a vehicle along x, at any rate and any velocity; side_m: where the pose source has it.
struct Course {
  explicit Course(std::int64_t period, double speed_mps = 8.6, PoseGuardConfig config = {})
      : guard(config), period_us(period), velocity_mps(speed_mps) {}
  PoseVerdict next(double acceleration_mps2 = 0.0) {
    const double seconds = 1e-6 * static_cast<double>(period_us);
    now_us += period_us;
    x_m += seconds * (velocity_mps + 0.5 * acceleration_mps2 * seconds);
    velocity_mps += acceleration_mps2 * seconds;
    return judge(x_m);
  }
  PoseVerdict judge(double at_x_m) {
    Matrix34d T = Matrix34d::Identity();
    T(0, 3) = at_x_m * std::cos(heading_rad);
    T(1, 3) = at_x_m * std::sin(heading_rad) + side_m;
    return guard.judge({.pose = {now_us, T}, .received_us = now_us, .std_position_m = 0.02});
  }
  PoseVerdict drive(int poses) {
    PoseVerdict verdict = PoseVerdict::kNone;
    for (int i = 0; i < poses; ++i) verdict = next();
    return verdict;
  }
  PoseGuard guard;
  std::int64_t period_us;
  double velocity_mps;
  double heading_rad = 0.0;
  double side_m = 0.0;
  double x_m = 0.0;
  std::int64_t now_us = 1'000'000;
};

/// As wide as a LiDAR odometry of 5 Hz needs it.
PoseGuardConfig patient() {
  PoseGuardConfig config;
  config.timeout_us = config.max_age_us = 500'000;
  return config;
}

TEST_CASE("PoseGuard: a jump of 1 m to the side is noticed at any rate, and believed after ten") {
  for (const std::int64_t period_us : {10'000, 20'000, 50'000, 100'000, 200'000}) {
    for (const double speed_mps : {0.0, 1.0, 8.6, 13.0}) {
      for (const double jump_m : {1.0, -1.0}) {
        Course course(period_us, speed_mps, patient());
        REQUIRE(course.drive(30) == PoseVerdict::kGood);
        course.side_m = jump_m;
        for (int i = 1; i <= 9; ++i) CHECK(course.next() == PoseVerdict::kJumping);
        CHECK(course.guard.relocations() == 0);
        CHECK(course.next() != PoseVerdict::kJumping);
        CHECK(course.guard.relocations() == 1);
        CHECK(course.drive(10) == PoseVerdict::kGood);
      }
    }
  }
}

TEST_CASE("PoseGuard: a jump of 0.4 m at 10 Hz is noticed, with wheels that say the speed too") {
  for (const bool wheels : {false, true}) {
    Course course(100'000);
    for (int i = 0; i < 30; ++i) {
      if (wheels) course.guard.moves({course.now_us, MotionState::kMoving, 8.6, 0.0});
      static_cast<void>(course.next());
    }
    course.side_m = 0.4;
    for (int i = 0; i < 10; ++i) {
      if (wheels) course.guard.moves({course.now_us, MotionState::kMoving, 8.6, 0.0});
      static_cast<void>(course.next());
    }
    CHECK(course.guard.relocations() == 1);
  }
}

TEST_CASE("PoseGuard: a frame that is turned as well is believed after ten poses") {
  Course course(100'000);
  REQUIRE(course.drive(30) == PoseVerdict::kGood);
  course.side_m = 2.0;
  course.heading_rad = 1.0;
  CHECK(course.drive(10) != PoseVerdict::kJumping);
  CHECK(course.guard.relocations() == 1);
}

TEST_CASE("PoseGuard: what brakes, starts and turns within the acceleration never jumps") {
  for (const std::int64_t period_us : {10'000, 20'000, 100'000, 200'000}) {
    Course course(period_us, 0.0, patient());
    REQUIRE(course.drive(10) == PoseVerdict::kGood);
    const double seconds = 1e-6 * static_cast<double>(period_us);
    for (int turns = 0; turns < 5; ++turns) {
      for (double t = 0.0; t < 1.4; t += seconds) CHECK(course.next(9.9) == PoseVerdict::kGood);
      while (course.velocity_mps > 1e-9) {
        const double brakes_mps2 = std::min(9.9, course.velocity_mps / seconds);
        CHECK(course.next(-brakes_mps2) == PoseVerdict::kGood);
      }
      CHECK(course.drive(5) == PoseVerdict::kGood);
    }
  }
}

TEST_CASE("PoseGuard: one pose off the course is left out, and no frame is left for it") {
  Course course(100'000);
  REQUIRE(course.drive(30) == PoseVerdict::kGood);
  course.side_m = 1.0;
  CHECK(course.next() == PoseVerdict::kJumping);
  course.side_m = 0.0;
  CHECK(course.drive(4) == PoseVerdict::kRecovering);
  CHECK(course.next() == PoseVerdict::kGood);
  CHECK(course.guard.relocations() == 0);
}

TEST_CASE("PoseGuard: the last pose again and again at full speed is frozen, and no other frame") {
  Course course(100'000);
  REQUIRE(course.drive(30) == PoseVerdict::kGood);
  const double held_m = course.x_m;
  for (int i = 0; i < 8; ++i) {
    course.now_us += course.period_us;
    course.x_m += 0.86;
    CHECK(course.judge(held_m) == PoseVerdict::kFrozen);
  }
  CHECK(course.drive(5) == PoseVerdict::kGood);
  CHECK(course.guard.relocations() == 0);
  CHECK(course.guard.count(PoseVerdict::kJumping) == 0);
}

TEST_CASE("PoseGuard: the acceleration is a setting") {
  PoseGuardConfig agile;
  agile.max_acceleration_mps2 = 200.0;
  Course course(100'000, 8.6, agile);
  REQUIRE(course.drive(30) == PoseVerdict::kGood);
  course.side_m = 1.0;
  CHECK(course.next() == PoseVerdict::kGood);
}

}  // namespace
}  // namespace tessera
