// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rounding to float that no compiler drops. gcc 12 from -O2 on pairs two conversions
// double -> float -> double in one vector and folds them to nothing, so that a point rounded to
// floats is in the voxel of the point that was not. Needs nothing else of the library: the probe of
// the build (lib/cmake) compiles this file alone.
#pragma once

#include <type_traits>

namespace tessera {

/// value, from a place that the compiler cannot look into: what it knows of how value was computed
/// ends here. A register move at most; a store and a load where the unit for floats is not known.
[[nodiscard]] constexpr float opaque(float value) noexcept {
  if (std::is_constant_evaluated()) return value;
#if defined(__GNUC__) && defined(__SSE__)
  __asm__("" : "+x"(value));
#elif defined(__GNUC__) && defined(__aarch64__)
  __asm__("" : "+w"(value));
#elif defined(__GNUC__)
  __asm__("" : "+m"(value));
#else
  volatile float stored = value;
  value = stored;
#endif
  return value;
}

/// The float nearest to value, ties to even, as IEEE 754 rounds: whatever reads the result sees it
/// rounded, with every tested compiler and optimisation. O(1).
[[nodiscard]] constexpr float round_to_float(double value) noexcept {
  return opaque(static_cast<float>(value));
}

}  // namespace tessera
