// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Four numbers at once, in the compiler's vector types: the same arithmetic in each lane as a
// scalar would see, so the same bits on every machine. For hot loops of the library's own sources.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace tessera {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Double2 = double __attribute__((vector_size(16)));
using Short8 = std::int16_t __attribute__((vector_size(16)));
using Long2 = std::int64_t __attribute__((vector_size(16)));

[[nodiscard]] inline Float4 all_lanes(float value) noexcept {
  return Float4{value, value, value, value};
}
/// p: at least four floats, of any alignment.
[[nodiscard]] inline Float4 load4(const float* p) noexcept {
  Float4 lanes;
  std::memcpy(&lanes, p, sizeof(lanes));
  return lanes;
}
inline void store4(float* p, Float4 lanes) noexcept { std::memcpy(p, &lanes, sizeof(lanes)); }
/// Correctly rounded in each lane (IEEE 754).
[[nodiscard]] inline Float4 sqrt4(Float4 v) noexcept {
#if defined(__SSE__)
  return __builtin_ia32_sqrtps(v);
#else
  return Float4{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
#endif
}

/// Correctly rounded in each lane (IEEE 754).
[[nodiscard]] inline Double2 sqrt2(Double2 v) noexcept {
#if defined(__SSE2__)
  return __builtin_ia32_sqrtpd(v);
#else
  return Double2{std::sqrt(v[0]), std::sqrt(v[1])};
#endif
}

/// Lanes of v where mask is all ones, zero where it is zero.
[[nodiscard]] inline Float4 keep(Int4 mask, Float4 v) noexcept {
  Int4 bits;
  std::memcpy(&bits, &v, sizeof(bits));
  bits &= mask;
  std::memcpy(&v, &bits, sizeof(v));
  return v;
}
[[nodiscard]] inline bool any(Int4 mask) noexcept {
  std::array<std::uint64_t, 2> halves{};
  std::memcpy(halves.data(), &mask, sizeof(mask));
  return (halves[0] | halves[1]) != 0;
}
/// Bit i: whether lane i of mask, each all ones or zero, is ones.
[[nodiscard]] inline unsigned bits_of(Int4 mask) noexcept {
#if defined(__SSE__)
  Float4 lanes;
  std::memcpy(&lanes, &mask, sizeof(lanes));
  return static_cast<unsigned>(__builtin_ia32_movmskps(lanes));
#else
  mask &= Int4{1, 2, 4, 8};
  return static_cast<unsigned>((mask[0] | mask[1]) | (mask[2] | mask[3]));
#endif
}
/// The upper 32 bits of a's two, then b's two lanes.
[[nodiscard]] inline Int4 upper_halves(Long2 a, Long2 b) noexcept {
  static_assert(std::endian::native == std::endian::little);
  Int4 a_halves;
  Int4 b_halves;
  std::memcpy(&a_halves, &a, sizeof(a));
  std::memcpy(&b_halves, &b, sizeof(b));
  return __builtin_shufflevector(a_halves, b_halves, 1, 3, 5, 7);
}
/// Lanes 1 .. 3 of a, then lane 0 of b.
[[nodiscard]] inline Int4 next_lanes(Int4 a, Int4 b) noexcept {
  return __builtin_shufflevector(a, b, 1, 2, 3, 4);
}
/// Which of eight floats are above limit, a bit each. p: of any alignment.
[[nodiscard]] inline unsigned bits_above(const float* p, float limit) noexcept {
  const Float4 limits = all_lanes(limit);
  return bits_of(load4(p) > limits) | (bits_of(load4(p + 4) > limits) << 4U);
}
/// Which of eight numbers are above limit, a bit each.
[[nodiscard]] inline unsigned bits_above(Short8 v, std::int16_t limit) noexcept {
  const Short8 above = v > Short8{limit, limit, limit, limit, limit, limit, limit, limit};
#if defined(__SSE2__)
  using Char16 = char __attribute__((vector_size(16)));
  const Char16 bytes = __builtin_ia32_packsswb128(above, Short8{});
  return static_cast<unsigned>(__builtin_ia32_pmovmskb128(bytes));
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < 8; ++i) bits |= (above[i] != 0 ? 1U : 0U) << i;
  return bits;
#endif
}
[[nodiscard]] inline std::int32_t sum_of(Int4 v) noexcept { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace tessera
