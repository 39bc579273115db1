// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The factor and the inverse of a symmetric matrix of six rows, however it is stored: entry (row,
// column) is at place(row, column), of which those with row >= column are read.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace tessera {

/// The lower triangular L with A = L L^T (Cholesky). is_pivot(what is left of a diagonal entry, the
/// entry): false ends it. False: that, or an entry is not finite; L is then without meaning.
template <class Entries, class Place, class IsPivot>
[[nodiscard]] bool factor_lower(const Entries& A, Entries& L, Place place,
                                IsPivot is_pivot) noexcept {
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = 0; column <= row; ++column) {
      double rest = A[place(row, column)];
      for (std::size_t k = 0; k < column; ++k) rest -= L[place(row, k)] * L[place(column, k)];
      if (row != column) {
        L[place(row, column)] = rest / L[place(column, column)];
        continue;
      }
      if (!is_pivot(rest, A[place(row, row)]) || !std::isfinite(rest)) return false;
      L[place(row, row)] = std::sqrt(rest);
    }
  }
  return true;
}

/// A column of A^-1, from the factor of A.
template <class Entries, class Place>
[[nodiscard]] std::array<double, 6> inverse_column(const Entries& L, Place place,
                                                   std::size_t column) noexcept {
  std::array<double, 6> x{};
  x[column] = 1.0;
  for (std::size_t row = column; row < 6; ++row) {
    for (std::size_t k = column; k < row; ++k) x[row] -= L[place(row, k)] * x[k];
    x[row] /= L[place(row, row)];
  }
  for (std::size_t row = 6; row-- > 0;) {
    for (std::size_t k = row + 1; k < 6; ++k) x[row] -= L[place(k, row)] * x[k];
    x[row] /= L[place(row, row)];
  }
  return x;
}

}  // namespace tessera
