// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Small symmetric matrices, against Eigen.
#include "tessera/frames/internal/symmetric.hpp"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "support/random.hpp"

namespace tessera {

namespace {

Eigen::Matrix3d full(const Symmetric3& S) {
  Eigen::Matrix3d M;
  M << S[0], S[1], S[2], S[1], S[3], S[4], S[2], S[4], S[5];
  return M;
}

}  // namespace

TEST_CASE("eigenvalues, inverses and turns of 3x3 matrices") {
  oracle::Random random(5);
  for (int n = 0; n < 200; ++n) {
    Eigen::Matrix3d root;
    for (int i = 0; i < 9; ++i) root(i) = random.uniform(-2.0, 2.0);
    if (n % 4 == 0) root.col(2) *= 1e-3;  // nearly flat
    const Eigen::Matrix3d M = root * root.transpose() + 1e-9 * Eigen::Matrix3d::Identity();
    const Symmetric3 S{M(0, 0), M(0, 1), M(0, 2), M(1, 1), M(1, 2), M(2, 2)};
    const Eigen3 eigen = eigen_of(S);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(M);
    for (int i = 0; i < 3; ++i) {
      const Point3d& v = eigen.vectors[static_cast<std::size_t>(i)];
      const double value = eigen.values[static_cast<std::size_t>(i)];
      CHECK(value == Approx(solver.eigenvalues()(i)).margin(1e-9));
      CHECK(norm(v) == Approx(1.0));
      CHECK((M * v - value * v).norm() < 1e-8);
    }
    if (n % 4 != 0) CHECK((full(inverse(S)) * M - Eigen::Matrix3d::Identity()).norm() < 1e-5);
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(random.uniform(-3.0, 3.0), Eigen::Vector3d(1, 2, 3).normalized())
            .toRotationMatrix();
    Matrix3 rows{};
    for (int i = 0; i < 9; ++i) rows[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
    CHECK((full(rotated(rows, S)) - R * M * R.transpose()).norm() < 1e-9);
    CHECK((product(S, {1.0, -2.0, 3.0}) - M * Point3d(1.0, -2.0, 3.0)).norm() < 1e-9);
  }
}

TEST_CASE("a diagonal matrix is its own eigenvalues, in order") {
  const Eigen3 eigen = eigen_of({3.0, 0.0, 0.0, 1.0, 0.0, 2.0});
  CHECK(eigen.values == std::array<double, 3>{1.0, 2.0, 3.0});
}

TEST_CASE("inverses of 6x6 matrices, and those that have none") {
  oracle::Random random(6);
  for (int n = 0; n < 50; ++n) {
    Eigen::Matrix<double, 6, 6> root;
    for (int i = 0; i < 36; ++i) root(i) = random.uniform(-1.0, 1.0);
    const Eigen::Matrix<double, 6, 6> M =
        root * root.transpose() + 0.1 * Eigen::Matrix<double, 6, 6>::Identity();
    Matrix6 A{};
    for (int i = 0; i < 36; ++i) A[static_cast<std::size_t>(i)] = M(i / 6, i % 6);
    Matrix6 B{};
    REQUIRE(invert(A, B));
    Eigen::Matrix<double, 6, 6> found;
    for (int i = 0; i < 36; ++i) found(i / 6, i % 6) = B[static_cast<std::size_t>(i)];
    CHECK((found * M - Eigen::Matrix<double, 6, 6>::Identity()).norm() < 1e-8);
    const Vector6 x = product(A, {1, 0, 0, 0, 0, 2});
    CHECK(x[3] == Approx(M(3, 0) + 2 * M(3, 5)));
    // Nothing is held in one direction: row and column of zeros.
    for (std::size_t i = 0; i < 6; ++i) A[6 * 4 + i] = A[6 * i + 4] = 0.0;
    const Matrix6 before = B;
    CHECK_FALSE(invert(A, B));
    CHECK(B == before);
  }
}

}  // namespace tessera
