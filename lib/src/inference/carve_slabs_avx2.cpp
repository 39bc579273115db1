// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 where that is possible (carve_slabs.hpp).
#include "carve_slabs.hpp"

#if defined(__AVX2__)

namespace tessera {

namespace {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));
using Short8 = std::int16_t __attribute__((vector_size(16)));

Float8 load8(const float* p) noexcept {
  Float8 lanes;
  __builtin_memcpy(&lanes, p, sizeof(lanes));
  return lanes;
}

Int8 bits_in(Float8 v) noexcept {
  Int8 bits;
  __builtin_memcpy(&bits, &v, sizeof(bits));
  return bits;
}

Float8 size_of(Float8 v) noexcept {
  const Int8 bits = bits_in(v) & 0x7fffffff;
  __builtin_memcpy(&v, &bits, sizeof(v));
  return v;
}

unsigned bits_of(Int8 mask) noexcept {
  Float8 signs;
  __builtin_memcpy(&signs, &mask, sizeof(signs));
  return static_cast<unsigned>(__builtin_ia32_movmskps256(signs));
}

/// Bit i: lane i is all ones; each is that or zero.
unsigned bits_of(Short8 mask) noexcept {
  using Char16 = char __attribute__((vector_size(16)));
  const Char16 bytes = __builtin_ia32_packsswb128(mask, Short8{});
  return static_cast<unsigned>(__builtin_ia32_pmovmskb128(bytes));
}

/// Pixels of eight tangents, 0 beyond the face; sets on_face to all ones where they are on it.
Int8 pixels_of(const CarveSlabs& slabs, Float8 tangents, Int8& on_face) noexcept {
  const Float8 size = size_of(tangents);
  on_face = size <= CarveSlabs::kWidest;
  const Float8 pixel = tangents * (slabs.slope - slabs.bend * size) + slabs.middle;
  return __builtin_convertvector(pixel, Int8) & on_face;
}

std::uint64_t compare_slab(const CarveSlabs& slabs, const CarveSlabs::Slab& slab) noexcept {
  Int8 columns_on_face;
  Int8 rows_on_face;
  const Int8 columns =
      pixels_of(slabs, load8(slabs.at_column) * slab.inverse_depth, columns_on_face) >> slab.shift;
  const Int8 rows = pixels_of(slabs, load8(slabs.at_row) * slab.inverse_depth, rows_on_face);
  const Int8 begins = (rows >> slab.shift) * slab.edge;
  // NOLINTBEGIN(cppcoreguidelines-avoid-c-arrays): as in carve_slabs.hpp
  alignas(32) std::int32_t begin[CarveSlabs::kEdge];
  alignas(32) std::int32_t column[CarveSlabs::kEdge];
  // NOLINTEND(cppcoreguidelines-avoid-c-arrays)
  __builtin_memcpy(begin, &begins, sizeof(begin));
  __builtin_memcpy(column, &columns, sizeof(column));
  const std::int16_t at = slab.least;
  const Short8 least{at, at, at, at, at, at, at, at};
  const unsigned on_columns = bits_of(columns_on_face);
  std::uint64_t word = 0;
  // One by one: a gather is slower on many machines.
  for (unsigned left = bits_of(rows_on_face & (rows >= slabs.first_row) & (rows <= slabs.last_row));
       left != 0; left &= left - 1) {
    const auto row = static_cast<unsigned>(__builtin_ctz(left));
    const std::int16_t* const from = slab.values + begin[row];
    const Short8 values{from[column[0]], from[column[1]], from[column[2]], from[column[3]],
                        from[column[4]], from[column[5]], from[column[6]], from[column[7]]};
    word |= std::uint64_t{bits_of(values > least) & on_columns} << (8 * row);
  }
  return word;
}

void compare_by_eights(const CarveSlabs& slabs) noexcept {
  for (int i = 0; i < CarveSlabs::kEdge; ++i) {
    const CarveSlabs::Slab& slab = slabs.slab[i];
    slabs.words[i] = slab.values == nullptr ? 0 : compare_slab(slabs, slab);
  }
}

}  // namespace

CompareSlabs compare_slabs_by_eights() noexcept { return compare_by_eights; }

}  // namespace tessera

#else

namespace tessera {
CompareSlabs compare_slabs_by_eights() noexcept { return nullptr; }
}  // namespace tessera

#endif
