// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How wide the vectors are that hot loops use on the machine that they run on.
#pragma once

#include <array>
#include <cstdint>

namespace tessera {

/// How many voxels are computed at a time. The results are the same to the last bit.
enum class LaneWidth : std::uint8_t {
  kWidest = 0,  ///< Eight where the machine has AVX2 and the library was built with it, else four.
  kFour = 1,
};

/// Whether this machine has AVX2 and its system keeps the registers.
[[nodiscard]] inline bool has_avx2() noexcept {
#if defined(__x86_64__)
  const auto cpuid = [](std::uint32_t leaf) {
    std::array<std::uint32_t, 4> r{};
    __asm__ volatile("cpuid" : "=a"(r[0]), "=b"(r[1]), "=c"(r[2]), "=d"(r[3]) : "a"(leaf), "c"(0));
    return r;
  };
  constexpr std::uint32_t kSavesAndAvx = (1U << 27U) | (1U << 28U);
  if (cpuid(0)[0] < 7 || (cpuid(1)[2] & kSavesAndAvx) != kSavesAndAvx) return false;
  std::uint32_t low = 0;
  std::uint32_t high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return (low & 6U) == 6U && (cpuid(7)[1] & (1U << 5U)) != 0;
#else
  return false;
#endif
}

}  // namespace tessera
