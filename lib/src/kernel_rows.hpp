// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The inner loops of KernelTile::add_points, in two widths of lanes with the same bits. One width
// is compiled for machines with AVX2, and none of that code may run elsewhere. So what its unit
// instantiates from here has a class of its own for an argument, which keeps the linker from taking
// it for another unit's; nothing here calls an inline function that compilers may leave out of
// line, as some of lanes.hpp are; and headers with objects to construct, as Eigen's, are not
// included. A gate looks for what such a unit leaves behind (tests/gates/core_symbols.py).
#pragma once

#include <cstddef>

#include "tessera/base/lanes.hpp"
#include "tessera/inference/tile_point.hpp"

namespace tessera {

inline constexpr int kRowVoxels = 8;
inline constexpr int kSliceVoxels = 64;
inline constexpr int kTileVoxels = 512;

/// Points to add to a tile of 8 x 8 x 8 voxels. Lengths in voxels.
struct KernelRows {
  const TilePoint* points = nullptr;
  std::size_t count = 0;
  /// Takes the points' x, y and z to coordinates from this tile's corner; the last is zero.
  Float4 shift{};
  float radius = 0.0F;  ///< No contribution reaches a voxel centre farther away.
  float weight_scale = 1.0F;
  float inverse_square = 0.0F;  ///< 1 / D^2.
  float least = 0.0F;           ///< The least contribution that counts, above zero.
  float* planes = nullptr;      ///< 512 sums, x fastest, for each component.
  /// Of each component, the rows y + 8 z that something may have been added to; bits are set.
  std::uint64_t* touched = nullptr;
};
/// What adding them took and touched.
struct KernelRowsDone {
  std::uint64_t updates = 0;
  std::uint64_t evaluations = 0;
  std::uint64_t components = 0;  ///< A bit each.
};

/// Adds to the planes and to what is done. O(points * (2 radius + 1)^3), clipped to the tile.
using AddKernelRows = void (*)(const KernelRows& rows, KernelRowsDone& done) noexcept;

/// For any machine.
[[nodiscard]] AddKernelRows kernel_rows_of_four() noexcept;
/// For machines with AVX2, the same sums to the last bit. Null iff this was built for others.
[[nodiscard]] AddKernelRows kernel_rows_of_eight() noexcept;

/// Row is for one call and, after place(), for one point:
///   Row(const KernelRows&);
///   place(p, weight): p: the point in the tile;
///   within(dz, mask of rows): bits of the rows y of slice dz, in voxels from the point, that are
///     within the radius; keeps their squared distances for
///   add(y, row): adds eq. (7) to row y of that slice;
///   updates(): contributions counted.
template <class Row>
[[gnu::always_inline]] inline void add_rows(const KernelRows& rows, KernelRowsDone& done) noexcept {
  Row row(rows);
  constexpr float kLast = static_cast<float>(kRowVoxels - 1);
  const Float4 nothing{};
  for (std::size_t i = 0; i < rows.count; ++i) {
    const TilePoint& point = rows.points[i];
    // The fourth lane is never beyond the tile.
    Float4 p{point.x, point.y, point.z, 0.5F * static_cast<float>(kRowVoxels)};
    p += rows.shift;
    // On each axis, the voxels whose centres may lie within the radius, clipped to the tile.
    const Float4 from = p - rows.radius - 0.5F;
    const Float4 to = p + rows.radius - 0.5F;
    if (row.beyond(from, to)) continue;
    const Float4 clipped_from = from > nothing ? from : nothing;
    const Float4 clipped_to = to < nothing + kLast ? to : nothing + kLast;
    const Int4 first = __builtin_convertvector(clipped_from, Int4);
    const Int4 last = __builtin_convertvector(clipped_to, Int4);
    done.components |= std::uint64_t{1} << point.component;
    row.place(p, point.weight * rows.weight_scale);
    const unsigned clip = (0xffU >> static_cast<unsigned>(kRowVoxels - 1 - last[1])) &
                          (0xffU << static_cast<unsigned>(first[1]));
    float* const plane = rows.planes + std::size_t{point.component} * kTileVoxels;
    std::uint64_t evaluated = 0;
    std::uint64_t touched = 0;
    for (std::int32_t z = first[2]; z <= last[2]; ++z) {
      float* const slice = plane + std::ptrdiff_t{z} * kSliceVoxels;
      unsigned left = row.within(static_cast<float>(z) + 0.5F - p[2]) & clip;
      touched |= std::uint64_t{left} << static_cast<unsigned>(kRowVoxels * z);
      for (; left != 0; left &= left - 1) {
        const int y = __builtin_ctz(left);
        row.add(y, slice + std::ptrdiff_t{y} * kRowVoxels);
        ++evaluated;
      }
    }
    rows.touched[point.component] |= touched;
    done.evaluations += evaluated * static_cast<std::uint64_t>(last[0] - first[0] + 1);
  }
  done.updates += row.updates();
}

}  // namespace tessera
