// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Products, inverses and interpolation of transforms, the same to the last bit in every build.
// Written out rather than left to Eigen, whose order of summation depends on the vector width of
// the build, and nothing of libm is used but the square root: the last bit of a pose decides about
// voxels, and so about the digest.
#pragma once

#include "tessera/base/geometry.hpp"

namespace tessera {

/// T_a_c = T_a_b T_b_c.
[[nodiscard]] inline Matrix34d product(const Matrix34d& T_a_b, const Matrix34d& T_b_c) noexcept {
  Matrix34d T_a_c;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      double sum = T_a_b(row, 0) * T_b_c(0, column) + T_a_b(row, 1) * T_b_c(1, column) +
                   T_a_b(row, 2) * T_b_c(2, column);
      if (column == 3) sum += T_a_b(row, 3);
      T_a_c(row, column) = sum;
    }
  }
  return T_a_c;
}

/// The inverse itself, not the transpose: a transform that was printed with few digits is not quite
/// a rotation, and with its inverse it must still give the identity. T must be invertible.
[[nodiscard]] inline Matrix34d inverse(const Matrix34d& T) noexcept {
  const auto cofactor = [&T](int row, int column) {
    const int r1 = (row + 1) % 3;
    const int r2 = (row + 2) % 3;
    const int c1 = (column + 1) % 3;
    const int c2 = (column + 2) % 3;
    return T(r1, c1) * T(r2, c2) - T(r1, c2) * T(r2, c1);
  };
  const double determinant =
      T(0, 0) * cofactor(0, 0) + T(0, 1) * cofactor(0, 1) + T(0, 2) * cofactor(0, 2);
  Matrix34d result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      result(row, column) = cofactor(column, row) / determinant;
    }
    result(row, 3) =
        -(result(row, 0) * T(0, 3) + result(row, 1) * T(1, 3) + result(row, 2) * T(2, 3));
  }
  return result;
}

/// p_a = R p_b + t.
[[nodiscard]] inline Point3d apply(const Matrix34d& T_a_b, const Point3d& p_b) noexcept {
  const auto row = [&](int r) {
    return T_a_b(r, 0) * p_b.x() + T_a_b(r, 1) * p_b.y() + T_a_b(r, 2) * p_b.z() + T_a_b(r, 3);
  };
  return {row(0), row(1), row(2)};
}

/// Between two rigid transforms, by share (0 .. 1) of the way from the first to the second: the
/// translation on the straight line, the rotation about one axis at an even rate (slerp), the
/// shorter way round. Within 1e-12 rad of that for turns up to a quarter, within 1e-6 rad up to a
/// half; at a half turn either way round may be taken. The rotation of the result is exact to
/// rounding, also where the given ones are only nearly rotations. O(1).
[[nodiscard]] Matrix34d interpolate(const Matrix34d& from, const Matrix34d& to,
                                    double share) noexcept;

}  // namespace tessera
