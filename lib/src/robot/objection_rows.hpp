// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Masks of a block's voxels, and places in metres.
#pragma once

#include <algorithm>
#include <array>
#include <bit>

#include "tessera/base/geometry.hpp"
#include "tessera/map/map_config.hpp"

namespace tessera {

inline bool any_of(const VoxelMask& mask) noexcept {
  return std::any_of(mask.begin(), mask.end(), [](std::uint64_t slice) { return slice != 0; });
}

inline void take_row(VoxelMask& mask, int row) noexcept {
  mask[static_cast<std::size_t>(row >> 6)] &=
      ~(std::uint64_t{1} << static_cast<unsigned>(row & 63));
}

template <class Visit>
void for_rows(const VoxelMask& mask, Visit&& visit) noexcept {
  for (int z = 0; z < kBlockEdge; ++z)
    for (std::uint64_t left = mask[static_cast<std::size_t>(z)]; left != 0; left &= left - 1)
      visit(64 * z + std::countr_zero(left));
}

inline Point3d metres(const std::array<double, 3>& voxels, double resolution_m) noexcept {
  return Point3d(voxels[0], voxels[1], voxels[2]) * resolution_m;
}

}  // namespace tessera
