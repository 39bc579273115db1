// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 where that is possible (carve_slabs.hpp).
#include "carve_slabs.hpp"

#if defined(__AVX2__)

#include "lanes_of_eight.hpp"

namespace tessera {

namespace {

using Short8 = std::int16_t __attribute__((vector_size(16)));
using Short16 = std::int16_t __attribute__((vector_size(32)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Char16 = char __attribute__((vector_size(16)));
using Char32 = char __attribute__((vector_size(32)));

template <class Vector>
Vector load(const void* from) noexcept {
  Vector lanes;
  __builtin_memcpy(&lanes, from, sizeof(lanes));
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

/// A byte each; each is the number of a value.
Char16 bytes_of(Int8 lanes) noexcept {
  // NOLINTNEXTLINE(cppcoreguidelines-avoid-c-arrays): as in carve_slabs.hpp
  Int4 halves[2];
  __builtin_memcpy(halves, &lanes, sizeof(halves));
  const Short8 shorts = __builtin_ia32_packssdw128(halves[0], halves[1]);
  return __builtin_ia32_packsswb128(shorts, Short8{});
}

Char32 joined(Char16 low, Char16 high) noexcept {
  // NOLINTNEXTLINE(cppcoreguidelines-avoid-c-arrays): as in carve_slabs.hpp
  const Char16 halves[2] = {low, high};
  return load<Char32>(halves);
}

/// What all slabs of a block are compared with, in lanes.
struct Face {
  explicit Face(const CarveSlabs& slabs) noexcept
      : at_column(load<Float8>(slabs.at_column)),
        at_row(load<Float8>(slabs.at_row)),
        slope(Float8{} + slabs.slope),
        bend(Float8{} + slabs.bend),
        middle(Float8{} + slabs.middle),
        first_row(Int8{} + slabs.first_row),
        last_row(Int8{} + slabs.last_row) {}
  Float8 at_column;
  Float8 at_row;
  Float8 slope;
  Float8 bend;
  Float8 middle;
  Int8 first_row;
  Int8 last_row;
};

/// Pixels of eight tangents, 0 beyond the face; sets on_face to all ones where they are on it.
Int8 pixels_of(const Face& face, Float8 tangents, Int8& on_face) noexcept {
  const Float8 size = size_of(tangents);
  on_face = size <= CarveSlabs::kWidest;
  const Float8 pixel = tangents * (face.slope - face.bend * size) + face.middle;
  return __builtin_convertvector(pixel, Int8) & on_face;
}

// Where a slab's eight columns are in a row of values, and which of them are free: above `least`.
// word(values, begin) is a bit for each voxel of the slab, whose rows begin there.

/// Any columns: one by one, as a gather is slower on many machines.
class AnyColumns {
 public:
  AnyColumns(Int8 columns, std::int16_t least) noexcept : least_(Short8{} + least) {
    __builtin_memcpy(column_, &columns, sizeof(column_));
  }
  [[nodiscard]] std::uint64_t word(const std::int16_t* values,
                                   const std::int32_t* begin) const noexcept {
    std::uint64_t word = 0;
    for (unsigned row = 0; row < CarveSlabs::kEdge; ++row) {
      const std::int16_t* const from = values + begin[row];
      const Short8 here{from[column_[0]], from[column_[1]], from[column_[2]], from[column_[3]],
                        from[column_[4]], from[column_[5]], from[column_[6]], from[column_[7]]};
      const Char16 bytes = __builtin_ia32_packsswb128(here > least_, Short8{});
      word |= std::uint64_t{static_cast<unsigned>(__builtin_ia32_pmovmskb128(bytes))} << (8 * row);
    }
    return word;
  }

 private:
  // NOLINTNEXTLINE(cppcoreguidelines-avoid-c-arrays): as in carve_slabs.hpp
  alignas(32) std::int32_t column_[CarveSlabs::kEdge] = {};
  Short8 least_;
};

// Columns that lie within so many values: all of these are compared, and the bytes of what is not
// free are picked from the results. A place that is negative picks none.

/// The highest bits of the bytes at places of each half, of one half or the other.
unsigned picked(Char32 bytes, Char32 places) noexcept {
  const auto bits =
      static_cast<unsigned>(__builtin_ia32_pmovmskb256(__builtin_ia32_pshufb256(bytes, places)));
  return bits | bits >> 16U;
}

/// Four rows at once. Packing puts of two the first eight values into the lower half.
class ColumnsIn16 {
 public:
  static constexpr std::int32_t kValues = 16;
  ColumnsIn16(Int8 columns, std::int32_t first, std::int16_t least) noexcept
      : free_(Short16{} + static_cast<std::int16_t>(least + 1)), first_(first) {
    const Char16 value = bytes_of(columns - first);
    const Char16 both =
        __builtin_shufflevector(value, value, 0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7);
    const Char16 of_row{0, 0, 0, 0, 0, 0, 0, 0, 8, 8, 8, 8, 8, 8, 8, 8};
    const Char16 is_upper = both > 7;
    places_ = joined((both + of_row) | is_upper, (both + of_row - 8) | ~is_upper);
  }
  [[nodiscard]] std::uint64_t word(const std::int16_t* values,
                                   const std::int32_t* begin) const noexcept {
    const std::uint64_t low = four(values + first_, begin);
    const std::uint64_t high = four(values + first_, begin + 4);
    return ~(low | high << 32U);
  }

 private:
  /// Of two rows, in each half what of them is picked from there.
  [[nodiscard]] Char32 two(const std::int16_t* a, const std::int16_t* b) const noexcept {
    const Char32 bytes =
        __builtin_ia32_packsswb256(free_ > load<Short16>(a), free_ > load<Short16>(b));
    return __builtin_ia32_pshufb256(bytes, places_);
  }
  [[nodiscard]] std::uint32_t four(const std::int16_t* values,
                                   const std::int32_t* begin) const noexcept {
    const Char32 first = two(values + begin[0], values + begin[1]);
    const Char32 next = two(values + begin[2], values + begin[3]);
    const Char32 both =
        __builtin_shufflevector(first, next, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15,
                                32, 33, 34, 35, 36, 37, 38, 39, 40, 41, 42, 43, 44, 45, 46, 47);
    const Char32 upper = __builtin_shufflevector(first, next, 16, 17, 18, 19, 20, 21, 22, 23, 24,
                                                 25, 26, 27, 28, 29, 30, 31, 48, 49, 50, 51, 52, 53,
                                                 54, 55, 56, 57, 58, 59, 60, 61, 62, 63);
    return static_cast<std::uint32_t>(__builtin_ia32_pmovmskb256(both | upper));
  }

  Short16 free_;  ///< From it on.
  Char32 places_;
  std::int32_t first_;
};

/// Packing puts values 0 .. 7 and 16 .. 23 into the lower half.
class ColumnsIn32 {
 public:
  static constexpr std::int32_t kValues = 32;
  ColumnsIn32(Int8 columns, std::int32_t first, std::int16_t least) noexcept
      : free_(Short16{} + static_cast<std::int16_t>(least + 1)), first_(first) {
    const Int8 value = columns - first;
    const Char16 in_half = bytes_of((value & 7) | (value >> 4 << 3));
    const Char16 is_upper = bytes_of((value & 8) != 0);
    const Char16 none{0, 0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1};
    places_ = joined(in_half | is_upper | none, in_half | ~is_upper | none);
  }
  [[nodiscard]] std::uint64_t word(const std::int16_t* values,
                                   const std::int32_t* begin) const noexcept {
    std::uint64_t kept = 0;
    for (unsigned row = 0; row < CarveSlabs::kEdge; ++row)
      kept |= std::uint64_t{one(values + begin[row] + first_)} << (8 * row);
    return ~kept;
  }

 private:
  [[nodiscard]] unsigned one(const std::int16_t* from) const noexcept {
    const Char32 bytes =
        __builtin_ia32_packsswb256(free_ > load<Short16>(from), free_ > load<Short16>(from + 16));
    return picked(bytes, places_) & 0xffU;
  }

  Short16 free_;  ///< From it on.
  Char32 places_;
  std::int32_t first_;
};

/// All bits of a byte for each lane that is all ones.
std::uint64_t bytes_of_rows(Int8 mask) noexcept {
  const Char16 bytes = bytes_of(mask);
  std::uint64_t word = 0;
  __builtin_memcpy(&word, &bytes, sizeof(word));
  return word;
}

std::uint64_t compare_slab(const Face& face, const CarveSlab& slab) noexcept {
  Int8 columns_on_face;
  Int8 rows_on_face;
  const Int8 columns =
      pixels_of(face, face.at_column * slab.inverse_depth, columns_on_face) >> slab.shift;
  const Int8 rows = pixels_of(face, face.at_row * slab.inverse_depth, rows_on_face);
  const std::uint64_t counted =
      bytes_of_rows(rows_on_face & (rows >= face.first_row) & (rows <= face.last_row));
  const unsigned on_columns = bits_of_lanes(columns_on_face);
  if (counted == 0 || on_columns == 0) return 0;
  // Other rows are read too, and do not count.
  const Int8 begins = (rows >> slab.shift) * slab.edge;
  // NOLINTNEXTLINE(cppcoreguidelines-avoid-c-arrays): as in carve_slabs.hpp
  alignas(32) std::int32_t begin[CarveSlabs::kEdge];
  __builtin_memcpy(begin, &begins, sizeof(begin));
  // Columns rise. What is read must be within the row.
  const std::int32_t first = columns[0];
  const std::int32_t span = columns[CarveSlabs::kEdge - 1] - first;
  const bool all = on_columns == 0xffU;
  const auto within = [&](std::int32_t values) {
    return first < slab.edge - values ? first : slab.edge - values;
  };
  if (all && span < ColumnsIn16::kValues) {
    const ColumnsIn16 near(columns, within(ColumnsIn16::kValues), slab.least);
    return near.word(slab.values, begin) & counted;
  }
  if (all && span < ColumnsIn32::kValues) {
    const ColumnsIn32 near(columns, within(ColumnsIn32::kValues), slab.least);
    return near.word(slab.values, begin) & counted;
  }
  const std::uint64_t word = AnyColumns(columns, slab.least).word(slab.values, begin);
  return word & counted & (on_columns * std::uint64_t{0x0101010101010101U});
}

void compare_by_eights(const CarveSlabs& slabs) noexcept {
  const Face face(slabs);
  for (int i = 0; i < CarveSlabs::kEdge; ++i) {
    const CarveSlab& slab = slabs.slab[i];
    slabs.words[i] = slab.values == nullptr ? 0 : compare_slab(face, slab);
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
