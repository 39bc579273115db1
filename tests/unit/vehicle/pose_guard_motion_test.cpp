// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the guard makes of what the vehicle says of its motion.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "pose_drive.hpp"
#include "vehicle/pose_guard.hpp"

namespace tessera {
namespace {

using Drive = PoseDrive;

/// Poses that stay where they are, until they are found out; how long that took.
std::int64_t freeze(Drive& drive, VehicleMotion motion, std::int64_t at_most_us) {
  const std::int64_t from_us = drive.now_us;
  while (drive.now_us - from_us <= at_most_us) {
    drive.now_us += kPeriodUs;
    motion.received_us = drive.now_us;
    drive.guard.moves(motion);
    if (drive.guard.judge(drive.at(drive.x_m)) == PoseVerdict::kFrozen)
      return drive.now_us - from_us;
  }
  return -1;
}

TEST_CASE("PoseGuard: a pose that stays while the wheels turn is frozen within two windows") {
  for (const double speed : {2.0, 10.0, -2.0}) {
    Drive drive;
    for (int i = 0; i < 50; ++i) {
      const PoseObservation pose = drive.next();
      drive.guard.moves({pose.received_us, MotionState::kMoving, 2.0});
      static_cast<void>(drive.guard.judge(pose));
    }
    REQUIRE(drive.guard.state(drive.now_us) == PoseVerdict::kGood);
    const std::int64_t took_us = freeze(drive, {0, MotionState::kMoving, speed}, 5'000'000);
    CHECK(took_us > 0);
    CHECK(took_us <= 2 * (300'000 + kPeriodUs));
  }
}

TEST_CASE("PoseGuard: frozen without a speed takes longer, standing is never frozen") {
  Drive moving;
  REQUIRE(moving.settle() == PoseVerdict::kGood);
  const std::int64_t took_us = freeze(moving, {0, MotionState::kMoving, {}}, 10'000'000);
  CHECK(took_us > 0);
  CHECK(took_us <= 2 * (2'500'000 + kPeriodUs));
  Drive standing;
  REQUIRE(standing.settle() == PoseVerdict::kGood);
  CHECK(freeze(standing, {0, MotionState::kStanding, 0.0}, 10'000'000) == -1);
  CHECK(standing.guard.state(standing.now_us) == PoseVerdict::kGood);
}

TEST_CASE("PoseGuard: what the vehicle said too long ago proves nothing") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  drive.guard.moves({drive.now_us, MotionState::kMoving, 1.0});
  for (int i = 0; i < 500; ++i) {
    drive.now_us += kPeriodUs;
    REQUIRE(drive.guard.judge(drive.at(drive.x_m)) == PoseVerdict::kGood);
  }
}

TEST_CASE("PoseGuard: a frozen pose that moves again is alive, after five") {
  Drive drive;
  REQUIRE(drive.settle() == PoseVerdict::kGood);
  REQUIRE(freeze(drive, {0, MotionState::kMoving, 2.0}, 5'000'000) > 0);
  int poses = 0;
  PoseVerdict verdict = PoseVerdict::kFrozen;
  while (verdict != PoseVerdict::kGood && ++poses < 100) {
    const PoseObservation pose = drive.next();
    drive.guard.moves({pose.received_us, MotionState::kMoving, 2.0});
    verdict = drive.guard.judge(pose);
  }
  CHECK(poses <= 10);
}

/// Drives on at 2 m/s with wheels that say so, for so many poses; what the last of them gave.
PoseVerdict drive_on(Drive& drive, int poses) {
  PoseVerdict verdict = PoseVerdict::kNone;
  for (int i = 0; i < poses; ++i) {
    const PoseObservation pose = drive.next();
    drive.guard.moves({pose.received_us, MotionState::kMoving, 2.0, 0.0});
    verdict = drive.guard.judge(pose);
  }
  return verdict;
}

/// No poses, while the vehicle says of its motion what is given, or nothing.
void fall_silent(Drive& drive, std::int64_t for_us, std::optional<VehicleMotion> motion) {
  for (const std::int64_t until_us = drive.now_us + for_us; drive.now_us < until_us;) {
    drive.now_us += kPeriodUs;
    if (!motion.has_value()) continue;
    motion->received_us = drive.now_us;
    drive.guard.moves(*motion);
  }
}

/// Poses at one place, until they are good: how many frames were left on the way there.
std::uint64_t come_back(Drive& drive, double x_m, double heading_rad = 0.0) {
  for (int i = 0; i < 15; ++i) {
    drive.now_us += kPeriodUs;
    static_cast<void>(drive.guard.judge(drive.at(x_m, heading_rad)));
  }
  CHECK(drive.guard.state(drive.now_us) == PoseVerdict::kGood);
  return drive.guard.relocations();
}

TEST_CASE(
    "PoseGuard: behind a silence poses may be where the wheels say, and else are of another "
    "frame") {
  for (const std::int64_t silence_us : {1'000'000, 3'000'000, 30'000'000}) {
    for (const double speed : {0.0, 2.0, -10.0}) {
      const double way_m = speed * static_cast<double>(silence_us) * 1e-6;
      // A fifth more than the wheels say, and what it can do until poses are silent.
      const double reach_m = std::abs(way_m) * 1.2 + 15.0 * 0.2;
      for (const double off_m : {way_m, reach_m, reach_m + 1.0, 1000.0}) {
        Drive drive;
        REQUIRE(drive_on(drive, 20) == PoseVerdict::kGood);
        fall_silent(drive, silence_us, VehicleMotion{0, MotionState::kMoving, speed, 0.0});
        // But never more than at 15 m/s all the time.
        const double most_m = 15.0 * static_cast<double>(silence_us) * 1e-6;
        const bool left = off_m > std::min(reach_m, most_m) + 0.5;
        CHECK(come_back(drive, drive.x_m + off_m) == (left ? 1 : 0));
      }
    }
  }
}

TEST_CASE("PoseGuard: behind a silence the heading is bounded too") {
  for (const double heading : {0.3, 0.6, 3.0}) {
    Drive standing;
    REQUIRE(drive_on(standing, 20) == PoseVerdict::kGood);
    fall_silent(standing, 3'000'000, VehicleMotion{0, MotionState::kStanding, 0.0, 0.0});
    CHECK(come_back(standing, standing.x_m, heading) == (heading > 0.4 ? 1 : 0));
    Drive turning;
    REQUIRE(drive_on(turning, 20) == PoseVerdict::kGood);
    fall_silent(turning, 3'000'000, VehicleMotion{0, MotionState::kMoving, 0.0, -1.0});
    CHECK(come_back(turning, turning.x_m, -heading) == 0);
  }
}

TEST_CASE("PoseGuard: behind a silence of the wheels too, a second's way is plausible at most") {
  for (const std::int64_t silence_us : {1'000'000, 3'000'000, 60'000'000}) {
    for (const double off_m : {0.0, 14.9, 15.6, 30.0}) {
      Drive drive;
      REQUIRE(drive.settle() == PoseVerdict::kGood);
      fall_silent(drive, silence_us, std::nullopt);
      CHECK(come_back(drive, drive.x_m + off_m) == (off_m > 15.5 ? 1 : 0));
    }
  }
}

/// Poses that are held for a while under new stamps, while the vehicle drives on.
void hold(Drive& drive, int poses, double speed_mps) {
  const double held_m = drive.x_m;
  for (int i = 0; i < poses; ++i) {
    drive.now_us += kPeriodUs;
    drive.x_m += speed_mps * 0.02;
    drive.guard.moves({drive.now_us, MotionState::kMoving, speed_mps, 0.001});
    static_cast<void>(drive.guard.judge(drive.at(held_m)));
  }
}

TEST_CASE("PoseGuard: poses that were held and catch up with the wheels are of the same frame") {
  // From a short stutter to what is found frozen.
  for (const int poses : {10, 20, 100, 500}) {
    Drive drive;
    REQUIRE(drive_on(drive, 20) == PoseVerdict::kGood);
    hold(drive, poses, 3.0);
    CHECK((drive.guard.count(PoseVerdict::kFrozen) > 0) == (poses >= 20));
    CHECK(drive_on(drive, 5) == PoseVerdict::kGood);
    CHECK(drive.guard.count(PoseVerdict::kJumping) == 0);
    CHECK(drive.guard.relocations() == 0);
  }
}

TEST_CASE("PoseGuard: poses that were held and go on farther than the wheels went jump") {
  Drive drive;
  REQUIRE(drive_on(drive, 20) == PoseVerdict::kGood);
  hold(drive, 20, 3.0);
  drive.x_m += 1.0;
  CHECK(drive_on(drive, 1) == PoseVerdict::kJumping);
  // While it stands, poses are held for good reason.
  Drive standing;
  REQUIRE(drive_on(standing, 20) == PoseVerdict::kGood);
  hold(standing, 500, 0.0);
  standing.x_m += 0.5;
  CHECK(drive_on(standing, 1) == PoseVerdict::kJumping);
}

/// Turns on the spot at this rate, with or without a pose that turns too; poses that were frozen.
std::uint64_t turn(Drive& drive, double yaw_rate_radps, bool pose_turns, int poses = 250) {
  for (int i = 0; i < poses; ++i) {
    drive.now_us += kPeriodUs;
    const double heading = pose_turns ? yaw_rate_radps * 0.02 * i : 0.0;
    drive.guard.moves({drive.now_us, MotionState::kMoving, 0.0, yaw_rate_radps});
    static_cast<void>(drive.guard.judge(drive.at(drive.x_m, heading)));
  }
  return drive.guard.count(PoseVerdict::kFrozen);
}

TEST_CASE("PoseGuard: a heading that stays while the vehicle turns on the spot is frozen") {
  for (const double yaw_rate : {1.0, -0.2}) {
    Drive drive;
    REQUIRE(drive_on(drive, 20) == PoseVerdict::kGood);
    CHECK(turn(drive, yaw_rate, false) > 0);
    Drive alive;
    REQUIRE(drive_on(alive, 20) == PoseVerdict::kGood);
    CHECK(turn(alive, yaw_rate, true) == 0);
    CHECK(alive.guard.state(alive.now_us) == PoseVerdict::kGood);
  }
  // It is found within two windows, and alive again once it turns.
  Drive drive;
  REQUIRE(drive_on(drive, 20) == PoseVerdict::kGood);
  CHECK(turn(drive, 1.0, false, 32) > 0);
  static_cast<void>(turn(drive, 1.0, true, 20));
  CHECK(drive.guard.state(drive.now_us) == PoseVerdict::kGood);
}

TEST_CASE("PoseGuard: a gyroscope's bias and its noise are no turn") {
  Drive drive;
  REQUIRE(drive_on(drive, 20) == PoseVerdict::kGood);
  CHECK(turn(drive, 0.04, false, 3000) == 0);
  for (int i = 0; i < 100; ++i) {
    REQUIRE(turn(drive, 0.1, false, 1) == 0);
    REQUIRE(turn(drive, -0.1, false, 1) == 0);
  }
}

TEST_CASE("PoseGuard: a quarter of a metre forward and back again is not frozen") {
  Drive drive;
  REQUIRE(drive_on(drive, 20) == PoseVerdict::kGood);
  for (int i = 0; i < 1000; ++i) {
    const double speed = i / 16 % 2 == 0 ? 0.8 : -0.8;
    drive.now_us += kPeriodUs;
    drive.x_m += speed * 0.02;
    drive.guard.moves({drive.now_us, MotionState::kMoving, speed, 0.0});
    REQUIRE(drive.guard.judge(drive.at(drive.x_m)) == PoseVerdict::kGood);
  }
}

}  // namespace
}  // namespace tessera
