// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Randomness as a pure function of a seed and a purpose: a value for one tree, one beam or one
// point never depends on values drawn for something else. There is no shared state.
#pragma once

#include <cmath>
#include <cstdint>

namespace tessera::street {

/// Purposes of random numbers, so that two uses with the same coordinates get different values.
enum class Stream : std::uint64_t {
  kTerrain = 1,
  kVerge,
  kLot,
  kTraffic,
  kWalker,
  kLeaf,
  kBeam,
  kLabel,
  kMistake,
  kMistakeClass,
  kBleedColumn,
  kBleedRow,
  kSalt,
  kDrive,
  kPoseError,
  kBelief,
};

/// A bijective mixer in which every input bit reaches every output bit.
constexpr std::uint64_t mix(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

/// A hash of the seed, the purpose and any number of integers; their order matters.
template <class... Integers>
constexpr std::uint64_t hash_of(std::uint64_t seed, Stream stream, Integers... parts) noexcept {
  std::uint64_t h = mix(seed ^ (static_cast<std::uint64_t>(stream) << 56U));
  ((h = mix(h ^ static_cast<std::uint64_t>(parts))), ...);
  return h;
}

/// In [0, 1), 53 bits of the hash.
constexpr double unit_of(std::uint64_t hash) noexcept {
  return static_cast<double>(hash >> 11U) * 0x1.0p-53;
}

/// A short sequence of numbers that starts from a hash.
class Random {
 public:
  explicit constexpr Random(std::uint64_t hash) noexcept : state_(hash) {}

  constexpr std::uint64_t next() noexcept {
    state_ += 0x9e3779b97f4a7c15U;
    return mix(state_);
  }
  /// In [0, 1).
  constexpr double uniform() noexcept { return unit_of(next()); }
  constexpr double uniform(double low, double high) noexcept {
    return low + (high - low) * uniform();
  }
  constexpr bool chance(double probability) noexcept { return uniform() < probability; }
  /// In [0, count).
  constexpr int below(int count) noexcept {
    return static_cast<int>(uniform() * static_cast<double>(count));
  }
  /// Standard normal.
  double gaussian() noexcept {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(6.283185307179586 * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace tessera::street
