// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/vehicle_inputs.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bus_drive.hpp"
#include "sample_pose.hpp"

namespace tessera {
namespace {

using namespace bus;

using Drive = BusDrive;

TEST_CASE("VehicleInputs: three frames make the pose that was sent, stamped when it was measured") {
  Drive drive;
  drive.settle();
  SentPose sent = sent_pose(drive.x_m, -0.05, 0.01);
  sent.roll_rad = 0.02;
  sent.pitch_rad = -0.03;
  const std::int64_t first_us = drive.now_us + 1'000;
  const auto taken = take_all(drive.inputs, drive.vehicle.pose(sent), drive.now_us);
  REQUIRE(taken.pose.has_value());
  CHECK(taken.pose->usable);
  CHECK(taken.pose->source == PoseSource::kPose);
  const PoseObservation& got = taken.pose->observation;
  CHECK(got.pose.stamp_us == first_us - 10'000);
  CHECK((got.pose.T_map_body - to_transform(sent)).cwiseAbs().maxCoeff() < 1e-3);
  CHECK(got.std_position_m == Approx(0.02));
  CHECK(got.std_heading_rad == Approx(0.003));
}

TEST_CASE("VehicleInputs: one frame of CAN FD does the same") {
  Drive drive;
  for (int i = 0; i < 6; ++i) {
    drive.now_us += 20'000;
    const auto taken = drive.inputs.take(drive.vehicle.fd_pose(sent_pose(0.02 * i)), drive.now_us);
    CHECK(taken.pose.has_value() == (i >= 1));  // The first has no counter to be compared with.
    if (i < 1) continue;
    CHECK(taken.pose->usable == (i >= 5));
    CHECK(taken.pose->observation.pose.T_map_body(0, 3) == Approx(0.02 * i));
    CHECK(taken.pose->observation.pose.stamp_us == drive.now_us - 10'000);
  }
  static_cast<void>(drive.inputs.take(drive.vehicle.fd_pose(sent_pose(0.1), false), drive.now_us));
  CHECK(drive.inputs.counters().invalid_poses == 1);
}

TEST_CASE("VehicleInputs: frames of different poses are never put together") {
  Drive drive;
  drive.settle();
  const auto first = drive.vehicle.pose(sent_pose(drive.x_m));
  const auto second = drive.vehicle.pose(sent_pose(drive.x_m + 0.02));
  // Two frames of the first, the last of the second; and the first's last frame too late.
  CHECK_FALSE(take_all(drive.inputs, std::array{first[0], first[1], second[2]}, drive.now_us).pose);
  CHECK(drive.inputs.counters().incomplete_poses == 1);
  CHECK_FALSE(take_all(drive.inputs, std::array{second[0]}, drive.now_us).pose);
  drive.now_us += 16'000;
  CHECK_FALSE(take_all(drive.inputs, std::array{second[1]}, drive.now_us).pose);
  CHECK(drive.inputs.counters().incomplete_poses == 2);
  // In any order of its frames a pose is whole.
  auto third = drive.vehicle.pose(sent_pose(drive.x_m + 0.04));
  std::swap(third[0], third[2]);
  drive.now_us += 16'000;
  CHECK(take_all(drive.inputs, third, drive.now_us).pose.has_value());
}

TEST_CASE("VehicleInputs: sixteen lost poses later the counter is the same, the pose is not") {
  Drive drive;
  drive.settle();
  const auto old = drive.vehicle.pose(sent_pose(drive.x_m));
  static_cast<void>(take_all(drive.inputs, std::array{old[0]}, drive.now_us));
  for (int i = 0; i < 15; ++i) static_cast<void>(drive.vehicle.pose(sent_pose(0)));
  drive.now_us += 320'000;
  const auto now = drive.vehicle.pose(sent_pose(9.0));
  CHECK_FALSE(take_all(drive.inputs, std::array{now[1], now[2]}, drive.now_us).pose.has_value());
}

TEST_CASE("VehicleInputs: a signal out of its range or 'no pose' makes no pose") {
  Drive drive;
  drive.settle();
  auto frames = drive.vehicle.pose(sent_pose(drive.x_m));
  const auto reseal = [&](CanFrame& frame) {
    const auto counter = static_cast<std::uint8_t>(raw_of(frame.bytes(), kCounter4));
    e2e_protect(E2eProfile::kProfile1, e2e_data_id(frame.id), counter,
                std::span(frame.data).first(frame.size));
  };
  put_raw(frames[1].data, kAge, kNoPoseAge);
  reseal(frames[1]);
  CHECK_FALSE(take_all(drive.inputs, frames, drive.now_us).pose.has_value());
  CHECK(drive.inputs.counters().invalid_poses == 1);
  frames = drive.vehicle.pose(sent_pose(drive.x_m));
  put_raw(frames[2].data, kRoll, 2000);
  reseal(frames[2]);
  CHECK_FALSE(take_all(drive.inputs, frames, drive.now_us).pose.has_value());
  CHECK(drive.inputs.counters().invalid_poses == 2);
}

TEST_CASE("VehicleInputs: damaged, repeated, foreign and misshapen frames are told apart") {
  Drive drive;
  drive.settle();
  const VehicleInputReport before = drive.inputs.counters();
  CanFrame frame = drive.vehicle.state(MotionState::kStanding);
  static_cast<void>(drive.inputs.take(frame, drive.now_us));  // Initial.
  static_cast<void>(drive.inputs.take(frame, drive.now_us));  // Repeated.
  frame = drive.vehicle.state(MotionState::kMoving);
  static_cast<void>(drive.inputs.take(frame, drive.now_us));
  CHECK(drive.inputs.motion(drive.now_us) == MotionState::kMoving);
  CHECK(drive.inputs.motion(drive.now_us + 300'001) == MotionState::kUnknown);
  frame.data[1] ^= 0x10U;
  static_cast<void>(drive.inputs.take(frame, drive.now_us));  // Wrong checksum.
  frame.size = 3;
  static_cast<void>(drive.inputs.take(frame, drive.now_us));
  frame.id += 0x200;
  static_cast<void>(drive.inputs.take(frame, drive.now_us));
  static_cast<void>(drive.inputs.take({.id = kDefaultBaseId + kIdHeartbeat, .size = 8}, 0));
  const VehicleInputReport after = drive.inputs.counters();
  CHECK(after.frames - before.frames == 7);
  CHECK(after.foreign - before.foreign == 2);
  CHECK(after.misshapen - before.misshapen == 1);
  CHECK(after.refused - before.refused == 3);
  CHECK(after.accepted - before.accepted == 1);
  static_cast<void>(
      drive.inputs.take(drive.vehicle.state(static_cast<MotionState>(9)), drive.now_us));
  CHECK(drive.inputs.counters().invalid_states == 1);
}

TEST_CASE("VehicleInputs: frames of another base are foreign, or refused if they claim ours") {
  VehicleInputs inputs({.base_id = 0x200});
  VehicleFrames ours(0x200);
  VehicleFrames others(0x100);
  static_cast<void>(inputs.take(ours.odometry({1.0, 0.0}), 1));
  static_cast<void>(inputs.take(ours.odometry({1.0, 0.0}), 2));
  CHECK(inputs.counters().accepted == 1);
  CanFrame frame = others.odometry({1.0, 0.0});
  static_cast<void>(inputs.take(frame, 3));
  CHECK(inputs.counters().foreign == 1);
  frame.id += 0x100;
  static_cast<void>(inputs.take(frame, 4));
  CHECK(inputs.counters().refused == 2);
  // A base that is none is the default.
  CHECK(VehicleInputs({.base_id = 0x111}).config().base_id == kDefaultBaseId);
}

TEST_CASE("VehicleInputs: a command is taken once, by its second frame, and not that of before") {
  Drive drive;
  std::int64_t now = 0;
  const auto say = [&](VehicleCommand command, std::uint8_t number) {
    return drive.inputs.take(drive.vehicle.command(command, number), now += 1000).command;
  };
  for (int i = 0; i < 10; ++i) CHECK_FALSE(say(VehicleCommand::kClear, 7).has_value());
  CHECK_FALSE(say(VehicleCommand::kPause, 8).has_value());
  const auto taken = say(VehicleCommand::kPause, 8);
  REQUIRE(taken.has_value());
  CHECK(taken->command == VehicleCommand::kPause);
  CHECK(taken->number == 8);
  CHECK(taken->received_us == now);
  for (int i = 0; i < 10; ++i) CHECK_FALSE(say(VehicleCommand::kPause, 8).has_value());
  // Flickering: never twice the same.
  for (int i = 0; i < 10; ++i) {
    CHECK_FALSE(say(VehicleCommand::kClear, 9).has_value());
    CHECK_FALSE(say(VehicleCommand::kStart, 9).has_value());
  }
  CHECK_FALSE(say(VehicleCommand::kNone, 10).has_value());
  CHECK_FALSE(say(VehicleCommand::kNone, 10).has_value());
  CHECK_FALSE(say(VehicleCommand::kClear, 11).has_value());
  CHECK(say(VehicleCommand::kClear, 11).has_value());
  CHECK_FALSE(say(static_cast<VehicleCommand>(77), 12).has_value());
  CHECK_FALSE(say(static_cast<VehicleCommand>(77), 12).has_value());
  CHECK(drive.inputs.counters().commands == 2);
  CHECK(drive.inputs.counters().unknown_commands == 1);
}

}  // namespace
}  // namespace tessera
