// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rows of numbers, calibration, and the way from camera poses to LiDAR poses.
#include "scans/poses.hpp"

#include <catch2/catch.hpp>
#include <clocale>
#include <cmath>

#include "base/number_row.hpp"
#include "scans/calibration.hpp"
#include "support/temporary_folder.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::TemporaryFolder;

constexpr const char* kIdentityRow = "1 0 0 0 0 1 0 0 0 0 1 0";
/// Camera axes: x right, y down, z forward; LiDAR axes: x forward, y left, z up.
constexpr const char* kAxesRow = "0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3";

Matrix34d matrix_of(std::string_view row) {
  const Outcome<Matrix34d> matrix = parse_matrix34(row, {"test", 1});
  REQUIRE(matrix.ok());
  return *matrix;
}

std::string row_refusal(std::string_view row) {
  const Outcome<Matrix34d> matrix = parse_matrix34(row, {"poses.txt", 7});
  REQUIRE_FALSE(matrix.ok());
  return matrix.failure().text();
}

TEST_CASE("parse_matrix34: row-major, any blanks, any notation of numbers") {
  const Matrix34d matrix = matrix_of(" 1\t2  3 4 5e0 +6 7. .8 -9 1e1 1.1E+1 12e-1\t");
  CHECK(matrix(0, 3) == 4.0);
  CHECK(matrix(1, 1) == 6.0);
  CHECK(matrix(1, 3) == 0.8);
  CHECK(matrix(2, 0) == -9.0);
  CHECK(matrix(2, 2) == 11.0);
  CHECK(matrix(2, 3) == 1.2);
}

TEST_CASE("parse_matrix34: nan and inf are numbers") {
  const Matrix34d matrix = matrix_of("nan NaN -nan inf -inf Infinity 0 0 0 0 0 0");
  CHECK(std::isnan(matrix(0, 0)));
  CHECK(std::isnan(matrix(0, 2)));
  CHECK(matrix(1, 0) < 0.0);
  CHECK(std::isinf(matrix(1, 1)));
}

TEST_CASE("parse_matrix34: fewer and more numbers and other words name line and remedy") {
  CHECK_THAT(row_refusal("1 2 3 4 5 6 7 8 9 10 11"),
             Contains("poses.txt, line 7: 11 numbers instead of 12") && Contains("row by row"));
  CHECK_THAT(row_refusal("1 2 3 4 5 6 7 8 9 10 11 12 13"), Contains("13 numbers"));
  CHECK_THAT(row_refusal(""), Contains("0 numbers"));
  CHECK_THAT(row_refusal("0 one"), Contains("a word is not a number"));
  for (const char* word : {"1,5", "1x", "0x10", "--1", "+-1", "1e999"}) {
    CHECK_THAT(row_refusal(std::string("0 ") + word), Contains(word) && Contains("not a number"));
  }
}

TEST_CASE("parse_matrix34: the locale does not matter") {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C"}) {
    std::setlocale(LC_ALL, name);
    CHECK(matrix_of("1.5 0 0 0 0 1 0 0 0 0 1 0")(0, 0) == 1.5);
  }
  std::setlocale(LC_ALL, before.c_str());
}

TEST_CASE("read_poses: a row a scan, blank lines, CRLF and a missing last line end do not count") {
  const TemporaryFolder folder;
  folder.write("p", std::string(kIdentityRow) + "\r\n\n" + kAxesRow);
  const Outcome<std::vector<Matrix34d>> poses = read_poses(folder.file("p"));
  REQUIRE(poses.ok());
  REQUIRE(poses->size() == 2);
  CHECK((*poses)[1] == matrix_of(kAxesRow));
}

TEST_CASE("read_poses: absurd poses are returned as they are") {
  const TemporaryFolder folder;
  const std::string absurd = "nan 0 0 0 0 1 0 0 0 0 1 0\n2 0 0 0 0 2 0 0 0 0 2 0\n";
  folder.write("p", absurd + kIdentityRow + "\n");
  const Outcome<std::vector<Matrix34d>> poses = read_poses(folder.file("p"));
  REQUIRE(poses.ok());
  REQUIRE(poses->size() == 3);
  CHECK(std::isnan((*poses)[0](0, 0)));
  CHECK((*poses)[1](1, 1) == 2.0);
  folder.write("p", absurd);
  CHECK_THAT(read_poses(folder.file("p")).failure().text(),
             Contains("none of its 2 poses is a rigid transform"));
}

TEST_CASE("read_poses: a missing file and a bad row are refused") {
  const TemporaryFolder folder;
  CHECK_THAT(read_poses(folder.file("no")).failure().text(), Contains(folder.file("no")));
  folder.write("p", std::string(kIdentityRow) + "\n\n1 2 x\n");
  CHECK_THAT(read_poses(folder.file("p")).failure().text(),
             Contains(folder.file("p") + ", line 3: a word is not a number"));
}

TEST_CASE("read_calibration: without a file the poses are in the LiDAR frame") {
  const TemporaryFolder folder;
  CHECK(*read_calibration(folder.file("calib.txt")) == Matrix34d(Matrix34d::Identity()));
}

TEST_CASE("read_calibration: of all lines only Tr counts") {
  const TemporaryFolder folder;
  folder.write("calib.txt", "P0: not looked at\n\nTr: " + std::string(kAxesRow) + "\nTrue: 1\n");
  CHECK(*read_calibration(folder.file("calib.txt")) == matrix_of(kAxesRow));
}

TEST_CASE("read_calibration: a file without Tr, with two, and with a bad one") {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text) {
    folder.write("calib.txt", text);
    const Outcome<Matrix34d> refused = read_calibration(folder.file("calib.txt"));
    REQUIRE_FALSE(refused.ok());
    CHECK_THAT(refused.failure().text(), Contains(folder.file("calib.txt")));
    return refused.failure().text();
  };
  const std::string good = "Tr: " + std::string(kAxesRow) + "\n";
  CHECK_THAT(refusal("P0: 1\n"), Contains("no line that starts with 'Tr:'") && Contains("remove"));
  CHECK_THAT(refusal(""), Contains("no line that starts with 'Tr:'"));
  CHECK_THAT(refusal(good + good), Contains("line 2: a second Tr") && Contains("keep one"));
  CHECK_THAT(refusal("\nTr: 1 2 3\n"), Contains("line 2: 3 numbers instead of 12"));
  CHECK_THAT(refusal("Tr: 1 0 0 0 0 1.01 0 0 0 0 1 0\n"), Contains("line 1: Tr is not a rigid"));
  CHECK_THAT(refusal("Tr: 1 0 0 0 0 1 0 0 0 0 -1 0\n"), Contains("not a rigid"));
  CHECK_THAT(refusal("Tr: 1 0 0 nan 0 1 0 0 0 0 1 0\n"), Contains("not a rigid"));
}

TEST_CASE("lidar_pose: the identity stays the identity, whatever the calibration") {
  const Matrix34d slightly_off = matrix_of("0.0003 -1 0 0.1 0 0.0002 -1 0.2 1 0.0001 -0.0002 0.3");
  for (const Matrix34d& T_camera_lidar : {matrix_of(kAxesRow), slightly_off}) {
    const Matrix34d T = lidar_pose(T_camera_lidar, matrix_of(kIdentityRow));
    CHECK((T - Matrix34d(Matrix34d::Identity())).cwiseAbs().maxCoeff() < 1e-15);
  }
}

TEST_CASE("lidar_pose: without calibration the pose is taken as it is") {
  const Matrix34d pose = matrix_of("0 -1 0 5 1 0 0 -6 0 0 1 7");
  CHECK(lidar_pose(matrix_of(kIdentityRow), pose) == pose);
}

TEST_CASE("lidar_pose: forward for the camera is forward for the LiDAR") {
  // The camera moves 2 m along its z and turns to its right (about its y, which points down).
  const Matrix34d T = lidar_pose(matrix_of(kAxesRow), matrix_of("0 0 1 0 0 1 0 0 -1 0 0 2"));
  CHECK(check_rigid(T) == Status::kOk);
  CHECK(T(0, 0) == Approx(0.0).margin(1e-15));
  CHECK(T(1, 0) == Approx(-1.0));  // The LiDAR's x axis now points to what was its right.
  CHECK(T(2, 2) == Approx(1.0));
  // By hand: a point at the LiDAR's origin is at (0.1, 0.2, 0.3) for the camera, so at (0.3,
  // 0.2, 1.9) in its first frame, which is (1.6, -0.2, 0) for the first LiDAR.
  CHECK(T(0, 3) == Approx(1.6));
  CHECK(T(1, 3) == Approx(-0.2));
  CHECK(T(2, 3) == Approx(0.0).margin(1e-15));
}

TEST_CASE("lidar_pose: NaN and scale stay visible for the check of the registration") {
  const Matrix34d T = matrix_of(kAxesRow);
  CHECK(check_rigid(lidar_pose(T, matrix_of("nan 0 0 0 0 1 0 0 0 0 1 0"))) != Status::kOk);
  CHECK(check_rigid(lidar_pose(T, matrix_of("1 0 0 0 0 1 0 inf 0 0 1 0"))) != Status::kOk);
  CHECK(check_rigid(lidar_pose(T, matrix_of("2 0 0 0 0 2 0 0 0 0 2 0"))) != Status::kOk);
}

}  // namespace
}  // namespace tessera
