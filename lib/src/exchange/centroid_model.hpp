// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is decided about the centroids of a block's voxels.
#pragma once

#include <algorithm>

#include "block_contexts.hpp"
#include "octet_code.hpp"

namespace tessera::detail {

/// Coder: as BlockModel's.
template <class Coder>
class CentroidModel {
 public:
  explicit CentroidModel(Coder& coder) noexcept : coder_(coder) {}

  /// Of a labelled voxel that is not full(), whose levels are known.
  void code(VoxelCode& voxel) noexcept {
    constexpr int kLowest = 37;  // a count of an eighth, as half of an octave is one amount
    Centroid& centroid = voxel.centroid;
    const int over = voxel.levels[voxel.set.classes != 0 ? 0 : kRestSlot] - kLowest;
    const auto amount = static_cast<unsigned>(std::clamp(over / 4 + (over >= 0 ? 1 : 0), 0, 5));
    const bool known =
        coder_.bit(kCentroid + kCentroidAmounts * last_known_ + amount, centroid.known());
    last_known_ = known ? 1 : 0;
    if (!known) {
      centroid = {};
      return;
    }
    std::array<int, 3> levels{};
    if (centroid.known()) levels = centroid.levels();
    for (unsigned axis = 0; axis < 3; ++axis) {
      unsigned& last = last_levels_[axis];
      levels[axis] =
          code_level(kCentroidLevel + (axis * kLastLevels + last) * kCentroidNodes, levels[axis]);
      last = static_cast<unsigned>(levels[axis]) + 1;
    }
    centroid = Centroid::of_levels(levels);
  }

 private:
  int code_level(unsigned context, int level) noexcept {
    const auto bits = static_cast<unsigned>(level);
    if (coder_.bit(context, (bits & 4U) != 0))
      return coder_.bit(context + 1, (bits & 1U) != 0) ? 5 : 4;
    const bool upper = coder_.bit(context + 2, (bits & 2U) != 0);
    const bool odd = coder_.bit(context + (upper ? 4U : 3U), (bits & 1U) != 0);
    return (upper ? 2 : 0) + (odd ? 1 : 0);
  }

  Coder& coder_;
  unsigned last_known_ = 2;
  std::array<unsigned, 3> last_levels_{};
};

}  // namespace tessera::detail
