// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <limits>
#include <vector>

#include "submap_course.hpp"

namespace tessera {
namespace {

void map_two_submaps(Robot& robot) {
  robot.integrate(StreetPart(1).view(), 0);
  REQUIRE(robot.new_submap(shift_of(20.0, 0.0)) == Status::kOk);
  robot.integrate(StreetPart(2).view(), 0);
}

TEST_CASE("Submap: each is moved on its own, as if it had always been there") {
  SmallRobotMemory one(config_at_first());
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  map_two_submaps(robot);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.set_frame(2, kFirst) == Status::kInvalidArgument);
  REQUIRE(robot.set_frame(1, kSecond) == Status::kOk);
  CHECK(robot.sharer().frame() == kSecond);
  REQUIRE(robot.set_frame(0, shift_of(3.0, 3.0)) == Status::kOk);
  CHECK(robot.sharer().frame() == kSecond);
  REQUIRE(robot.set_frame(0, kFirst) == Status::kOk);
  robot.finish();
  CHECK(digest_of(robot.global().map()) == digest_by_hand(config_at_first(), {1}, 2));
}

TEST_CASE("Submap: one that was moved before it was opened is told where it was moved to") {
  SmallRobotMemory one(config_at_first());
  Robot& robot = *one.robot;
  std::int64_t now_us = 0;
  map_two_submaps(robot);
  REQUIRE(robot.sharer().submap().submap == 0);
  REQUIRE(robot.set_frame(1, kSecond) == Status::kOk);
  CHECK(robot.sharer().frame() == kFirst);
  REQUIRE(settle(robot, now_us) <= 1000);
  CHECK(robot.sharer().frame() == kSecond);
  CHECK(digest_of(robot.global().map()) == digest_by_hand(config_at_first(), {1}, 2));
}

/// Poses of a drive, and where a pose graph puts them: turned about the fourth.
struct CorrectedDrive {
  std::vector<std::int64_t> stamps_us;
  std::vector<double> poses;
};

TEST_CASE("Submap: a corrected trajectory moves each, with nothing sent again") {
  RobotConfig config = config_at_first(8);
  config.submap_cuts.length_m = 8.0;
  Course course(config);
  Robot& robot = *course.one.robot;
  CorrectedDrive corrected;
  for (int step = 0; step < 12; ++step) {
    corrected.stamps_us.push_back(course.now_us);
    course.drive_to(2.0 * step, 0.0);
    // The second half of the drive is five metres to the left.
    const Matrix34d T = shift_of(2.0 * step, step < 4 ? 0.0 : 5.0);
    for (int k = 0; k < 12; ++k) corrected.poses.push_back(T(k / 4, k % 4));
  }
  REQUIRE(robot.maps().number() == 2);
  const std::uint64_t published = robot.publisher().totals().published;
  const CorrectedTrajectory trajectory{corrected.stamps_us, corrected.poses};
  const CorrectionReport report = robot.correct(trajectory, 7);
  REQUIRE(report.status == Status::kOk);
  CHECK(report.moved == 2);
  CHECK(report.most_m == Approx(5.0));
  CHECK(report.residual_m < 1e-9);
  CHECK(robot.sharer().submap().revision == 7);
  CHECK(robot.sharer().frames().frame(0) == Matrix34d(Matrix34d::Identity()));
  CHECK(robot.sharer().frames().frame(1) == shift_of(0.0, 5.0));
  CHECK(robot.sharer().frame() == shift_of(1.0, 3.0));
  REQUIRE(settle(robot, course.now_us) <= 1000);
  CHECK(robot.publisher().totals().published == published);
  // The next one lies where the last one was moved to.
  course.drive_to(24.0, 0.0);
  course.drive_to(26.0, 0.0);
  REQUIRE(robot.maps().number() == 3);
  CHECK(robot.sharer().frame() == shift_of(1.0, 3.0));

  // A robot that knew it all along has the same global map.
  Course known(config);
  Robot& other = *known.one.robot;
  const auto next = [&](int begin, int end, const Matrix34d& frame) {
    REQUIRE(other.set_frame(other.maps().number(), frame) == Status::kOk);
    for (int step = begin; step < end; ++step) known.drive_to(2.0 * step, 0.0);
  };
  next(0, 4, kFirst);
  known.drive_to(8.0, 0.0);
  next(5, 14, shift_of(1.0, 3.0));
  robot.finish();
  other.finish();
  CHECK(digest_of(robot.global().map()) == digest_of(other.global().map()));
}

TEST_CASE("Submap: a correction out of the grid is counted, and the next submap is published") {
  RobotConfig config = config_at_first(8);
  config.submap_cuts.length_m = 8.0;
  Course course(config);
  Robot& robot = *course.one.robot;
  for (int step = 0; step < 3; ++step) course.drive_to(2.0 * step, 0.0);
  // Rigid, and within what a frame can be; not within the grid of voxels of 0.2 m.
  const Matrix34d far = shift_of(400'000.0, 0.0);
  std::vector<double> numbers;
  for (int k = 0; k < 12; ++k) numbers.push_back(far(k / 4, k % 4));
  const std::vector<std::uint32_t> submaps{0};
  REQUIRE(robot.correct(CorrectedFrames{submaps, numbers}, 1).status == Status::kOk);
  CHECK(robot.sharer().submap().refused_frames == 1);
  CHECK(robot.sharer().frame() == kFirst);
  for (int step = 3; step < 8; ++step) course.drive_to(2.0 * step, 0.0);
  REQUIRE(robot.maps().number() == 1);
  CHECK(robot.sharer().submap().submap == 1);
  CHECK(robot.sharer().submap().refused_frames == 2);
  CHECK(robot.sharer().frame() == kFirst);
}

TEST_CASE("Submap: corrections that are none are refused and counted, and nothing moves") {
  RobotConfig config = config_at_first(8);
  config.submap_cuts.length_m = 8.0;
  Course course(config);
  Robot& robot = *course.one.robot;
  for (int step = 0; step < 6; ++step) course.drive_to(2.0 * step, 0.0);
  REQUIRE(robot.maps().number() == 1);
  const std::uint64_t before = robot.exchange().digest();
  std::vector<double> poses;
  const Matrix34d T = shift_of(3.0, 0.0);
  for (int k = 0; k < 24; ++k) poses.push_back(T(k % 12 / 4, k % 4));
  const std::vector<std::int64_t> stamps{0, 100'000};
  const std::vector<std::int64_t> falling{100'000, 100'000};
  std::vector<double> far = poses;
  far[3] = 1e6;
  std::vector<double> nothing = poses;
  nothing[0] = std::numeric_limits<double>::quiet_NaN();
  const std::span<const double> one_pose(poses.data(), 12);
  const std::vector<std::uint32_t> submaps{0, 1};
  const std::vector<std::uint32_t> unknown{0, 2};
  const std::vector<std::uint32_t> twice{1, 1};
  for (const CorrectionReport& report : {robot.correct(CorrectedTrajectory{stamps, poses}, 0),
                                         robot.correct(CorrectedTrajectory{}, 1),
                                         robot.correct(CorrectedTrajectory{falling, poses}, 1),
                                         robot.correct(CorrectedTrajectory{stamps, far}, 1),
                                         robot.correct(CorrectedTrajectory{stamps, nothing}, 1),
                                         robot.correct(CorrectedTrajectory{stamps, one_pose}, 1),
                                         robot.correct(CorrectedFrames{unknown, poses}, 1),
                                         robot.correct(CorrectedFrames{twice, poses}, 1),
                                         robot.correct(CorrectedFrames{submaps, one_pose}, 1)}) {
    CHECK(report.status == Status::kInvalidArgument);
    CHECK(report.revision == 0);
  }
  CHECK(robot.sharer().submap().refused_corrections == 9);
  CHECK(robot.exchange().digest() == before);
  CHECK(robot.correct(CorrectedFrames{submaps, poses}, 2).moved == 2);
  CHECK(robot.correct(CorrectedFrames{submaps, poses}, 2).status == Status::kInvalidArgument);
  CHECK(robot.exchange().digest() != before);
}

}  // namespace
}  // namespace tessera
