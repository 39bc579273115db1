// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Eight numbers at once, for units that are compiled for AVX2: see kernel_rows.hpp.
#pragma once

#include <cstdint>

namespace tessera {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));

/// Lanes where mask is all ones, zero where it is zero.
[[gnu::always_inline]] inline Float8 keep_of(Int8 mask, Float8 values) noexcept {
  Int8 bits;
  __builtin_memcpy(&bits, &values, sizeof(bits));
  bits &= mask;
  Float8 kept;
  __builtin_memcpy(&kept, &bits, sizeof(kept));
  return kept;
}
/// Bit i: whether lane i of mask, each all ones or zero, is ones.
[[gnu::always_inline]] inline unsigned bits_of_lanes(Int8 mask) noexcept {
  Float8 signs;
  __builtin_memcpy(&signs, &mask, sizeof(signs));
  return static_cast<unsigned>(__builtin_ia32_movmskps256(signs));
}

}  // namespace tessera
