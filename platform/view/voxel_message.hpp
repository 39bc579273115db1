// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The occupied voxels of a map as bytes for the page, block by block. docs/reference/view.md has
// the format.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/map/map_reader.hpp"

namespace tessera {

/// Position of a page in the changes of a map. The page stores it and sends it back; all 0 requests
/// everything. Changes after `since` are sent in one round through the pages of the map's index,
/// over as many messages as necessary.
struct ViewCursor {
  std::uint64_t since = 0;  ///< Stamp up to which the page has everything.
  std::uint64_t round =
      0;  ///< The map's stamp at the begin of the current round; 0: there is none.
  /// The first key of the current index page that is not yet sent. Index pages are sent by keys,
  /// which are stable even if entries move: those that leave a page go to later pages.
  std::uint64_t key = 0;
  std::uint32_t page = 0;
  std::uint32_t blocks = 0;  ///< With labels, visited in this round.
};

/// The contributors of a voxel, as far as known.
struct VoxelMark {
  static constexpr std::uint8_t kNobody = 255;
  static constexpr std::uint8_t kTwo = 254;
  static constexpr std::uint8_t kMore = 253;
  std::uint8_t contributor =
      kNobody;  ///< Index of the only robot, up to 252, or one of these values.
  bool disagreement = false;
};

/// Marks of a block's voxels in row order.
using BlockMarks = std::array<VoxelMark, kBlockVoxels>;

/// Flags of a voxel in a message.
inline constexpr std::uint8_t kViewDisagreement = 1;
inline constexpr std::uint8_t kViewMoved = 2;

inline constexpr std::size_t kViewHeaderBytes = 64;
inline constexpr std::size_t kViewBlockBytes = 20;
inline constexpr std::size_t kViewVoxelBytes = 8;
/// Most bytes of a block.
inline constexpr std::size_t kMostViewBlockBytes =
    kViewBlockBytes + kViewVoxelBytes * static_cast<std::size_t>(kBlockVoxels);

/// Header of a message.
struct ViewHeader {
  std::uint64_t session = 0;  ///< Different for each start of the server.
  ViewCursor next{};
  std::uint32_t map = 0;
  std::uint32_t blocks = 0;    ///< In this message.
  bool round_is_over = false;  ///< next.blocks is the number of blocks with labels in the map.
  bool deferred = false;       ///< The budget of this second is used up.
};

/// into: at least kViewHeaderBytes.
void put_view_header(const ViewHeader& header, std::span<std::byte> into) noexcept;

/// A variance for the page: 40 steps per decade, 0 is 1, 254 is 10^-6.35; 255 is less.
[[nodiscard]] std::uint8_t variance_code(double variance) noexcept;
/// A probability in steps of 1 / 255.
[[nodiscard]] std::uint8_t probability_code(double probability) noexcept;

struct EncodedBlock {
  std::size_t bytes = 0;
  std::uint32_t voxels = 0;
};

/// Writes occupied voxels with label evidence that have an exposed face, which no occupied voxel of
/// this block hides, and those that moved: free voxels with a label of moving (bit l: class l, as
/// ClassTable::moving()). into: at least kMostViewBlockBytes. marks: may be null. O(512 + label
/// voxels * C), 2 KiB of stack.
EncodedBlock put_view_block(const BlockSnapshot& block, const Reading& reading,
                            std::uint64_t moving, const BlockMarks* marks,
                            std::span<std::byte> into) noexcept;

}  // namespace tessera
