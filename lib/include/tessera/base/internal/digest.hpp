// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A 64-bit digest of a sequence of words, the same on every machine. It detects difference; it is
// not cryptographic.
#pragma once

#include <bit>
#include <cstdint>

namespace tessera {

/// The finalizer of splitmix64 (Steele, Lea, Flood, OOPSLA 2014): a bijection of 64 bits with full
/// avalanche.
constexpr std::uint64_t mix64(std::uint64_t x) noexcept {
  x ^= x >> 30U;
  x *= 0xbf58476d1ce4e5b9U;
  x ^= x >> 27U;
  x *= 0x94d049bb133111ebU;
  x ^= x >> 31U;
  return x;
}

/// What a hash table adds to its keys before mix64: never 0 for seed 0, which would leave key 0 as
/// it is.
constexpr std::uint64_t salt_of(std::uint64_t seed) noexcept {
  return 0x9e3779b97f4a7c15U + mix64(seed);
}

/// Folds words in order; equal sequences give equal values.
class Digest {
 public:
  constexpr void add(std::uint64_t word) noexcept {
    state_ = mix64(state_ + 0x9e3779b97f4a7c15U + mix64(word ^ std::rotl(state_, 23)));
  }
  /// Adds the bits of a float; the sign of zero does not count.
  constexpr void add_float(float value) noexcept {
    add(std::bit_cast<std::uint32_t>(value + 0.0F));
  }
  [[nodiscard]] constexpr std::uint64_t value() const noexcept { return mix64(state_); }

 private:
  std::uint64_t state_ = 0x7465737365726121U;
};

}  // namespace tessera
