// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a voxel's levels are expected to be, from those of the voxels before: evidence changes
// smoothly over an octet, and from one to the next.
#pragma once

#include "octet_code.hpp"

namespace tessera::detail {

using LevelPlane = std::array<std::uint8_t, kOctetVoxels>;

[[nodiscard]] constexpr int clamp_level(int level) noexcept {
  if (level < 1) return 1;
  return level < kMostLevel ? level : kMostLevel;
}

/// A plane of an octet's levels for each slot. A voxel that has no level there counts with the one
/// that was expected.
class LevelPlanes {
 public:
  /// first: what the first voxel's first level is expected to be.
  void begin_octet(int first) noexcept {
    first_ = first;
    used_ = 1;
  }
  /// Whether a slot's levels have a plane in this octet: the first always, others from the first
  /// voxel on that has such a level.
  [[nodiscard]] bool used(int slot) const noexcept { return (used_ >> slot & 1) != 0; }
  /// Gives a slot its plane; the voxels before v count as what is above the first slot's by the
  /// step that the slot had last.
  void use(int slot, std::size_t v) noexcept {
    used_ |= 1 << slot;
    for (std::size_t u = 0; u < v; ++u)
      plane(slot)[u] = static_cast<std::uint8_t>(clamp_level(planes_[0][u] + step(slot)));
  }
  [[nodiscard]] int expected(int slot, std::size_t v) const noexcept {
    const LevelPlane& l = planes_[static_cast<std::size_t>(slot)];
    switch (v) {
      case 0:
        return slot == 0 ? first_
                         : clamp_level(planes_[0][0] + steps_[static_cast<std::size_t>(slot)]);
      case 3:
        return clamp_level(l[1] + l[2] - l[0]);
      case 5:
        return clamp_level(l[1] + l[4] - l[0]);
      case 6:
        return clamp_level(l[2] + l[4] - l[0]);
      case 7:
        return clamp_level((2 * (l[3] + l[5] + l[6]) - l[1] - l[2] - l[4]) / 3);
      default:
        return l[0];
    }
  }
  void expect(int slot, std::size_t v, int level) noexcept {
    plane(slot)[v] = static_cast<std::uint8_t>(level);
  }
  void set(int slot, std::size_t v, int level) noexcept {
    expect(slot, v, level);
    step(slot) = level - planes_[0][v];
  }
  [[nodiscard]] const LevelPlane& first_plane() const noexcept { return planes_[0]; }

 private:
  static constexpr int kFirstStep = -4;
  [[nodiscard]] LevelPlane& plane(int slot) noexcept {
    return planes_[static_cast<std::size_t>(slot)];
  }
  [[nodiscard]] int& step(int slot) noexcept { return steps_[static_cast<std::size_t>(slot)]; }

  int first_ = 1;
  int used_ = 1;
  std::array<LevelPlane, kSlots> planes_{};
  /// From the first slot's level to each slot's, in the last voxel that had it.
  std::array<int, kSlots> steps_{0, kFirstStep, kFirstStep, kFirstStep};
};

}  // namespace tessera::detail
