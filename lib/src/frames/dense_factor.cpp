// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "dense_factor.hpp"

namespace tessera {

void DenseFactor::clear() noexcept {
  for (double& entry : entries_) entry = 0.0;
}

void DenseFactor::factor() noexcept {
  for (std::size_t k = 0; k < size_; ++k) {
    const double pivot = at(k, k);
    const double inverse = pivot > 0.0 ? 1.0 / pivot : 0.0;
    at(k, k) = inverse;
    for (std::size_t row = k + 1; row < size_; ++row) work_[row] = at(row, k);
    for (std::size_t row = k + 1; row < size_; ++row) {
      // Most robots have no link to each other.
      if (work_[row] == 0.0) continue;
      const double share = work_[row] * inverse;
      double* const entries = &at(row, 0);
      const double* const column = work_.data();
      for (std::size_t j = k + 1; j <= row; ++j) entries[j] -= share * column[j];
      entries[k] = share;
    }
  }
}

void DenseFactor::solve(std::span<double> right_to_left) noexcept {
  for (std::size_t row = 0; row < size_; ++row) {
    double rest = right_to_left[row];
    for (std::size_t k = 0; k < row; ++k) rest -= at(row, k) * right_to_left[k];
    right_to_left[row] = rest;
  }
  for (std::size_t row = 0; row < size_; ++row) right_to_left[row] *= at(row, row);
  for (std::size_t row = size_; row-- > 0;) {
    const double value = right_to_left[row];
    for (std::size_t k = 0; k < row; ++k) right_to_left[k] -= at(row, k) * value;
  }
}

/// X L = I, the last column first and in it the last row, so that what is read is not yet replaced
/// of L and is already of X.
void DenseFactor::invert_lower() noexcept {
  for (std::size_t column = size_; column-- > 0;) {
    for (std::size_t row = column + 1; row < size_; ++row) work_[row] = at(row, column);
    for (std::size_t row = size_; row-- > column + 1;) {
      double sum = work_[row];
      const double* const entries = &at(row, 0);
      for (std::size_t k = column + 1; k < row; ++k) sum += entries[k] * work_[k];
      at(row, column) = -sum;
    }
  }
}

double DenseFactor::inverse_at(std::size_t row, std::size_t column) noexcept {
  double sum = at(row, row) * (row == column ? 1.0 : at(row, column));
  for (std::size_t k = row + 1; k < size_; ++k) sum += at(k, row) * at(k, k) * at(k, column);
  return sum;
}

}  // namespace tessera
