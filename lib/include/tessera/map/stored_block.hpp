// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One block as bytes, as a map file holds it (docs/reference/memory.md has the layout): for
// archives and for whatever else keeps blocks outside of a map.
#pragma once

#include <cstddef>
#include <span>

#include "tessera/map/map_file.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

/// The most bytes of a block in a map with num_components = C + 2 components.
constexpr std::size_t most_block_bytes(int num_components) noexcept {
  const std::size_t counts = 5 * static_cast<std::size_t>(num_components);
  constexpr std::size_t kVotes = 1 + LabelVotes::kClasses * (1 + 2 * LabelVotes::kCells);
  return 21 + 4 + kBlockVoxels + kBlockLayers * kVotes +
         kBlockOctets * (1 + kOctetVoxels * (2 + counts)) + 4;
}

/// Storage that a map needs to hold any one block, its own and no other, in whole pages.
constexpr std::size_t one_block_storage(TuplePolicy tuple, int num_components) noexcept {
  const std::size_t in_page = SlabPool::kPageBytes / TupleStore::octet_bytes(tuple, num_components);
  // A page each of blocks, label pages and free pages, and one to spare.
  return (3 + (kBlockOctets + in_page - 1) / in_page + 1) * SlabPool::kPageBytes;
}

/// Writes a block of the map. Returns the bytes written: 0 iff the block holds no evidence, or more
/// than into.size() are needed; most_block_bytes is always enough. O(512 + observed voxels * C).
std::size_t save_block(const LocalMap& map, const Block& block, std::span<std::byte> into) noexcept;

/// The same bytes for a block as another thread has read it.
std::size_t save_block(const BlockSnapshot& block, std::span<std::byte> into) noexcept;

/// The revision of a block that save_block wrote: see Block::revision. bytes: of one. O(1).
std::uint32_t revision_of_stored(std::span<const std::byte> bytes) noexcept;

/// Adds a block that save_block wrote to the map, opening it if it is not there: see
/// LocalMap::merge; votes, where the map keeps them, are added (LabelVotes::add), and the block's
/// revision is the later one. Fails with kResourceExhausted iff storage or index has no room for
/// all of it: counted, map unchanged; kTruncated or kCorrupt iff the bytes are no such block: only
/// bytes whose checksums fit can have changed the map. O(512 + observed voxels * C).
MapFileStatus restore_block(std::span<const std::byte> bytes, LocalMap& map) noexcept;

}  // namespace tessera
