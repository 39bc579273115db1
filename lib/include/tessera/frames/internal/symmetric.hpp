// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Small symmetric matrices: products, inverses and eigenvalues, the same to the last bit in every
// build. Sums are written out, as Eigen's depend on the vector width.
#pragma once

#include <array>
#include <cstddef>

#include "tessera/base/geometry.hpp"

namespace tessera {

/// xx, xy, xz, yy, yz, zz.
using Symmetric3 = std::array<double, 6>;
/// Rows of a 3x3 matrix.
using Matrix3 = std::array<double, 9>;
/// Rows of a symmetric 6x6 matrix: translation, then rotation.
using Matrix6 = std::array<double, 36>;
using Vector6 = std::array<double, 6>;

/// The rotation of a transform, by rows.
[[nodiscard]] Matrix3 rotation_rows(const Matrix34d& T) noexcept;
/// R S R^T.
[[nodiscard]] Symmetric3 rotated(const Matrix3& R, const Symmetric3& S) noexcept;
/// S: positive definite.
[[nodiscard]] Symmetric3 inverse(const Symmetric3& S) noexcept;
/// S v.
[[nodiscard]] Point3d product(const Symmetric3& S, const Point3d& v) noexcept;

/// Eigenvalues and eigenvectors of a 3x3 matrix.
struct Eigen3 {
  std::array<double, 3> values{};    ///< Ascending.
  std::array<Point3d, 3> vectors{};  ///< Of length 1.
};
/// By Jacobi's rotations, six rounds. O(1).
[[nodiscard]] Eigen3 eigen_of(const Symmetric3& S) noexcept;

/// A's inverse by Cholesky's factors into `inverse`. False, and nothing is written, iff A is not
/// positive definite to rounding. O(1): 6^3 steps thrice.
[[nodiscard]] bool invert(const Matrix6& A, Matrix6& inverse) noexcept;
/// A b.
[[nodiscard]] Vector6 product(const Matrix6& A, const Vector6& b) noexcept;

}  // namespace tessera
