// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Four floats at once, in the compiler's vector types: the same arithmetic in each lane as a scalar
// would see, so the same bits on every machine. For hot loops of the library's own sources.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace tessera {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

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
[[nodiscard]] inline std::int32_t sum_of(Int4 v) noexcept { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace tessera
