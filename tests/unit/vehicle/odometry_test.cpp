// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/odometry.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "vehicle/pose_assembly.hpp"

namespace tessera {
namespace {

Matrix34d pose_at(double x, double y, double heading, double pitch = 0.0) {
  SentPose pose;
  pose.p_map = Point3d(x, y, 0.3);
  pose.heading_rad = heading;
  pose.pitch_rad = pitch;
  return to_transform(pose);
}

OdometryMeasurement measured(std::int64_t stamp_us, double speed, double yaw_rate) {
  return {stamp_us, speed, yaw_rate, 0.05, 0.01};
}

TEST_CASE("after_arc: a straight line, a circle, and turning on the spot") {
  const Matrix34d start = pose_at(1.0, 2.0, 0.5);
  const Matrix34d straight = after_arc(start, 2.0, 0.0, 3.0);
  CHECK(straight(0, 3) == Approx(1.0 + 6.0 * std::cos(0.5)));
  CHECK(straight(1, 3) == Approx(2.0 + 6.0 * std::sin(0.5)));
  // A quarter of a circle to the left: radius 4 m.
  const Matrix34d quarter = after_arc(pose_at(0, 0, 0), 2.0, 0.5, 3.14159265358979 / 2 / 0.5);
  CHECK(quarter(0, 3) == Approx(4.0));
  CHECK(quarter(1, 3) == Approx(4.0));
  CHECK(turn_between(quarter, pose_at(0, 0, 3.14159265358979 / 2)) == Approx(0.0).margin(1e-7));
  const Matrix34d spot = after_arc(start, 0.0, -1.0, 0.4);
  CHECK(spot(0, 3) == start(0, 3));
  CHECK(turn_between(spot, pose_at(1, 2, 0.1)) == Approx(0.0).margin(1e-7));
}

TEST_CASE("after_arc: the same as by a million small steps, also for hardly any turn") {
  for (const double yaw_rate : {0.7, -0.3, 1e-3, 1.9e-4, 1e-5, 0.0}) {
    const Matrix34d arc = after_arc(pose_at(0, 0, 0.2), -3.0, yaw_rate, 1.0);
    double x = 0.0;
    double y = 0.0;
    constexpr int kSteps = 1'000'000;
    for (int i = 0; i < kSteps; ++i) {
      const double heading = 0.2 + yaw_rate * (i + 0.5) / kSteps;
      x += -3.0 / kSteps * std::cos(heading);
      y += -3.0 / kSteps * std::sin(heading);
    }
    CHECK(arc(0, 3) == Approx(x).margin(1e-9));
    CHECK(arc(1, 3) == Approx(y).margin(1e-9));
    CHECK(check_rigid(arc) == Status::kOk);
  }
}

TEST_CASE("after_arc: along the slope that the body stands on") {
  const Matrix34d climbing = after_arc(pose_at(0, 0, 0, -0.1), 2.0, 0.0, 1.0);
  CHECK(climbing(0, 3) == Approx(2.0 * std::cos(0.1)));
  CHECK(climbing(2, 3) == Approx(0.3 + 2.0 * std::sin(0.1)));
}

TEST_CASE("Odometry: carries a pose on that is older than the last measurements") {
  Odometry odometry;
  for (std::int64_t t = 0; t <= 500'000; t += 10'000) {
    CHECK(odometry.measure(measured(t, 2.0, 0.1)));
    CHECK_FALSE(odometry.is_known());
  }
  REQUIRE(odometry.anchor({303'000, pose_at(5, 5, 1.0)}, 0.1, 0.02));
  CHECK(odometry.now().pose.stamp_us == 500'000);
  CHECK(odometry.reckoned_us() == 197'000);
  const Matrix34d expected = after_arc(pose_at(5, 5, 1.0), 2.0, 0.1, 0.197);
  CHECK((odometry.now().pose.T_map_body - expected).norm() == Approx(0.0).margin(1e-12));
  // Deviations: 0.02 + 0.01 * t, and 0.1 + 0.05 * t and what the heading does to the way.
  CHECK(odometry.now().std_heading_rad == Approx(0.02 + 0.01 * 0.197));
  CHECK(odometry.now().std_position_m > 0.1 + 0.05 * 0.197 + 2.0 * 0.197 * 0.02);
  CHECK(odometry.now().std_position_m < 0.1 + 0.05 * 0.197 + 2.0 * 0.197 * 0.023);
}

TEST_CASE("Odometry: changing speed is taken as its mean between measurements") {
  Odometry odometry;
  REQUIRE(odometry.measure(measured(0, 0.0, 0.0)));
  REQUIRE(odometry.anchor({0, pose_at(0, 0, 0)}, 0.0, 0.0));
  for (int i = 1; i <= 100; ++i) REQUIRE(odometry.measure(measured(i * 10'000, i * 0.01, 0.0)));
  CHECK(odometry.now().pose.T_map_body(0, 3) == Approx(0.5));
}

TEST_CASE("Odometry: behind a gap nothing is known until the next pose") {
  Odometry odometry;
  REQUIRE(odometry.measure(measured(0, 1.0, 0.0)));
  REQUIRE(odometry.anchor({0, pose_at(0, 0, 0)}, 0.0, 0.0));
  CHECK(odometry.measure(measured(150'000, 1.0, 0.0)));
  CHECK(odometry.is_known());
  CHECK_FALSE(odometry.measure(measured(300'001, 1.0, 0.0)));
  CHECK_FALSE(odometry.is_known());
  // What was measured before the gap is of no use to a pose before it.
  CHECK_FALSE(odometry.anchor({140'000, pose_at(0, 0, 0)}, 0.0, 0.0));
  CHECK(odometry.anchor({300'001, pose_at(0, 0, 0)}, 0.0, 0.0));
  CHECK_FALSE(odometry.anchor({450'002, pose_at(0, 0, 0)}, 0.0, 0.0));
}

TEST_CASE("Odometry: stamps that do not rise and numbers that are none are refused") {
  Odometry odometry;
  CHECK_FALSE(odometry.anchor({0, pose_at(0, 0, 0)}, 0.0, 0.0));
  REQUIRE(odometry.measure(measured(1'000, 1.0, 0.0)));
  CHECK_FALSE(odometry.measure(measured(1'000, 1.0, 0.0)));
  CHECK_FALSE(odometry.measure(measured(999, 1.0, 0.0)));
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(odometry.measure(measured(2'000, kNan, 0.0)));
  CHECK_FALSE(odometry.measure({2'000, 1.0, 0.0, -0.1, 0.0}));
  CHECK(odometry.measure(measured(2'000, 1.0, 0.0)));
}

TEST_CASE("Odometry: only the last measurements are kept") {
  Odometry odometry;
  for (int i = 0; i < 200; ++i) REQUIRE(odometry.measure(measured(i * 10'000, 1.0, 0.0)));
  CHECK_FALSE(odometry.anchor({1'359'000, pose_at(0, 0, 0)}, 0.0, 0.0));
  CHECK(odometry.anchor({1'360'000, pose_at(0, 0, 0)}, 0.0, 0.0));
  CHECK(odometry.now().pose.T_map_body(0, 3) == Approx(0.63));
}

}  // namespace
}  // namespace tessera
