// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where returns are in the map and in its grid, eight at once on machines with AVX2, with the bits
// of transform() and of Lattice::voxel_of(). What kernel_rows.hpp says about such units holds here.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

/// Eight returns in the sensor's frame, and what becomes of them.
struct PlacedReturns {
  static constexpr int kCount = 8;
  // NOLINTBEGIN(cppcoreguidelines-avoid-c-arrays): nothing inline is called here
  const float* points = nullptr;  ///< Metres; x y z of return i at points[i * stride].
  std::size_t stride = 3;
  double pose[12] = {};  ///< T_map_sensor, row by row.
  double resolution_m = 1.0;
  // Of the square of the distance from the sensor.
  double least_square = 0.0;
  double above_square = 0.0;
  double most_square = 0.0;
  double limit = 0.0;  ///< Of voxels on each axis, a whole number.
  // What is found.
  float at[3][kCount] = {};  ///< In the map's frame, by axis.
  std::int32_t voxel[3][kCount] = {};
  // NOLINTEND(cppcoreguidelines-avoid-c-arrays)
  /// A bit for each: the square is at least least_square, above above_square and at most
  /// most_square, and the voxel is within -limit and limit - 1 on all axes. Of others, what was
  /// found means nothing.
  unsigned is_placed = 0;
};

using PlaceReturns = void (*)(PlacedReturns& returns) noexcept;
/// Null iff this was built for machines without AVX2.
[[nodiscard]] PlaceReturns place_returns_by_fours() noexcept;

}  // namespace tessera
