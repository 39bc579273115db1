// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The inner loops of KernelStrip::add_points, in two widths of lanes with the same bits. One width
// is compiled for machines with AVX2, and none of that code may run elsewhere. So what its unit
// instantiates from here has a class of its own for an argument, which keeps the linker from taking
// it for another unit's; nothing here calls an inline function that compilers may leave out of
// line, as some of lanes.hpp are; and headers with objects to construct, as Eigen's, are not
// included. A gate looks for what such a unit leaves behind (tests/gates/core_symbols.py).
#pragma once

#include <cstddef>

#include "tessera/base/internal/lanes.hpp"
#include "tessera/inference/internal/tile_point.hpp"

namespace tessera {

/// Voxels that are evaluated at a time, and that a tile has on an axis.
inline constexpr int kRowVoxels = 8;
inline constexpr int kTileRows = kRowVoxels * kRowVoxels;  ///< y + 8 z
inline constexpr int kStripTiles = 4;
/// Sums of a row of a strip; the last eight are where rows of eight run over, and mean nothing.
inline constexpr int kStripRow = kRowVoxels * (kStripTiles + 1);
inline constexpr int kStripPlane = kTileRows * kStripRow;

/// Points of one tile to add to a strip: to tiles that follow each other along x. Lengths in
/// voxels.
struct KernelRows {
  const TilePoint* points = nullptr;
  std::size_t count = 0;
  /// Of the points' tile, from the strip's corner: whole tiles; the last is zero.
  Float4 corner{};
  float columns = 0.0F;  ///< Voxels of the strip along x.
  float radius = 0.0F;   ///< No contribution reaches a voxel centre farther away.
  float weight_scale = 1.0F;
  float inverse_square = 0.0F;  ///< 1 / D^2.
  float least = 0.0F;           ///< The least contribution that counts, above zero.
  float least_share = 0.0F;     ///< The least of a label's share of it that does.
  float* planes = nullptr;      ///< kStripPlane sums for each component.
  /// Of each component and tile, the rows that something may have been added to; bits are set.
  std::uint64_t* touched = nullptr;
};
/// What adding them took and touched.
struct KernelRowsDone {
  std::uint64_t updates = 0;
  std::uint64_t evaluations = 0;
  std::uint64_t components = 0;  ///< A bit each.
};

/// The planes that a point adds to, and how much of what it contributes.
struct RowPlanes {
  float* first = nullptr;  ///< All of it, if labels is 0.
  int labels = 0;
  // Not std::array, whose operator is an inline function.
  // NOLINTBEGIN(cppcoreguidelines-avoid-c-arrays)
  float* of_label[4]{};
  float share[4]{};
  // NOLINTEND(cppcoreguidelines-avoid-c-arrays)
};

/// Adds to the planes and to what is done. For each point 64 rows are looked at, and those in reach
/// evaluated in eights of columns: O(points * 64 (2 radius + 8)) for what lies in the strip.
using AddKernelRows = void (*)(const KernelRows& rows, KernelRowsDone& done) noexcept;

/// For any machine.
[[nodiscard]] AddKernelRows kernel_rows_of_four() noexcept;
/// For machines with AVX2, the same sums to the last bit. Null iff this was built for others.
[[nodiscard]] AddKernelRows kernel_rows_of_eight() noexcept;

/// A radius that is surely not under what distances, rounded in any strip's coordinates, come to:
/// what is skipped must be nothing.
[[gnu::always_inline]] inline float padded(float radius) noexcept {
  return radius + (radius + 1.0F) * 0x1p-14F;
}

/// How far x is from the range first .. last.
[[gnu::always_inline]] inline float distance_to(float first, float last, float x) noexcept {
  const float before = first - x;
  const float after = x - last;
  const float outside = before > after ? before : after;
  return outside > 0.0F ? outside : 0.0F;
}

/// Row is for one call and, after place() and at(), for eight columns around one point. Distances
/// are taken between a centre and a point in the point's own tile, so that they round the same
/// whatever strip the voxel is in.
///   Row(const KernelRows&);
///   place(point, square reach): how far in y and z together a row may be;
///   within(z): bits of the rows y of slice z within that; keeps their squared distances for
///   at(column): the first of the eight, not after the last one of the strip;
///   add(row, planes, offset): adds eq. (7) to a row's sums, at an offset in each plane;
///   updates(): contributions counted.
template <class Row>
[[gnu::always_inline]] inline void add_rows(const KernelRows& rows, KernelRowsDone& done) noexcept {
  Row row(rows);
  constexpr auto kEdge = static_cast<float>(kRowVoxels);
  const Float4 size{rows.columns, kEdge, kEdge, kEdge};
  const float radius = padded(rows.radius);
  for (std::size_t i = 0; i < rows.count; ++i) {
    const TilePoint& point = rows.points[i];
    // The fourth lane is never beyond the strip.
    Float4 p{point.x, point.y, point.z, 0.5F * kEdge};
    p += rows.corner;
    // On each axis, the voxels whose centres may lie within the radius.
    const Float4 from = p - radius - 0.5F;
    const Float4 to = p + radius - 0.5F;
    if (row.beyond(from, to, size)) continue;
    const auto first = static_cast<int>(from[0] > 0.0F ? from[0] : 0.0F);
    const auto last = static_cast<int>(to[0] < rows.columns - 1.0F ? to[0] : rows.columns - 1.0F);
    const float apart = distance_to(0.5F, rows.columns - 0.5F, p[0]);
    row.place(point, radius * radius - apart * apart);
    // All rows first: their number is the only thing that a processor has to guess.
    std::uint64_t touched = 0;
    for (int z = 0; z < kRowVoxels; ++z)
      touched |= std::uint64_t{row.within(z)} << static_cast<unsigned>(kRowVoxels * z);
    if (touched == 0) continue;
    RowPlanes planes{.first = rows.planes + std::ptrdiff_t{point.component} * kStripPlane};
    if (point.label_weights != kOneLabel) {
      for_labels(point, [&](std::uint8_t component, std::uint8_t label_weight) {
        planes.of_label[planes.labels] = rows.planes + std::ptrdiff_t{component} * kStripPlane;
        planes.share[planes.labels++] = share_of(label_weight);
      });
    }
    std::uint64_t evaluated = 0;
    for (int column = first; column <= last; column += kRowVoxels) {
      row.at(column);
      evaluated = 0;
      for (std::uint64_t left = touched; left != 0; left &= left - 1) {
        const int at = __builtin_ctzll(left);
        row.add(at, planes, std::ptrdiff_t{at} * kStripRow + column);
        ++evaluated;
      }
    }
    // Of the voxels, not of the lanes: the same in every width.
    done.evaluations += evaluated * static_cast<std::uint64_t>(last - first + 1);
    for_labels(point, [&](std::uint8_t component, std::uint8_t) {
      done.components |= std::uint64_t{1} << component;
      std::uint64_t* const of_tiles = rows.touched + std::ptrdiff_t{component} * kStripTiles;
      for (int tile = first / kRowVoxels; tile <= last / kRowVoxels; ++tile)
        of_tiles[tile] |= touched;
    });
  }
  done.updates += row.updates();
}

}  // namespace tessera
