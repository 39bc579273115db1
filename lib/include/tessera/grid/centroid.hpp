// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where in a voxel its returns are, to a sixth of the voxel on each axis, in a byte: of the thinned
// points in it, the one nearest to the voxel's middle. A voxel alone does not say where in it the
// surface is, and whoever turns a map must know.
#pragma once

#include <array>
#include <cstdint>

#include "tessera/grid/lattice.hpp"

namespace tessera {

class Centroid {
 public:
  static constexpr int kLevels = 6;
  static constexpr int kCodes = kLevels * kLevels * kLevels + 1;

  /// None is known.
  constexpr Centroid() noexcept = default;
  /// Of a place in the voxel, in voxels from its lower faces: 0 .. 1; what is outside is at the
  /// face.
  [[nodiscard]] static constexpr Centroid at(float x, float y, float z) noexcept {
    return of_levels({level_of(x), level_of(y), level_of(z)});
  }
  /// levels: each 0 .. kLevels - 1.
  [[nodiscard]] static constexpr Centroid of_levels(const std::array<int, 3>& levels) noexcept {
    return of_code(
        static_cast<std::uint8_t>(1 + levels[0] + kLevels * (levels[1] + kLevels * levels[2])));
  }
  /// code: below kCodes.
  [[nodiscard]] static constexpr Centroid of_code(std::uint8_t code) noexcept {
    Centroid result;
    result.code_ = code;
    return result;
  }

  [[nodiscard]] constexpr bool known() const noexcept { return code_ != 0; }
  /// 0: none is known; else 1 + x + 6 y + 36 z of the levels.
  [[nodiscard]] constexpr std::uint8_t code() const noexcept { return code_; }
  /// Of one that is known.
  [[nodiscard]] constexpr std::array<int, 3> levels() const noexcept {
    const int cell = code_ - 1;
    return {cell % kLevels, cell / kLevels % kLevels, cell / (kLevels * kLevels)};
  }
  /// The middle of a level, in voxels from the lower face.
  [[nodiscard]] static constexpr float middle_of(int level) noexcept {
    return (static_cast<float>(level) + 0.5F) / kLevels;
  }

  /// Of two, the one nearer to the voxel's middle, of equally near ones that of the lower code; one
  /// that is known before one that is not. So what is known of a voxel does not depend on the order
  /// of scans and maps.
  [[nodiscard]] constexpr Centroid nearer(Centroid other) const noexcept {
    if (!known() || !other.known()) return known() ? *this : other;
    const int here = square_from_middle();
    const int there = other.square_from_middle();
    return there < here || (there == here && other.code_ < code_) ? other : *this;
  }

  friend constexpr bool operator==(Centroid, Centroid) noexcept = default;

 private:
  [[nodiscard]] static constexpr int level_of(float place) noexcept {
    const float level = place * kLevels;
    if (!(level > 0.0F)) return 0;
    return level < static_cast<float>(kLevels) ? static_cast<int>(level) : kLevels - 1;
  }

  /// In half levels.
  [[nodiscard]] constexpr int square_from_middle() const noexcept {
    int sum = 0;
    for (const int level : levels()) sum += (2 * level + 1 - kLevels) * (2 * level + 1 - kLevels);
    return sum;
  }

  std::uint8_t code_ = 0;
};

/// Of an octet's voxels.
using OctetCentroids = std::array<Centroid, kOctetVoxels>;
static_assert(sizeof(OctetCentroids) == 8);

}  // namespace tessera
