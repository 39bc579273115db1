// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 where that is possible (seen_returns.hpp). Nothing fused: the same
// operations on doubles as for one return after the other.
#include "seen_returns.hpp"

#if defined(__AVX2__)

namespace tessera {

namespace {

using Float4 = float __attribute__((vector_size(16)));
using Double4 = double __attribute__((vector_size(32)));
using Long4 = std::int64_t __attribute__((vector_size(32)));

Double4 from_sensor(const SeenReturns& returns, int axis) noexcept {
  const float* const from = returns.points + axis;
  const std::ptrdiff_t step = returns.stride;
  const Float4 coordinates{from[0], from[step], from[2 * step], from[3 * step]};
  return __builtin_convertvector(coordinates, Double4) - returns.origin[axis];
}

Double4 size_of(Double4 values) noexcept {
  Long4 bits;
  __builtin_memcpy(&bits, &values, sizeof(bits));
  bits &= 0x7fffffffffffffff;
  __builtin_memcpy(&values, &bits, sizeof(values));
  return values;
}

unsigned bits_of(Double4 signs) noexcept {
  return static_cast<unsigned>(__builtin_ia32_movmskpd256(signs));
}
unsigned bits_of(Long4 mask) noexcept {
  Double4 signs;
  __builtin_memcpy(&signs, &mask, sizeof(signs));
  return bits_of(signs);
}

/// Of a tangent; sets is_inside where there is such a pixel.
void set_pixels(const SeenReturns& returns, Double4 tangent, Long4& is_inside,
                std::int32_t* into) noexcept {
  const Double4 pixel =
      tangent * (returns.slope - returns.bend * size_of(tangent)) + returns.middle;
  is_inside &= (pixel >= 0.0) & (pixel < returns.edge);
  const auto whole = __builtin_ia32_cvttpd2dq256(pixel);
  __builtin_memcpy(into, &whole, sizeof(whole));
}

void see_by_fours(SeenReturns& returns) noexcept {
  // NOLINTBEGIN(cppcoreguidelines-avoid-c-arrays): as in seen_returns.hpp
  const Double4 d[3] = {from_sensor(returns, 0), from_sensor(returns, 1), from_sensor(returns, 2)};
  const Double4 size[3] = {size_of(d[0]), size_of(d[1]), size_of(d[2])};
  // NOLINTEND(cppcoreguidelines-avoid-c-arrays)
  for (int axis = 0; axis < 3; ++axis) {
    // As axes_across() has them.
    const int column = axis == 0 ? 1 : 0;
    const int row = axis == 2 ? 1 : 2;
    const Double4 widest = returns.widest * size[axis];
    Long4 is_on_face = (size[column] < widest) & (size[row] < widest);
    returns.is_on_face[axis] = 0;
    if (bits_of(is_on_face) == 0) continue;
    set_pixels(returns, d[column] / size[axis], is_on_face, returns.column[axis]);
    set_pixels(returns, d[row] / size[axis], is_on_face, returns.row[axis]);
    const Double4 steps = size[axis] * returns.per_m;
    const auto depth =
        __builtin_ia32_cvttpd2dq256(__builtin_ia32_minpd256(steps, Double4{} + returns.most_depth));
    __builtin_memcpy(returns.depth[axis], &depth, sizeof(depth));
    returns.is_on_face[axis] = bits_of(is_on_face);
    returns.is_negative[axis] = bits_of(Long4(d[axis] < 0.0));
  }
}

}  // namespace

SeeReturns see_returns_by_fours() noexcept { return see_by_fours; }

}  // namespace tessera

#else

namespace tessera {
SeeReturns see_returns_by_fours() noexcept { return nullptr; }
}  // namespace tessera

#endif
