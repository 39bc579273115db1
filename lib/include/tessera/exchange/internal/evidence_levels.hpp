// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The steps that evidence is rounded to before it goes over the air: four an octave, 1, 1.25, 1.5
// and 1.75 times a power of two. Every one is a float of two mantissa bits, so that a packed block
// holds it exactly.
#pragma once

#include <bit>
#include <cstdint>

namespace tessera {

/// Levels of counts: 1 is 2^-12, the least contribution of a point; 127 is 1.5 * 2^19. 0: nothing.
inline constexpr int kMostLevel = 127;
/// Levels of passes: 0 .. 8 are themselves, 27 is 224.
inline constexpr int kMostPassesLevel = 27;

namespace detail {

/// The exponent and the two upper mantissa bits of the level before 2^-12.
inline constexpr int kLevelBias = (127 - 12) * 4 - 1;
inline constexpr unsigned kLevelShift = 21;

}  // namespace detail

/// The level whose count is nearest, of two as near the higher; a positive count has at least
/// level 1, infinity the highest. Off by at most 1 / 9 of the count between the lowest and the
/// highest level's. Counts that are not positive, and NaN, have level 0. O(1).
[[nodiscard]] constexpr int level_of(float count) noexcept {
  if (!(count > 0.0F)) return 0;
  const std::uint32_t half = std::uint32_t{1} << (detail::kLevelShift - 1);
  const std::uint32_t rounded = (std::bit_cast<std::uint32_t>(count) + half) >> detail::kLevelShift;
  const int level = static_cast<int>(rounded) - detail::kLevelBias;
  if (level < 1) return 1;
  return level < kMostLevel ? level : kMostLevel;
}
/// level: 0 .. kMostLevel.
[[nodiscard]] constexpr float count_of_level(int level) noexcept {
  if (level == 0) return 0.0F;
  return std::bit_cast<float>(static_cast<std::uint32_t>(level + detail::kLevelBias)
                              << detail::kLevelShift);
}

/// The level whose passes are nearest, of two as near the higher; off by at most 1 / 8 of the
/// passes up to 256, all beyond have the highest. O(1).
[[nodiscard]] constexpr int passes_level_of(unsigned passes) noexcept {
  if (passes <= 8) return static_cast<int>(passes);
  if (passes >= 224) return kMostPassesLevel;
  unsigned shift = static_cast<unsigned>(std::bit_width(passes)) - 3;
  unsigned mantissa = (passes + (1U << (shift - 1))) >> shift;  // 4 .. 8, of 3 bits
  return static_cast<int>(4 * shift + mantissa);
}
/// level: 0 .. kMostPassesLevel.
[[nodiscard]] constexpr unsigned passes_of_level(int level) noexcept {
  const auto n = static_cast<unsigned>(level);
  return n <= 8 ? n : (4 + n % 4) << (n / 4 - 1);
}

}  // namespace tessera
