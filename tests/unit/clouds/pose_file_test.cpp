// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The three forms of poses give the same transforms; what is none of them is refused.
#include "scans/pose_file.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;

std::vector<Matrix34d> poses_of(const std::string& text) {
  const test::TemporaryFolder folder;
  folder.write("poses.txt", text);
  const Outcome<PoseRows> poses = read_pose_rows(folder.file("poses.txt"));
  INFO((poses.ok() ? "" : poses.failure().text()));
  REQUIRE(poses.ok());
  return poses->T_map_sensor;
}

std::string refusal_of(const std::string& text) {
  const test::TemporaryFolder folder;
  folder.write("poses.txt", text);
  const Outcome<PoseRows> poses = read_pose_rows(folder.file("poses.txt"));
  REQUIRE_FALSE(poses.ok());
  CHECK_THAT(poses.failure().text(), Contains("poses.txt, line "));
  return poses.failure().text();
}

/// A quarter to the left about z, at (1, 2, 3).
Matrix34d quarter() {
  Matrix34d T;
  T << 0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3;
  return T;
}

TEST_CASE("poses: rows of 12, 16 and 8 numbers say the same") {
  const std::vector<Matrix34d> kitti = poses_of("0 -1 0 1 1 0 0 2 0 0 1 3\n");
  const std::vector<Matrix34d> square = poses_of("0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1");
  const std::vector<Matrix34d> tum =
      poses_of("# timestamp tx ty tz qx qy qz qw\n\n1.5 1 2 3 0 0 0.7071 0.7071\r\n");
  for (const auto* const poses : {&kitti, &square, &tum}) {
    REQUIRE(poses->size() == 1);
    CHECK(((*poses)[0] - quarter()).cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("poses: rows in the form of TUM keep their stamps, others have none") {
  const test::TemporaryFolder folder;
  folder.write("poses.txt", "1.5 1 2 3 0 0 0 1\n1e9 1 2 3 0 0 0 1\n");
  const Outcome<PoseRows> tum = read_pose_rows(folder.file("poses.txt"));
  REQUIRE(tum.ok());
  CHECK(tum->stamps_s == std::vector<double>{1.5, 1e9});
  folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0");
  CHECK(read_pose_rows(folder.file("poses.txt"))->stamps_s.empty());
}

TEST_CASE("poses: a quaternion turns as its axis and angle say") {
  // 40 degrees about (2, -3, 6) / 7.
  const double half = 20.0 * 3.14159265358979323846 / 180.0;
  const double s = std::sin(half);
  char row[200];
  std::snprintf(row, sizeof row, "0 0 0 0 %.17g %.17g %.17g %.17g", s * 2 / 7, -s * 3 / 7,
                s * 6 / 7, std::cos(half));
  const Matrix34d T = poses_of(row)[0];
  const Eigen::Matrix3d expected =
      Eigen::AngleAxisd(2 * half, Eigen::Vector3d(2, -3, 6) / 7).toRotationMatrix();
  CHECK((T.leftCols<3>() - expected).cwiseAbs().maxCoeff() < 1e-14);
}

TEST_CASE("poses: what is not rigid or not finite stays so, for its scan to be refused") {
  CHECK(std::isnan(poses_of("nan 0 0 0 0 0 0 0 0 0 0 0\n1 0 0 0 0 1 0 0 0 0 1 0")[0](0, 0)));
  CHECK(check_rigid(poses_of("0 0 0 0 0 0 0 0\n1 0 0 0 0 0 0 1")[0]) != Status::kOk);
  CHECK(check_rigid(poses_of("0 0 0 0 0 0 0 2\n1 0 0 0 0 0 0 1")[0]) != Status::kOk);
  CHECK(check_rigid(poses_of("0 0 0 0 0 0 0 1.005")[0]) == Status::kOk);
  CHECK(poses_of("").empty());
}

TEST_CASE("poses: a file in which not one is rigid is refused") {
  const test::TemporaryFolder folder;
  // Translation before rotation, a scale, no rotation at all, and nothing.
  for (const char* const text :
       {"5 1 0 0 6 0 1 0 7 0 0 1\n8 1 0 0 6 0 1 0 7 0 0 1", "2 0 0 0 0 2 0 0 0 0 2 0",
        "0 0 0 0 0 0 0 0", "1 nan 0 0 0 0 0 1"}) {
    folder.write("poses.txt", text);
    const Outcome<PoseRows> poses = read_pose_rows(folder.file("poses.txt"));
    REQUIRE_FALSE(poses.ok());
    CHECK_THAT(poses.failure().text(),
               Contains("poses.txt: none of its ") && Contains("is a rigid transform; "));
  }
}

TEST_CASE("poses: rows that are none are refused by their line") {
  CHECK_THAT(refusal_of("\n1 2 3\n"), Contains("line 2: a pose has 3 numbers"));
  CHECK_THAT(refusal_of("0 0 0 0 0 0 0 0 0 0 0 0 0"), Contains("13 numbers"));
  CHECK_THAT(refusal_of("0 0 0 0 0 0 0 one"), Contains("a word is not a number"));
  CHECK_THAT(refusal_of("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2"), Contains("not 0 0 0 1"));
  CHECK_THAT(refusal_of("1 0 0 0 0 0 0 1\n1 0 0 0 0 1 0 0 0 0 1 0"),
             Contains("12 numbers, the ones before have 8"));
  CHECK_THAT(refusal_of("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1"), Contains("line 2: the stamp"));
}

}  // namespace
}  // namespace tessera
