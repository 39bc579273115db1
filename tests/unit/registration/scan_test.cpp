// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Poses that are not rigid are refused; points are taken to the map frame in double precision.
#include "tessera/registration/scan.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "support/random.hpp"

namespace tessera {
namespace {

Matrix34d pose(const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  Matrix34d T;
  T << R, t;
  return T;
}

Matrix34d random_pose(oracle::Random& random) {
  const Eigen::Quaterniond q(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0),
                             random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
  const Eigen::Vector3d t(random.uniform(-5e3, 5e3), random.uniform(-5e3, 5e3),
                          random.uniform(-99.0, 99.0));
  return pose(q.normalized().toRotationMatrix(), t);
}

TEST_CASE("check_rigid: the identity and random rotations anywhere are rigid") {
  constexpr std::uint64_t kSeed = 51;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  CHECK(check_rigid(Matrix34d::Identity()) == Status::kOk);
  for (int round = 0; round < 1000; ++round)
    REQUIRE(check_rigid(random_pose(random)) == Status::kOk);
}

TEST_CASE("check_rigid: NaN or infinity in any entry is refused") {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        Matrix34d T = Matrix34d::Identity();
        T(row, column) = bad;
        CHECK(check_rigid(T) == Status::kInvalidArgument);
      }
    }
  }
}

TEST_CASE("check_rigid: a scaled rotation is refused, larger or smaller") {
  oracle::Random random(52);
  for (const double scale : {0.0, 0.5, 0.999, 1.001, 1.1, 1000.0}) {
    Matrix34d T = random_pose(random);
    T.leftCols<3>() *= scale;
    CHECK(check_rigid(T) == Status::kInvalidArgument);
  }
}

TEST_CASE("check_rigid: one scaled axis is refused") {
  Matrix34d T = Matrix34d::Identity();
  T(1, 1) = 1.01;
  CHECK(check_rigid(T) == Status::kInvalidArgument);
}

TEST_CASE("check_rigid: a shear is refused") {
  Matrix34d T = Matrix34d::Identity();
  T(0, 1) = 0.01;
  CHECK(check_rigid(T) == Status::kInvalidArgument);
}

TEST_CASE("check_rigid: a reflection is refused, though its columns are orthonormal") {
  for (int axis = 0; axis < 3; ++axis) {
    Matrix34d T = Matrix34d::Identity();
    T(axis, axis) = -1.0;
    CHECK(check_rigid(T) == Status::kInvalidArgument);
  }
  CHECK(check_rigid(pose(-Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.0})) ==
        Status::kInvalidArgument);
}

TEST_CASE("check_rigid: all zeros, and entries whose squares overflow, are refused") {
  CHECK(check_rigid(Matrix34d::Zero()) == Status::kInvalidArgument);
  CHECK(check_rigid(Matrix34d::Constant(1e200)) == Status::kInvalidArgument);
  CHECK(check_rigid(Matrix34d::Constant(-1e308)) == Status::kInvalidArgument);
}

TEST_CASE("check_rigid: a rotation off by less than the tolerance passes, by more does not") {
  // A diagonal entry of 1 + e puts 2 e into R^T R.
  Matrix34d T = Matrix34d::Identity();
  T(2, 2) = 1.0 + 0.45e-3;
  CHECK(check_rigid(T) == Status::kOk);
  T(2, 2) = 1.0 + 0.55e-3;
  CHECK(check_rigid(T) == Status::kInvalidArgument);
}

TEST_CASE("check_rigid: a rotation that was written with seven digits passes") {
  oracle::Random random(53);
  for (int round = 0; round < 100; ++round) {
    Matrix34d T = random_pose(random);
    T = (T * 1e6).array().round().matrix() / 1e6;
    REQUIRE(check_rigid(T) == Status::kOk);
  }
}

TEST_CASE("transform: the identity leaves a point as it is") {
  const std::array<float, 3> p{1.5F, -2.25F, 1e-20F};
  CHECK(transform(Matrix34d::Identity(), p.data()) == Point3f(1.5F, -2.25F, 1e-20F));
}

TEST_CASE("transform: takes sensor coordinates to map coordinates, not the other way round") {
  Matrix34d T_map_sensor;
  T_map_sensor << 0.0, -1.0, 0.0, 10.0,  //
      1.0, 0.0, 0.0, 20.0,               //
      0.0, 0.0, 1.0, -5.0;
  const std::array<float, 3> ahead{2.0F, 0.0F, 1.0F};
  CHECK(transform(T_map_sensor, ahead.data()) == Point3f(10.0F, 22.0F, -4.0F));
}

TEST_CASE("transform: equals the product in double, rounded once") {
  constexpr std::uint64_t kSeed = 54;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (int round = 0; round < 10000; ++round) {
    const Matrix34d T = random_pose(random);
    const std::array<float, 3> p{static_cast<float>(random.uniform(-80.0, 80.0)),
                                 static_cast<float>(random.uniform(-80.0, 80.0)),
                                 static_cast<float>(random.uniform(-5.0, 5.0))};
    const Eigen::Vector3d expected =
        T * Eigen::Vector4d(static_cast<double>(p[0]), static_cast<double>(p[1]),
                            static_cast<double>(p[2]), 1.0);
    const Point3f got = transform(T, p.data());
    for (int axis = 0; axis < 3; ++axis) {
      // Half a unit in the last place of the float, and what the order of the double sum may add.
      const double tolerance = std::abs(expected[axis]) * 0x1p-24 + 1e-11;
      REQUIRE(std::abs(static_cast<double>(got[axis]) - expected[axis]) <= tolerance);
    }
  }
}

TEST_CASE("transform: a point that is not finite stays not finite") {
  const std::array<float, 3> p{std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F};
  CHECK_FALSE(std::isfinite(transform(Matrix34d::Identity(), p.data()).x()));
}

}  // namespace
}  // namespace tessera
