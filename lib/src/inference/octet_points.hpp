// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The inner loop of add_points() on machines with AVX2: all eight voxels of an octet at once, with
// the bits that lanes of four give. What kernel_rows.hpp says about such units holds for it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tessera/inference/internal/tile_point.hpp"

namespace tessera {

/// Points to add to an octet. Lengths in voxels.
struct OctetPoints {
  const TilePoint* points = nullptr;
  std::size_t count = 0;
  float x = 0.0F;  ///< Centre of the octet's first voxel, in the points' coordinates.
  float y = 0.0F;
  float z = 0.0F;
  float scale = 1.0F;           ///< Of weights.
  float inverse_square = 0.0F;  ///< 1 / D^2.
  float least = 0.0F;           ///< The least contribution that counts, above zero.
  float least_share = 0.0F;     ///< The least of a label's share of it that does.
  unsigned voxels = 0xff;       ///< That are added to, a bit each.
  float* planes = nullptr;      ///< Eight sums for each component.
  /// Components whose planes have sums, a bit each; of others they are set.
  std::uint64_t components = 0;
};

/// Returns how many contributions were added. O(8 points).
using AddOctetPoints = std::uint64_t (*)(OctetPoints& octet) noexcept;

/// Null iff this was built for machines without AVX2.
[[nodiscard]] AddOctetPoints octet_points_by_eights() noexcept;

}  // namespace tessera
