// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 where that is possible (placed_returns.hpp). Nothing fused: the same
// operations on doubles as for one return after the other.
#include "placed_returns.hpp"

#if defined(__AVX2__)

namespace tessera {

namespace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Double4 = double __attribute__((vector_size(32)));
using Long4 = std::int64_t __attribute__((vector_size(32)));

Double4 coordinate_of(const PlacedReturns& returns, std::ptrdiff_t first, int axis) noexcept {
  const float* const from =
      returns.points + first * static_cast<std::ptrdiff_t>(returns.stride) + axis;
  const auto step = static_cast<std::ptrdiff_t>(returns.stride);
  const Float4 coordinates{from[0], from[step], from[2 * step], from[3 * step]};
  return __builtin_convertvector(coordinates, Double4);
}

/// As round_to_float(), of which compilers drop nothing.
Float4 rounded(Double4 values) noexcept {
  Float4 result = __builtin_ia32_cvtpd2ps256(values);
  __asm__("" : "+x"(result));
  return result;
}

/// As floor_to_int(), of what is within the integers.
Int4 floor_of(Double4 values) noexcept {
  const Int4 truncated = __builtin_ia32_cvttpd2dq256(values);
  const Long4 is_above = __builtin_convertvector(truncated, Double4) > values;
  return truncated + __builtin_convertvector(is_above, Int4);
}

unsigned bits_of(Long4 mask) noexcept {
  Double4 signs;
  __builtin_memcpy(&signs, &mask, sizeof(signs));
  return static_cast<unsigned>(__builtin_ia32_movmskpd256(signs));
}

unsigned place_four(PlacedReturns& returns, std::ptrdiff_t first) noexcept {
  const Double4 x = coordinate_of(returns, first, 0);
  const Double4 y = coordinate_of(returns, first, 1);
  const Double4 z = coordinate_of(returns, first, 2);
  const Double4 square = x * x + y * y + z * z;
  // Not for NaN.
  Long4 placed = (square >= returns.least_square) & (square > returns.above_square) &
                 (square <= returns.most_square);
  for (int axis = 0; axis < 3; ++axis) {
    const double* const row = returns.pose + std::ptrdiff_t{4} * axis;
    const Float4 at = rounded(row[0] * x + row[1] * y + row[2] * z + row[3]);
    const Double4 q = __builtin_convertvector(at, Double4) / returns.resolution_m;
    placed &= (q >= -returns.limit) & (q < returns.limit);
    const Int4 voxel = floor_of(q);
    __builtin_memcpy(returns.at[axis] + first, &at, sizeof(at));
    __builtin_memcpy(returns.voxel[axis] + first, &voxel, sizeof(voxel));
  }
  return bits_of(placed);
}

void place_by_fours(PlacedReturns& returns) noexcept {
  returns.is_placed = place_four(returns, 0) | place_four(returns, 4) << 4U;
}

}  // namespace

PlaceReturns place_returns_by_fours() noexcept { return place_by_fours; }

}  // namespace tessera

#else

namespace tessera {
PlaceReturns place_returns_by_fours() noexcept { return nullptr; }
}  // namespace tessera

#endif
