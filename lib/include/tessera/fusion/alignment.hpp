// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How well two maps lie on each other where both have labels: whether they name the same classes
// there, and whether they would agree better if one were moved by a few voxels.
#pragma once

#include <array>
#include <cstdint>

#include "tessera/map/local_map.hpp"
#include "tessera/replica/grid_transform.hpp"

namespace tessera {

struct Alignment {
  std::uint32_t compared = 0;  ///< Voxels of the second map that were looked up.
  std::uint32_t common = 0;    ///< Of these, those where both have a label.
  std::uint32_t agreed = 0;    ///< Of these, those with the same label.
  /// By how many voxels along x, y, z of the first map's grid the second one would have to be moved
  /// to agree most: within kMostShift of the place where it is.
  std::array<int, 3> best_shift{};
  std::uint32_t agreed_shifted = 0;  ///< Voxels with the same label then.

  /// Share of the common voxels with the same label; 0 without any.
  [[nodiscard]] double agreement() const noexcept {
    return common == 0 ? 0.0 : static_cast<double>(agreed) / static_cast<double>(common);
  }
  /// True iff moving it would do markedly better: the frames are off by about that.
  [[nodiscard]] bool shifted() const noexcept {
    return 20 * std::uint64_t{agreed_shifted} > 21 * std::uint64_t{agreed} + 400;
  }
};

/// The second map is compared where T_first_second puts it, at evenly taken samples of its label
/// voxels, up to about max_voxels. The best shift is found axis by axis, twice: kLookUps of the
/// first map for each sample, and six passes over the second map's blocks.
class AlignmentCheck {
 public:
  static constexpr int kMostShift = 3;
  static constexpr int kLookUps = 2 * 3 * (2 * kMostShift + 1);

  [[nodiscard]] static Alignment measure(const LocalMap& first, const LocalMap& second,
                                         const GridTransform& T_first_second,
                                         std::uint32_t max_voxels) noexcept;
};

}  // namespace tessera
