// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Symmetric matrices of six rows as FrameCovariance has them, every sum written out in one order.
#pragma once

#include <array>

#include "lower_six.hpp"
#include "tessera/frames/frame_link.hpp"

namespace tessera {

using SixBySix = std::array<double, FrameCovariance::kValues>;
using Six = std::array<double, FrameCovariance::kSize>;
using SquareOfSix = std::array<double, FrameCovariance::kSize * FrameCovariance::kSize>;

/// The lower triangular L with A = L L^T (Cholesky). False: A is not positive definite, or not
/// finite; L is then without meaning.
[[nodiscard]] inline bool factor_six(const SixBySix& A, SixBySix& L) noexcept {
  constexpr auto at = FrameCovariance::index;
  return factor_lower(A, L, at, [](double rest, double) { return rest > 0.0; });
}

/// r^T A^-1 r from the factor of A.
[[nodiscard]] inline double squared_sigmas(const SixBySix& L, const Six& r) noexcept {
  constexpr auto at = FrameCovariance::index;
  Six y{};
  double sum = 0.0;
  for (std::size_t row = 0; row < FrameCovariance::kSize; ++row) {
    double rest = r[row];
    for (std::size_t k = 0; k < row; ++k) rest -= L[at(row, k)] * y[k];
    y[row] = rest / L[at(row, row)];
    sum += y[row] * y[row];
  }
  return sum;
}

/// A^-1 from the factor of A, column by column.
inline void invert_six(const SixBySix& L, SixBySix& inverse) noexcept {
  constexpr auto at = FrameCovariance::index;
  for (std::size_t column = 0; column < FrameCovariance::kSize; ++column) {
    const Six x = inverse_column(L, at, column);
    for (std::size_t row = column; row < FrameCovariance::kSize; ++row)
      inverse[at(row, column)] = x[row];
  }
}

/// Adds J A J^T. J: row after row.
inline void add_congruent(const SquareOfSix& J, const SixBySix& A, SixBySix& sum) noexcept {
  constexpr std::size_t n = FrameCovariance::kSize;
  constexpr auto at = FrameCovariance::index;
  SquareOfSix left{};
  for (std::size_t row = 0; row < n; ++row) {
    for (std::size_t column = 0; column < n; ++column) {
      double part = 0.0;
      for (std::size_t k = 0; k < n; ++k) part += J[row * n + k] * A[at(k, column)];
      left[row * n + column] = part;
    }
  }
  for (std::size_t row = 0; row < n; ++row) {
    for (std::size_t column = 0; column <= row; ++column) {
      double part = 0.0;
      for (std::size_t k = 0; k < n; ++k) part += left[row * n + k] * J[column * n + k];
      sum[at(row, column)] += part;
    }
  }
}

/// What a motion (t, rotation) of T_b at c_b, in frame b, is in frame a at x_a: rows of six, for
/// T_a_b. t_a = R t + (R r) x (x_a - T_a_b c_b).
inline void motion_seen_from(const Matrix34d& T_a_b, const Point3d& c_b, const Point3d& x_a,
                             SquareOfSix& J) noexcept {
  const double c_x = T_a_b(0, 0) * c_b.x() + T_a_b(0, 1) * c_b.y() + T_a_b(0, 2) * c_b.z();
  const double c_y = T_a_b(1, 0) * c_b.x() + T_a_b(1, 1) * c_b.y() + T_a_b(1, 2) * c_b.z();
  const double c_z = T_a_b(2, 0) * c_b.x() + T_a_b(2, 1) * c_b.y() + T_a_b(2, 2) * c_b.z();
  const double x = x_a.x() - (c_x + T_a_b(0, 3));
  const double y = x_a.y() - (c_y + T_a_b(1, 3));
  const double z = x_a.z() - (c_z + T_a_b(2, 3));
  constexpr std::size_t n = FrameCovariance::kSize;
  for (std::size_t column = 0; column < 3; ++column) {
    const auto axis = static_cast<int>(column);
    const std::array<double, 3> r{T_a_b(0, axis), T_a_b(1, axis), T_a_b(2, axis)};
    const std::array<double, 3> lever{r[1] * z - r[2] * y, r[2] * x - r[0] * z,
                                      r[0] * y - r[1] * x};
    for (std::size_t row = 0; row < 3; ++row) {
      J[row * n + column] = r[row];
      J[row * n + column + 3] = lever[row];
      J[(row + 3) * n + column] = 0.0;
      J[(row + 3) * n + column + 3] = r[row];
    }
  }
}

/// How far E is from the identity at x: (E x - x, twice the vector part of its quaternion, which is
/// 2 sin(angle / 2) times the axis).
[[nodiscard]] Six motion_at(const Matrix34d& E, const Point3d& x) noexcept;

}  // namespace tessera
