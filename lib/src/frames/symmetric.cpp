// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/internal/symmetric.hpp"

#include <cmath>

#include "lower_six.hpp"

namespace tessera {

namespace {

/// The place of an entry in the six of a symmetric matrix.
constexpr std::array<std::size_t, 9> kPlace{0, 1, 2, 1, 3, 4, 2, 4, 5};

/// Makes entry (p, q) of S zero by a rotation, which V takes along.
void turn(std::array<double, 9>& S, std::array<double, 9>& V, std::size_t p,
          std::size_t q) noexcept {
  const double off = S[3 * p + q];
  if (off == 0.0) return;
  const double theta = (S[3 * q + q] - S[3 * p + p]) / (2.0 * off);
  const double size = theta < 0.0 ? -theta : theta;
  const double positive = 1.0 / (size + std::sqrt(theta * theta + 1.0));
  const double t = theta < 0.0 ? -positive : positive;
  const double c = 1.0 / std::sqrt(t * t + 1.0);
  const double s = t * c;
  for (std::size_t k = 0; k < 3; ++k) {
    const double a = S[3 * k + p];
    const double b = S[3 * k + q];
    S[3 * k + p] = c * a - s * b;
    S[3 * k + q] = s * a + c * b;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const double a = S[3 * p + k];
    const double b = S[3 * q + k];
    S[3 * p + k] = c * a - s * b;
    S[3 * q + k] = s * a + c * b;
    const double u = V[3 * k + p];
    const double v = V[3 * k + q];
    V[3 * k + p] = c * u - s * v;
    V[3 * k + q] = s * u + c * v;
  }
}

constexpr std::size_t place_of_six(std::size_t row, std::size_t column) noexcept {
  return 6 * row + column;
}

}  // namespace

Matrix3 rotation_rows(const Matrix34d& T) noexcept {
  return {T(0, 0), T(0, 1), T(0, 2), T(1, 0), T(1, 1), T(1, 2), T(2, 0), T(2, 1), T(2, 2)};
}

Symmetric3 rotated(const Matrix3& R, const Symmetric3& S) noexcept {
  Matrix3 half{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      half[3 * i + j] = R[3 * i] * S[kPlace[j]] + R[3 * i + 1] * S[kPlace[3 + j]] +
                        R[3 * i + 2] * S[kPlace[6 + j]];
  }
  const auto entry = [&](std::size_t i, std::size_t j) {
    return half[3 * i] * R[3 * j] + half[3 * i + 1] * R[3 * j + 1] + half[3 * i + 2] * R[3 * j + 2];
  };
  return {entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)};
}

Symmetric3 inverse(const Symmetric3& S) noexcept {
  const double xx = S[3] * S[5] - S[4] * S[4];
  const double xy = S[2] * S[4] - S[1] * S[5];
  const double xz = S[1] * S[4] - S[2] * S[3];
  const double determinant = S[0] * xx + S[1] * xy + S[2] * xz;
  return {xx / determinant,
          xy / determinant,
          xz / determinant,
          (S[0] * S[5] - S[2] * S[2]) / determinant,
          (S[1] * S[2] - S[0] * S[4]) / determinant,
          (S[0] * S[3] - S[1] * S[1]) / determinant};
}

Point3d product(const Symmetric3& S, const Point3d& v) noexcept {
  return {S[0] * v.x() + S[1] * v.y() + S[2] * v.z(), S[1] * v.x() + S[3] * v.y() + S[4] * v.z(),
          S[2] * v.x() + S[4] * v.y() + S[5] * v.z()};
}

Eigen3 eigen_of(const Symmetric3& S) noexcept {
  std::array<double, 9> A{};
  for (std::size_t i = 0; i < 9; ++i) A[i] = S[kPlace[i]];
  std::array<double, 9> V{1, 0, 0, 0, 1, 0, 0, 0, 1};
  constexpr int kRounds = 6;
  for (int round = 0; round < kRounds; ++round) {
    turn(A, V, 0, 1);
    turn(A, V, 0, 2);
    turn(A, V, 1, 2);
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  const auto sort_two = [&](std::size_t i, std::size_t j) {
    if (A[4 * order[i]] <= A[4 * order[j]]) return;
    const std::size_t swap = order[i];
    order[i] = order[j];
    order[j] = swap;
  };
  sort_two(0, 1);
  sort_two(1, 2);
  sort_two(0, 1);
  Eigen3 result;
  for (std::size_t i = 0; i < 3; ++i) {
    result.values[i] = A[4 * order[i]];
    result.vectors[i] = {V[order[i]], V[3 + order[i]], V[6 + order[i]]};
  }
  return result;
}

bool invert(const Matrix6& A, Matrix6& inverse) noexcept {
  Matrix6 L{};
  const auto is_pivot = [](double rest, double entry) { return rest > 1e-12 * entry; };
  if (!factor_lower(A, L, place_of_six, is_pivot)) return false;
  for (std::size_t column = 0; column < 6; ++column) {
    const Vector6 x = inverse_column(L, place_of_six, column);
    for (std::size_t row = 0; row < 6; ++row) inverse[place_of_six(row, column)] = x[row];
  }
  return true;
}

Vector6 product(const Matrix6& A, const Vector6& b) noexcept {
  Vector6 result{};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = 0; k < 6; ++k) result[i] += A[6 * i + k] * b[k];
  }
  return result;
}

}  // namespace tessera
