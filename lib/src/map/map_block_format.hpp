// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A block in a checksummed stream: what map files and single stored blocks share.
#pragma once

#include "map_file_format.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera::detail {

/// What went wrong, at the place the source has reached.
inline MapFileStatus failed(const CheckedSource& source, Status status, const char* what) noexcept {
  return {status, what, source.offset()};
}

inline MapFileStatus check(CheckedSource& source, const char* bad) noexcept {
  switch (source.check_crc()) {
    case CheckedSource::Check::kGood:
      return {};
    case CheckedSource::Check::kBad:
      return failed(source, Status::kCorrupt, bad);
    case CheckedSource::Check::kEnd:
      break;
  }
  return failed(source, Status::kTruncated, "the file ends before a checksum");
}

/// Bytes of a buffer that a block's head and free passes are kept in.
inline constexpr std::size_t kPieceBytes = 1024;
/// Bytes of one octet at most: its mask, and for each voxel a number, a centroid and the counts.
inline constexpr std::size_t kOctetPieceBytes = 1 + kOctetVoxels * (2 + 5 * kMaxComponents);

/// What stands before a block's content.
struct BlockHead {
  std::uint64_t key = 0;
  std::uint32_t revision = 0;
  bool free = false;         ///< Free passes follow.
  unsigned votes = 0;        ///< Layers whose votes follow, a bit each.
  std::uint64_t octets = 0;  ///< Which octets with label evidence follow.
};

/// Those of a layer, of a mask of a block's octets.
constexpr unsigned octets_of_layer(std::uint64_t octets, std::size_t layer) noexcept {
  return static_cast<unsigned>(octets >> (kLayerOctets * layer)) & ((1U << kLayerOctets) - 1U);
}

/// In the byte that says whether free passes follow: the lowest of the layers whose votes do.
inline constexpr unsigned kVotesShift = 4;

/// The head of a block of the map; no octet and not free: there is nothing to store.
BlockHead head_of(const LocalMap& map, const Block& block) noexcept;
/// Writes a block that has something to store. buffer: at least kOctetPieceBytes.
void put_block(const LocalMap& map, const Block& block, const BlockHead& head,
               std::span<std::byte> buffer, CheckedSink& sink) noexcept;

/// Reads a head. Fails with kTruncated or kCorrupt.
MapFileStatus read_head(CheckedSource& source, std::span<std::byte, kPieceBytes> buffer,
                        BlockHead& head) noexcept;
/// Adds what follows the head to the map. Fails with kTruncated, kCorrupt, or kResourceExhausted:
/// the map may then have a part of it.
MapFileStatus read_content(CheckedSource& source, std::span<std::byte, kPieceBytes> buffer,
                           const BlockHead& head, LocalMap& map) noexcept;

}  // namespace tessera::detail
