// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where usable poses come from: the modes of VehicleInputs.
#include <catch2/catch.hpp>
#include <cmath>

#include "bus_drive.hpp"
#include "sample_pose.hpp"
#include "vehicle/vehicle_inputs.hpp"

namespace tessera {
namespace {

using Drive = BusDrive;

TEST_CASE("VehicleInputs: lost poses are bridged by odometry, bounded in time") {
  Drive drive;
  drive.settle();
  const double x_lost = drive.x_m;
  const std::int64_t lost_us = drive.now_us;
  std::int64_t bridged_until_us = 0;
  for (int i = 0; i < 200; ++i) {
    const auto taken = drive.step(false);
    if (!taken.pose.has_value()) continue;
    REQUIRE(taken.pose->usable);
    REQUIRE(taken.pose->source == PoseSource::kOdometry);
    // It goes on at 1 m/s from where it was.
    const double expected = x_lost + static_cast<double>(drive.now_us - 20'000 - lost_us) * 1e-6;
    REQUIRE(taken.pose->observation.pose.T_map_body(0, 3) == Approx(expected).margin(0.04));
    bridged_until_us = drive.now_us;
  }
  // From the timeout on until max_bridge_us.
  CHECK(bridged_until_us - lost_us > 1'900'000);
  CHECK(bridged_until_us - lost_us < 2'040'000);
  CHECK(drive.inputs.pose_state(drive.now_us) == PoseVerdict::kStale);
  CHECK(drive.inputs.pose_source(drive.now_us) == PoseSource::kNone);
}

TEST_CASE("VehicleInputs: bridging ends when the deviations are too large, or odometry stops") {
  VehicleInputsConfig config;
  config.max_bridge_us = 60'000'000;
  Drive drive(config);
  drive.settle();
  int bridged = 0;
  for (int i = 0; i < 3000; ++i) bridged += drive.step(false).pose.has_value() ? 1 : 0;
  // 0.02 m/s and 0.002 rad/s use up 0.3 m in some seconds.
  CHECK(bridged > 100);
  CHECK(bridged < 700);
  Drive silent;
  silent.settle();
  for (int i = 0; i < 12; ++i) static_cast<void>(silent.step(false));
  REQUIRE(silent.inputs.pose_source(silent.now_us) == PoseSource::kOdometry);
  CHECK(silent.inputs.pose_source(silent.now_us + 150'001) == PoseSource::kNone);
}

TEST_CASE("VehicleInputs: in mode pose nothing is bridged") {
  Drive drive({.mode = PoseMode::kPose});
  drive.settle();
  for (int i = 0; i < 100; ++i) CHECK_FALSE(drive.step(false).pose.has_value());
  CHECK(drive.inputs.pose_source(drive.now_us) == PoseSource::kNone);
}

TEST_CASE("VehicleInputs: odometry alone starts at the origin, and in another frame after a gap") {
  Drive drive({.mode = PoseMode::kOdometry});
  CHECK(drive.inputs.pose_state(drive.now_us) == PoseVerdict::kNone);
  VehicleInputs::Taken taken;
  for (int i = 0; i < 52; ++i) taken = drive.step(false);
  REQUIRE(taken.pose.has_value());
  CHECK(taken.pose->source == PoseSource::kOdometry);
  CHECK(taken.pose->observation.pose.T_map_body(0, 3) == Approx(1.0));
  CHECK(taken.pose->relocations == 0);
  drive.now_us += 200'000;
  CHECK(drive.inputs.pose_state(drive.now_us) == PoseVerdict::kStale);
  // The counter goes on, so none of it is lost; but nobody knows where the vehicle went.
  taken = drive.step(false);
  REQUIRE(taken.pose.has_value());
  CHECK(taken.pose->relocations == 1);
  CHECK(drive.inputs.pose_state(drive.now_us - 20'000) == PoseVerdict::kGood);
}

TEST_CASE("VehicleInputs: odometry that is not valid or out of range is not used") {
  Drive drive({.mode = PoseMode::kOdometry});
  for (int i = 0; i < 5; ++i)
    CHECK_FALSE(
        drive.inputs.take(drive.vehicle.odometry({.valid = false}), 1000 * i).pose.has_value());
  CHECK(drive.inputs.counters().invalid_odometry == 4);
}

TEST_CASE("VehicleInputs: a frozen pose is found by the wheels") {
  Drive drive({.mode = PoseMode::kPose});
  drive.settle();
  bool found = false;
  const double stays = drive.x_m;
  for (int i = 0; i < 100 && !found; ++i) {
    drive.x_m = stays;
    const auto taken = drive.step();
    found = taken.pose.has_value() && taken.pose->verdict == PoseVerdict::kFrozen;
    CHECK(i < 60);
  }
  CHECK(found);
  CHECK(drive.inputs.pose_source(drive.now_us) == PoseSource::kNone);
}

/// Poses that stay at one place while the wheels turn, until they are found out; those of odometry
/// that were given meanwhile are counted.
int freeze(Drive& drive) {
  int reckoned = 0;
  const double stays = drive.x_m;
  for (int i = 0; i < 100; ++i) {
    drive.x_m = stays;
    reckoned += drive.step(false).pose.has_value() ? 1 : 0;
    const auto taken = take_all(drive.inputs, drive.vehicle.pose(sent_pose(stays)), drive.now_us);
    if (taken.pose.has_value() && taken.pose->verdict == PoseVerdict::kFrozen) break;
  }
  CHECK(drive.inputs.pose_state(drive.now_us) == PoseVerdict::kFrozen);
  return reckoned;
}

TEST_CASE("VehicleInputs: a frozen pose is not bridged: it was anchored to before it was found") {
  Drive drive;
  drive.settle();
  CHECK(freeze(drive) == 0);
  CHECK(drive.inputs.pose_source(drive.now_us) == PoseSource::kNone);
  // Nor is it when poses fall silent then.
  for (int i = 0; i < 200; ++i) REQUIRE_FALSE(drive.step(false).pose.has_value());
  // But once poses were good again.
  drive.settle();
  int bridged = 0;
  for (int i = 0; i < 50; ++i) bridged += drive.step(false).pose.has_value() ? 1 : 0;
  CHECK(bridged > 30);
}

TEST_CASE("VehicleInputs: odometry goes on in the frame that was left only under its number") {
  Drive drive;
  drive.settle();
  drive.x_m += 30.0;
  int old_frame = 0;
  int new_frame = 0;
  const auto check = [&](const JudgedPose& pose) {
    if (!pose.usable) return;
    const bool is_new = pose.observation.pose.T_map_body(0, 3) > 20.0;
    REQUIRE(pose.relocations == (is_new ? 1 : 0));
    ++(is_new ? new_frame : old_frame);
  };
  for (int i = 0; i < 30; ++i) {
    const auto reckoned = drive.step(false);
    if (reckoned.pose.has_value()) check(*reckoned.pose);
    std::int64_t at_us = drive.now_us - 10'000;
    const auto sent = take_all(drive.inputs, drive.vehicle.pose(sent_pose(drive.x_m)), at_us);
    if (sent.pose.has_value()) check(*sent.pose);
  }
  // Bridged while it was a jump, from the frame before; then nothing until five good poses.
  CHECK(old_frame == 9);
  CHECK(new_frame == 30 - 9 - 4);
}

TEST_CASE("VehicleInputs: a speed or yaw rate beyond the vehicle's is not reckoned with") {
  for (const WheelMotion wild : {WheelMotion{60.0, 0.0}, WheelMotion{-15.1, 0.0},
                                 WheelMotion{1.0, 1.6}, WheelMotion{1.0, -6.0}}) {
    Drive drive({.mode = PoseMode::kOdometry});
    for (int i = 0; i < 52; ++i) static_cast<void>(drive.step(false));
    CHECK_FALSE(drive.inputs.take(drive.vehicle.odometry(wild), drive.now_us).pose.has_value());
    CHECK(drive.inputs.counters().invalid_odometry == 1);
    drive.now_us += 20'000;
    const auto taken = drive.step(false);
    REQUIRE(taken.pose.has_value());
    CHECK(taken.pose->observation.pose.T_map_body(0, 3) == Approx(1.04));
    CHECK(taken.pose->observation.pose.T_map_body(1, 3) == Approx(0.0).margin(1e-9));
    CHECK(taken.pose->relocations == 0);
  }
}

TEST_CASE("VehicleInputs: bridging does not take what the vehicle cannot do, and ends with it") {
  Drive drive;
  drive.settle();
  for (int i = 0; i < 20; ++i) static_cast<void>(drive.step(false));
  REQUIRE(drive.inputs.pose_source(drive.now_us) == PoseSource::kOdometry);
  for (int i = 0; i < 8; ++i, drive.now_us += 20'000)
    CHECK_FALSE(drive.inputs.take(drive.vehicle.odometry({60.0, 0.0}), drive.now_us).pose);
  CHECK(drive.inputs.pose_source(drive.now_us) == PoseSource::kNone);
  CHECK(drive.inputs.counters().invalid_odometry == 8);
}

}  // namespace
}  // namespace tessera
