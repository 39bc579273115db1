// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rigid transforms are multiplied, inverted and interpolated as Eigen does it, to rounding, and to
// the same bits on every machine.
#include "tessera/base/rigid.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>

#include "support/random.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {
namespace {

/// From a drawn quaternion of any length by basic arithmetic: the same bits everywhere.
Matrix34d drawn_pose(oracle::Random& random) {
  Eigen::Vector4d q;
  for (int i = 0; i < 4; ++i) q[i] = random.uniform(-1.0, 1.0);
  const double s = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double w = q[0];
  const double x = q[1];
  const double y = q[2];
  const double z = q[3];
  Matrix34d T;
  T << 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y), 0.0,  //
      s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x), 0.0,   //
      s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y), 0.0;
  for (int row = 0; row < 3; ++row) T(row, 3) = random.uniform(-50.0, 50.0);
  return T;
}

double largest_difference(const Matrix34d& a, const Matrix34d& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

Matrix34d turned(double angle_rad, const Eigen::Vector3d& axis) {
  Matrix34d T = Matrix34d::Identity();
  T.leftCols<3>() = Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
  return T;
}

TEST_CASE("rigid: product and inverse are Eigen's, to rounding") {
  constexpr std::uint64_t kSeed = 61;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (int round = 0; round < 1000; ++round) {
    const Matrix34d a = drawn_pose(random);
    const Matrix34d b = drawn_pose(random);
    Eigen::Isometry3d A = Eigen::Isometry3d::Identity();
    Eigen::Isometry3d B = A;
    A.matrix().topRows<3>() = a;
    B.matrix().topRows<3>() = b;
    REQUIRE(largest_difference(product(a, b), (A * B).matrix().topRows<3>()) < 1e-12);
    REQUIRE(largest_difference(product(a, inverse(a)), Matrix34d::Identity()) < 1e-12);
    const Point3d p(random.uniform(-9, 9), 1.0, 2.0);
    REQUIRE((apply(a, p) - A * p).norm() < 1e-12);
  }
}

TEST_CASE("interpolate: the ends and between them Eigen's slerp, for any two rotations") {
  constexpr std::uint64_t kSeed = 62;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (int round = 0; round < 10000; ++round) {
    const Matrix34d from = drawn_pose(random);
    const Matrix34d to = drawn_pose(random);
    const Eigen::Quaterniond a(Eigen::Matrix3d(from.leftCols<3>()));
    const Eigen::Quaterniond b(Eigen::Matrix3d(to.leftCols<3>()));
    const double turn = a.angularDistance(b);
    if (turn > 3.1) continue;  // Both ways round are right near a half turn.
    const double share = random.uniform();
    Matrix34d expected;
    expected << a.slerp(share, b).toRotationMatrix(),
        from.col(3) + share * (to.col(3) - from.col(3));
    const double bound = turn < 1.5708 ? 1e-12 : 1e-6;
    REQUIRE(largest_difference(interpolate(from, to, share), expected) < bound);
    REQUIRE(largest_difference(interpolate(from, to, 0.0), from) < bound);
    REQUIRE(largest_difference(interpolate(from, to, 1.0), to) < bound);
    REQUIRE(check_rigid(interpolate(from, to, share)) == Status::kOk);
  }
}

TEST_CASE("interpolate: turns at an even rate, also over turns of over a quarter") {
  const Eigen::Vector3d axis = Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
  for (const double angle_rad : {1e-9, 1e-3, 0.3, 1.5, 2.5, 3.1}) {
    for (int step = 0; step <= 16; ++step) {
      const double share = step / 16.0;
      const Matrix34d between =
          interpolate(turned(0.2, axis), turned(0.2 + angle_rad, axis), share);
      const double bound = angle_rad < 1.5708 ? 1e-12 : 1e-6;
      CHECK(largest_difference(between, turned(0.2 + share * angle_rad, axis)) < bound);
    }
  }
}

TEST_CASE("interpolate: half turns about each axis, where no part of a rotation is positive") {
  for (int axis = 0; axis < 3; ++axis) {
    const Matrix34d half = turned(3.141592653589793, Eigen::Vector3d::Unit(axis));
    CHECK(largest_difference(interpolate(half, half, 0.5), half) < 1e-12);
    const Matrix34d quarter = interpolate(Matrix34d::Identity(), half, 0.5);
    CHECK(check_rigid(quarter) == Status::kOk);
    CHECK(largest_difference(product(quarter, quarter), half) < 1e-6);
  }
}

TEST_CASE("interpolate: of two poses with few digits gives an exact rotation") {
  oracle::Random random(63);
  Matrix34d from = drawn_pose(random);
  Matrix34d to = drawn_pose(random);
  from = (from * 1e4).array().round().matrix() / 1e4;
  to = (to * 1e4).array().round().matrix() / 1e4;
  const Eigen::Matrix3d R = interpolate(from, to, 0.3).leftCols<3>();
  CHECK((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-14);
}

TEST_CASE("golden digest: transforms are the same to the bit on every machine") {
  oracle::Random random(64);
  Digest digest;
  for (int round = 0; round < 1000; ++round) {
    const Matrix34d a = drawn_pose(random);
    const Matrix34d b = drawn_pose(random);
    const double share = random.uniform();
    for (const Matrix34d& T : {product(a, b), inverse(a), interpolate(a, b, share)}) {
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column)
          digest.add(std::bit_cast<std::uint64_t>(T(row, column)));
      }
    }
  }
  CHECK(digest.value() == 0x5c283e03420c6f3cU);
}

}  // namespace
}  // namespace tessera
