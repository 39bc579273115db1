// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map's occupied voxels as bytes for the page, block by block. docs/view.md has them byte by
// byte.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/map/map_reader.hpp"

namespace tessera {

/// Where a page is in a map's changes. The page keeps it and sends it back; all 0 asks for
/// everything. What changed after `since` is told by one round through the pages of the map's
/// index, over as many messages as it takes.
struct ViewCursor {
  std::uint64_t since = 0;  ///< Stamp up to which the page has all.
  std::uint64_t round = 0;  ///< The map's stamp when the round at hand began; 0: none goes on.
  /// The first key of the page at hand that is not told yet. A page is told by keys, which stay
  /// whatever becomes of its entries: those that leave it go to pages behind.
  std::uint64_t key = 0;
  std::uint32_t page = 0;
  std::uint32_t blocks = 0;  ///< With labels, met in this round.
};

/// Who contributed a voxel, as far as is known.
struct VoxelMark {
  static constexpr std::uint8_t kNobody = 255;
  static constexpr std::uint8_t kTwo = 254;
  static constexpr std::uint8_t kMore = 253;
  std::uint8_t contributor = kNobody;  ///< Index of the only robot, up to 252, or one of these.
  bool disagreement = false;
};

/// Marks of a block's voxels in row order.
using BlockMarks = std::array<VoxelMark, kBlockVoxels>;

inline constexpr std::size_t kViewHeaderBytes = 64;
inline constexpr std::size_t kViewBlockBytes = 20;
inline constexpr std::size_t kViewVoxelBytes = 8;
/// Of a block, at most.
inline constexpr std::size_t kMostViewBlockBytes =
    kViewBlockBytes + kViewVoxelBytes * static_cast<std::size_t>(kBlockVoxels);

/// What one message says beside its blocks.
struct ViewHeader {
  std::uint64_t session = 0;  ///< Another one whenever the server is another.
  ViewCursor next{};
  std::uint32_t map = 0;
  std::uint32_t blocks = 0;    ///< In this message.
  bool round_is_over = false;  ///< next.blocks is how many blocks with labels the map has.
  bool deferred = false;       ///< The voxels of this second are used up.
};

/// into: at least kViewHeaderBytes.
void put_view_header(const ViewHeader& header, std::span<std::byte> into) noexcept;

/// A variance as the page gets it: 40 steps a decade, 0 is 1, 254 is 10^-6.35; 255 is less.
[[nodiscard]] std::uint8_t variance_code(double variance) noexcept;
/// A probability in steps of 1 / 255.
[[nodiscard]] std::uint8_t probability_code(double probability) noexcept;

struct EncodedBlock {
  std::size_t bytes = 0;
  std::uint32_t voxels = 0;
};

/// Occupied voxels with label evidence that have an exposed face, which is one that no occupied
/// voxel of this block hides. into: at least kMostViewBlockBytes. marks: may be null. O(512 + label
/// voxels * C), 2 KiB of stack.
EncodedBlock put_view_block(const BlockSnapshot& block, double prior, const BlockMarks* marks,
                            std::span<std::byte> into) noexcept;

}  // namespace tessera
