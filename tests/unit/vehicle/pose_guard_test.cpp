// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/pose_guard.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "pose_drive.hpp"
#include "vehicle/pose_assembly.hpp"

namespace tessera {
namespace {

using Drive = PoseDrive;

TEST_CASE("PoseGuard: the fifth good pose in a row is the first that is used") {
  Drive drive;
  CHECK(drive.guard.state(drive.now_us) == PoseVerdict::kNone);
  for (int i = 1; i <= 4; ++i) CHECK(drive.guard.judge(drive.next()) == PoseVerdict::kRecovering);
  for (int i = 5; i <= 50; ++i) REQUIRE(drive.guard.judge(drive.next()) == PoseVerdict::kGood);
  CHECK(drive.guard.state(drive.now_us) == PoseVerdict::kGood);
  CHECK(drive.guard.count(PoseVerdict::kGood) == 46);
  CHECK(drive.guard.count(PoseVerdict::kRecovering) == 4);
}

TEST_CASE("PoseGuard: silence is stale after timeout_us, and is one timeout however long") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  CHECK(drive.guard.state(drive.now_us + 200'000) == PoseVerdict::kGood);
  CHECK(drive.guard.state(drive.now_us + 200'001) == PoseVerdict::kStale);
  CHECK(drive.guard.state(drive.now_us + 9'000'000) == PoseVerdict::kStale);
  CHECK(drive.guard.timeouts() == 1);
  drive.now_us += 9'000'000;
  for (int i = 1; i <= 4; ++i) CHECK(drive.guard.judge(drive.next()) == PoseVerdict::kRecovering);
  CHECK(drive.guard.judge(drive.next()) == PoseVerdict::kGood);
}

TEST_CASE("PoseGuard: a pose that is old when it comes is stale, one from the future corrupt") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  drive.now_us += 240'000;
  PoseObservation old = drive.next();
  old.pose.stamp_us = old.received_us - 200'001;
  CHECK(drive.guard.judge(old) == PoseVerdict::kStale);
  PoseObservation early = drive.next();
  early.pose.stamp_us = early.received_us + 5'001;
  CHECK(drive.guard.judge(early) == PoseVerdict::kCorrupt);
  CHECK(drive.settle(4) == PoseVerdict::kRecovering);
}

TEST_CASE("PoseGuard: NaN, what is not rigid, and what is out of range are corrupt") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  PoseObservation bad[6] = {drive.next(), drive.next(), drive.next(),
                            drive.next(), drive.next(), drive.next()};
  bad[0].pose.T_map_body(0, 3) = kNan;
  bad[1].pose.T_map_body(1, 1) = 2.0;
  bad[2].pose.T_map_body(2, 3) = 100'001.0;
  bad[3].std_position_m = kNan;
  bad[4].std_heading_rad = -0.1;
  bad[5].pose.T_map_body(0, 0) = std::numeric_limits<double>::infinity();
  for (const PoseObservation& observation : bad) {
    CHECK(drive.guard.judge(observation) == PoseVerdict::kCorrupt);
    CHECK(drive.guard.state(drive.now_us) != PoseVerdict::kGood);
  }
  CHECK(drive.guard.count(PoseVerdict::kCorrupt) == 6);
  CHECK(drive.settle(5) == PoseVerdict::kGood);
}

TEST_CASE("PoseGuard: a pose that is not newer is counted and changes nothing") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  PoseObservation again = drive.at(drive.x_m);
  again.received_us += 1'000;
  CHECK(drive.guard.judge(again) == PoseVerdict::kOutOfOrder);
  again.pose.stamp_us -= 30'000;
  CHECK(drive.guard.judge(again) == PoseVerdict::kOutOfOrder);
  CHECK(drive.guard.state(drive.now_us) == PoseVerdict::kGood);
  // But a source that only repeats itself falls silent.
  again.received_us = drive.now_us + 200'001;
  CHECK(drive.guard.judge(again) == PoseVerdict::kOutOfOrder);
  CHECK(drive.guard.state(again.received_us) == PoseVerdict::kStale);
}

TEST_CASE("PoseGuard: deviations up to the limits are good, beyond uncertain") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  PoseObservation pose = drive.next();
  pose.std_position_m = 0.30;
  pose.std_heading_rad = 0.05;
  CHECK(drive.guard.judge(pose) == PoseVerdict::kGood);
  pose = drive.next();
  pose.std_position_m = 0.301;
  CHECK(drive.guard.judge(pose) == PoseVerdict::kUncertain);
  pose = drive.next();
  pose.std_heading_rad = 0.051;
  CHECK(drive.guard.judge(pose) == PoseVerdict::kUncertain);
  CHECK(drive.guard.state(drive.now_us) == PoseVerdict::kUncertain);
}

TEST_CASE("PoseGuard: a step is a jump just beyond what speed, deviations and slack allow") {
  PoseGuardConfig agile;
  agile.max_acceleration_mps2 = 1000.0;
  // 20 ms at 15 m/s, 3 sigma of two deviations of 0.02, and 0.1 m.
  const double reach_m = 0.02 * 15.0 + 3.0 * std::hypot(0.02, 0.02) + 0.1;
  const double reach_rad = 0.02 * 1.5 + 3.0 * std::hypot(0.002, 0.002) + 0.03;
  for (const double beyond : {-1e-6, 1e-6}) {
    Drive drive(agile);
    REQUIRE(drive.settle() == PoseVerdict::kGood);
    drive.now_us += kPeriodUs;
    const PoseVerdict expected = beyond > 0 ? PoseVerdict::kJumping : PoseVerdict::kGood;
    CHECK(drive.guard.judge(drive.at(drive.x_m + reach_m + beyond)) == expected);
    Drive turning(agile);
    REQUIRE(turning.settle() == PoseVerdict::kGood);
    turning.now_us += kPeriodUs;
    CHECK(turning.guard.judge(turning.at(turning.x_m, reach_rad + beyond)) == expected);
  }
}

TEST_CASE("PoseGuard: one outlier is left out, and what came before goes on after five") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  drive.now_us += kPeriodUs;
  CHECK(drive.guard.judge(drive.at(drive.x_m + 30.0)) == PoseVerdict::kJumping);
  CHECK(drive.settle(4) == PoseVerdict::kRecovering);
  CHECK(drive.settle(1) == PoseVerdict::kGood);
  CHECK(drive.guard.relocations() == 0);
}

TEST_CASE("PoseGuard: a jump that stays is believed after ten poses, and told") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  drive.x_m += 30.0;
  for (int i = 1; i <= 9; ++i) CHECK(drive.guard.judge(drive.next()) == PoseVerdict::kJumping);
  CHECK(drive.guard.relocations() == 0);
  for (int i = 1; i <= 4; ++i) CHECK(drive.guard.judge(drive.next()) == PoseVerdict::kRecovering);
  CHECK(drive.guard.relocations() == 1);
  CHECK(drive.guard.judge(drive.next()) == PoseVerdict::kGood);
}

TEST_CASE("PoseGuard: poses that jump to and fro are never believed") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  for (int i = 0; i < 100; ++i) {
    drive.now_us += kPeriodUs;
    const double there = (i % 2 == 0 ? 50.0 : -50.0);
    REQUIRE(drive.guard.judge(drive.at(there)) == PoseVerdict::kJumping);
  }
  CHECK(drive.guard.relocations() == 0);
}

TEST_CASE("PoseGuard: forget() begins anew and keeps counting") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  drive.guard.forget();
  CHECK(drive.guard.state(drive.now_us) == PoseVerdict::kNone);
  drive.now_us -= 500'000;  // The clock was set back.
  drive.x_m += 1'000.0;
  CHECK(drive.settle(5) == PoseVerdict::kGood);
  CHECK(drive.guard.count(PoseVerdict::kRecovering) == 8);
}

TEST_CASE("turn_between: angles about any axis") {
  const auto turned = [](double roll, double pitch, double heading) {
    SentPose pose;
    pose.roll_rad = roll;
    pose.pitch_rad = pitch;
    pose.heading_rad = heading;
    return to_transform(pose);
  };
  const Matrix34d none = turned(0, 0, 0);
  CHECK(turn_between(none, none) == 0.0);
  CHECK(turn_between(none, turned(0.3, 0, 0)) == Approx(0.3));
  CHECK(turn_between(none, turned(0, -0.3, 0)) == Approx(0.3));
  CHECK(turn_between(turned(0, 0, 3.0), turned(0, 0, -3.0)) == Approx(2 * 3.14159265 - 6.0));
}

}  // namespace
}  // namespace tessera
