// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "carve_slabs.hpp"

#include <array>
#include <cstddef>

#include "tessera/base/internal/lanes.hpp"

namespace tessera {

namespace {

using Int8s = std::array<Int4, 2>;

struct Pixels {
  Int8s at{};  ///< 0 beyond the face.
  unsigned on_face = 0;
};

Pixels pixels_of(const CarveSlabs& slabs, const float* at_m, float inverse_depth) noexcept {
  Pixels pixels;
  for (std::size_t half = 0; half < 2; ++half) {
    const Float4 tangent = load4(at_m + 4 * half) * inverse_depth;
    const Float4 size = keep(Int4{0x7fffffff, 0x7fffffff, 0x7fffffff, 0x7fffffff}, tangent);
    const Int4 on_face = size <= CarveSlabs::kWidest;
    const Float4 pixel = tangent * (slabs.slope - slabs.bend * size) + slabs.middle;
    pixels.at[half] = __builtin_convertvector(keep(on_face, pixel), Int4);
    pixels.on_face |= bits_of(on_face) << (4 * half);
  }
  return pixels;
}

std::uint64_t compare_slab(const CarveSlabs& slabs, const CarveSlab& slab) noexcept {
  Pixels columns = pixels_of(slabs, slabs.at_column, slab.inverse_depth);
  for (Int4& half : columns.at) half >>= slab.shift;
  const Pixels rows = pixels_of(slabs, slabs.at_row, slab.inverse_depth);
  std::uint64_t word = 0;
  for (unsigned i = 0; i < CarveSlabs::kEdge; ++i) {
    const std::int32_t pixel = rows.at[i / 4][i % 4];
    if ((rows.on_face >> i & 1U) == 0 || pixel < slabs.first_row || pixel > slabs.last_row)
      continue;
    const std::int16_t* const row = slab.values + std::ptrdiff_t{pixel >> slab.shift} * slab.edge;
    const Int4& low = columns.at[0];
    const Int4& high = columns.at[1];
    const Short8 values{row[low[0]],  row[low[1]],  row[low[2]],  row[low[3]],
                        row[high[0]], row[high[1]], row[high[2]], row[high[3]]};
    word |= std::uint64_t{bits_above(values, slab.least) & columns.on_face} << (8 * i);
  }
  return word;
}

void compare_by_fours(const CarveSlabs& slabs) noexcept {
  for (int i = 0; i < CarveSlabs::kEdge; ++i) {
    const CarveSlab& slab = slabs.slab[i];
    slabs.words[i] = slab.values == nullptr ? 0 : compare_slab(slabs, slab);
  }
}

}  // namespace

CompareSlabs compare_slabs_by_fours() noexcept { return compare_by_fours; }

}  // namespace tessera
