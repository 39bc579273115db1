// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One block's content in few bytes: what replicas and undiffused sums are kept as. Every class that
// a voxel has is kept; a count is rounded to 25 bits, an error of 2^-18 of it at most, so packing
// what was unpacked gives the same bytes.
//
// Little-endian. 8 bytes: octets with label evidence, a bit each. 8 bytes: octets with free passes.
// A byte for each octet of the first: its voxels with label evidence. Then for each of these octets
// a byte: those of them whose centroid is known. For each voxel, its Centroid's code if so, in a
// byte, and one or more entries of four bytes: bit 31 ends the voxel, bits
// 25 .. 30 the component (0: evidence of no known class, which comes last), bits 0 .. 24 the upper
// bits of the count as a float without its sign: from 2^-60 to 2^30. 8 bytes: octets whose eight
// voxels have the same passes. Then for each octet of the second one byte of passes if it is among
// these, else eight. The last two parts are left out where there are no passes.
#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <span>

#include "tessera/base/internal/bits.hpp"
#include "tessera/map/block_content.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

/// The most bytes that a packed block can have.
constexpr std::size_t most_packed_bytes(int num_components) noexcept {
  const auto entries = static_cast<std::size_t>(num_components);  // label components and the rest
  return 16 + 2 * kBlockOctets + kBlockVoxels + std::size_t{4} * kBlockVoxels * entries + 8 +
         kBlockVoxels;
}

/// Packs content; passes over 255 count as 255. Returns the bytes written: 0 iff there is no
/// evidence or into is too small; most_packed_bytes is always enough. O(512 + voxels * components).
std::size_t pack_block(const BlockContent& content, std::span<std::byte> into) noexcept;

/// Adds all that a block of a map holds to content. O(512 + voxels * components present).
void add_block(const LocalMap& map, const Block& block, BlockContent& content) noexcept;

/// The same for a block as another thread has read it.
void add_block(const BlockSnapshot& block, BlockContent& content) noexcept;

/// kOk iff the bytes are what pack_block could have written for this many components, so with
/// counts from kLeastCount to kLargestCount; else kCorrupt. O(bytes).
Status check_packed(std::span<const std::byte> bytes, int num_components) noexcept;

namespace detail {

inline constexpr std::uint32_t kLeastShort = std::bit_cast<std::uint32_t>(kLeastCount) >> 6U;
inline constexpr std::uint32_t kLargestShort = std::bit_cast<std::uint32_t>(kLargestCount) >> 6U;
/// A count in 25 bits and back. Rounded to nearest, at most the largest; 0 for what is under the
/// least, and for NaN.
constexpr std::uint32_t short_float(float count) noexcept {
  if (!(count >= kLeastCount)) return 0;
  const std::uint32_t rounded = (std::bit_cast<std::uint32_t>(count) + 32U) >> 6U;
  return rounded < kLargestShort ? rounded : kLargestShort;
}
constexpr float long_float(std::uint32_t bits) noexcept {
  return std::bit_cast<float>((bits & 0x1ffffffU) << 6U);
}

template <class Word>
[[nodiscard]] Word load_word(const std::byte* from) noexcept {
  static_assert(std::endian::native == std::endian::little);
  Word word;
  std::memcpy(&word, from, sizeof(word));
  return word;
}

}  // namespace detail

/// For every voxel with label evidence, calls voxel(row, centroid), then label(row, component,
/// count) for each of its entries, component 0 being the rest; then passes(row, count) for every
/// voxel with passes. By octets; row: row order. bytes: empty, or accepted by check_packed. Returns
/// the entries and passes visited. O(bytes).
template <class Voxel, class Label, class Passes>
std::uint32_t unpack_block(std::span<const std::byte> bytes, Voxel&& voxel, Label&& label,
                           Passes&& passes) noexcept {
  if (bytes.empty()) return 0;
  std::uint32_t visited = 0;
  const auto labelled = detail::load_word<std::uint64_t>(bytes.data());
  const auto passed = detail::load_word<std::uint64_t>(bytes.data() + 8);
  const std::byte* masks = bytes.data() + 16;
  const std::byte* at = masks + count_ones(labelled);
  for (std::uint64_t octets = labelled; octets != 0; octets &= octets - 1) {
    const int corner = row_order_corner(std::countr_zero(octets));
    const auto known = std::to_integer<unsigned>(*at++);
    for (auto voxels = std::to_integer<unsigned>(*masks++); voxels != 0; voxels &= voxels - 1) {
      const int row = corner + row_order(0, std::countr_zero(voxels));
      const bool has_centroid = (known & voxels & (~voxels + 1)) != 0;
      voxel(row,
            has_centroid ? Centroid::of_code(std::to_integer<std::uint8_t>(*at++)) : Centroid());
      for (bool more = true; more; at += 4, ++visited) {
        const auto entry = detail::load_word<std::uint32_t>(at);
        label(row, static_cast<int>((entry >> 25U) & 63U), detail::long_float(entry));
        more = entry >> 31U == 0;
      }
    }
  }
  if (passed == 0) return visited;
  const auto uniform = detail::load_word<std::uint64_t>(at);
  at += 8;
  for (std::uint64_t octets = passed; octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    const int corner = row_order_corner(octet);
    const bool same = ((uniform >> static_cast<unsigned>(octet)) & 1U) != 0;
    for (int v = 0; v < kOctetVoxels; ++v) {
      const auto count = std::to_integer<unsigned>(at[same ? 0 : v]);
      if (count == 0) continue;
      passes(corner + row_order(0, v), count);
      ++visited;
    }
    at += same ? 1 : kOctetVoxels;
  }
  return visited;
}

/// The same without centroids.
template <class Label, class Passes>
std::uint32_t unpack_block(std::span<const std::byte> bytes, Label&& label,
                           Passes&& passes) noexcept {
  return unpack_block(
      bytes, [](int, Centroid) {}, label, passes);
}

}  // namespace tessera
