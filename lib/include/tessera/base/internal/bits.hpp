// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Counting bits without a call: the portable x86-64 has no instruction for it, and compilers then
// call a library routine.
#pragma once

#include <bit>
#include <cstdint>

namespace tessera {

[[nodiscard]] constexpr int count_ones(std::uint64_t word) noexcept {
#if defined(__x86_64__) && !defined(__POPCNT__)
  word -= (word >> 1U) & 0x5555555555555555U;
  word = (word & 0x3333333333333333U) + ((word >> 2U) & 0x3333333333333333U);
  word = (word + (word >> 4U)) & 0x0f0f0f0f0f0f0f0fU;
  return static_cast<int>((word * 0x0101010101010101U) >> 56U);
#else
  return std::popcount(word);
#endif
}

}  // namespace tessera
