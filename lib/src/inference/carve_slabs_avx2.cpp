// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 where that is possible (carve_slabs.hpp).
#include "carve_slabs.hpp"

#if defined(__AVX2__)

#include <immintrin.h>

namespace tessera {

namespace {

__m256 size_of(__m256 v) noexcept {
  return _mm256_and_ps(v, _mm256_castsi256_ps(_mm256_set1_epi32(0x7fffffff)));
}

/// Pixels of eight tangents, 0 beyond the face; sets on_face to all ones where they are on it.
__m256i pixels_of(const CarveSlabs& slabs, __m256 tangents, __m256i& on_face) noexcept {
  const __m256 size = size_of(tangents);
  const __m256 within = _mm256_cmp_ps(size, _mm256_set1_ps(1.0F), _CMP_LE_OQ);
  on_face = _mm256_castps_si256(within);
  const __m256 slope =
      _mm256_sub_ps(_mm256_set1_ps(slabs.slope), _mm256_mul_ps(_mm256_set1_ps(slabs.bend), size));
  const __m256 pixel = _mm256_add_ps(_mm256_mul_ps(tangents, slope), _mm256_set1_ps(slabs.middle));
  return _mm256_and_si256(_mm256_cvttps_epi32(pixel), on_face);
}

unsigned bits_of(__m256i mask) noexcept {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(mask)));
}

std::uint64_t compare_slab(const CarveSlabs& slabs, const CarveSlabs::Slab& slab) noexcept {
  const __m256 inverse = _mm256_set1_ps(slab.inverse_depth);
  const __m128i shift = _mm_cvtsi32_si128(slab.shift);
  __m256i columns_on_face;
  __m256i rows_on_face;
  const __m256i columns = _mm256_srl_epi32(
      pixels_of(slabs, _mm256_mul_ps(_mm256_loadu_ps(slabs.at_column), inverse), columns_on_face),
      shift);
  const __m256i rows =
      pixels_of(slabs, _mm256_mul_ps(_mm256_loadu_ps(slabs.at_row), inverse), rows_on_face);
  const __m256i beside =
      _mm256_or_si256(_mm256_cmpgt_epi32(_mm256_set1_epi32(slabs.first_row), rows),
                      _mm256_cmpgt_epi32(rows, _mm256_set1_epi32(slabs.last_row)));
  alignas(32) std::int32_t offset[CarveSlabs::kEdge];
  _mm256_store_si256(
      reinterpret_cast<__m256i*>(offset),
      _mm256_mullo_epi32(_mm256_srl_epi32(rows, shift), _mm256_set1_epi32(slab.edge)));
  // Of each four bytes the upper two are of the pixel.
  const __m256i least = _mm256_set1_epi32(slab.least * 65536);
  std::uint64_t word = 0;
  for (unsigned left = bits_of(_mm256_andnot_si256(beside, rows_on_face)); left != 0;
       left &= left - 1) {
    const auto row = static_cast<unsigned>(__builtin_ctz(left));
    const __m256i both =
        _mm256_i32gather_epi32(reinterpret_cast<const int*>(slab.values + offset[row]), columns, 2);
    const __m256i free = _mm256_cmpgt_epi32(_mm256_slli_epi32(both, 16), least);
    word |= std::uint64_t{bits_of(_mm256_and_si256(free, columns_on_face))} << (8 * row);
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
