// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A dense symmetric matrix and its factors L D L^T, in the caller's memory. Sums are in one order:
// the inner loops of factor() treat each entry by itself, so vectors do not change a bit.
#pragma once

#include <cstddef>
#include <span>

namespace tessera {

/// Of the lower triangle, rows of size entries one after the other.
class DenseFactor {
 public:
  /// entries: size * size; work: size.
  DenseFactor(std::span<double> entries, std::span<double> work, std::size_t size) noexcept
      : entries_(entries.first(size * size)), work_(work.first(size)), size_(size) {}
  [[nodiscard]] double& at(std::size_t row, std::size_t column) noexcept {
    return entries_[row * size_ + column];
  }
  void clear() noexcept;
  /// L below the diagonal, and on it the inverse of D; zero where D is not positive, so that such
  /// an unknown stays as it is. size^3 / 6 multiplications.
  void factor() noexcept;
  /// After factor(). size^2 multiplications.
  void solve(std::span<double> right_to_left) noexcept;
  /// After factor(): L^-1 in the place of L. size^3 / 6 multiplications.
  void invert_lower() noexcept;
  /// After invert_lower(): an entry of the inverse of the matrix, row >= column. O(size).
  [[nodiscard]] double inverse_at(std::size_t row, std::size_t column) noexcept;

 private:
  std::span<double> entries_;
  std::span<double> work_;
  std::size_t size_;
};

}  // namespace tessera
