// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The inner loop of ImageCarver, in two widths of lanes with the same bits. What kernel_rows.hpp
// says about a unit that is compiled for machines with AVX2 holds here as well.
#pragma once

#include <cstdint>

namespace tessera {

/// What the voxels of a slab are compared with.
struct CarveSlab {
  const std::int16_t* values = nullptr;  ///< Of the face's level; null: nothing is free.
  std::int32_t shift = 0;                ///< From pixels to those of the level.
  std::int32_t edge = 0;                 ///< Of the level; at least 32.
  float inverse_depth = 0.0F;
  std::int16_t least = 0;  ///< Free is what is above it.
};

/// The eight slabs of a block across a face's axis, and what they are compared with. Lengths in
/// metres.
struct CarveSlabs {
  static constexpr int kEdge = 8;
  /// A tangent on a face's edge may be rounded up.
  static constexpr float kWidest = 1.0F + 0x1p-22F;
  // NOLINTBEGIN(cppcoreguidelines-avoid-c-arrays): nothing inline is called here
  const CarveSlab* slab = nullptr;  ///< kEdge of them.
  /// Of the voxels' centres, on the face's columns and rows.
  float at_column[kEdge] = {};
  float at_row[kEdge] = {};
  /// Pixel rows with values.
  std::int32_t first_row = 0;
  std::int32_t last_row = -1;
  /// A pixel is tangent * (slope - bend * |tangent|) + middle.
  float slope = 0.0F;
  float bend = 0.0F;
  float middle = 0.0F;
  /// What is free: a word for each slab, bit column + 8 row.
  std::uint64_t* words = nullptr;
  // NOLINTEND(cppcoreguidelines-avoid-c-arrays)
};

using CompareSlabs = void (*)(const CarveSlabs& slabs) noexcept;
/// For any machine.
[[nodiscard]] CompareSlabs compare_slabs_by_fours() noexcept;
/// For those with AVX2; null where the compiler has no such thing.
[[nodiscard]] CompareSlabs compare_slabs_by_eights() noexcept;

}  // namespace tessera
