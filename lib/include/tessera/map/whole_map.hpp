// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map whose blocks are in several places, read as one: for saving it, and for its digest.
#pragma once

#include "tessera/map/stored_archive.hpp"

namespace tessera {

/// One of the places.
struct BlockSource {
  void* context = nullptr;
  /// Adds what it has of the block to a map; kOk too where it has nothing. kResourceExhausted: the
  /// map has no room, and nothing of it was added.
  Status (*add)(void* context, BlockKey key, LocalMap& into) = nullptr;
};

/// Blocks come together in a cache, a map of the same settings (LocalMap::config(): with votes
/// where the map keeps them) with room for one block at least (one_block_storage): save and digest
/// are called with it instead of the map. The digest asks for each block 64 times, in eight passes
/// through a layer of blocks and eight through each row along x: a cache with room for a row makes
/// eight of them, one with room for a layer one.
class WholeMap {
 public:
  /// What first has of a block is added before what second has; either may be none. Clears the
  /// cache; revision: of the map. All must outlive it.
  WholeMap(LocalMap& cache, std::uint32_t revision, const BlockSource& first,
           const BlockSource& second) noexcept
      : cache_(cache), revision_(revision), sources_{first, second} {
    forget();
  }
  WholeMap(const WholeMap&) = delete;
  WholeMap& operator=(const WholeMap&) = delete;
  WholeMap(WholeMap&&) = delete;
  WholeMap& operator=(WholeMap&&) = delete;
  ~WholeMap() = default;

  /// Of use while this stays where it is. A block that no source has is an empty one.
  [[nodiscard]] BlockLookup lookup() noexcept;

 private:
  friend struct WholeMapCalls;
  const Block* find(BlockKey key) noexcept;
  Status fetch(BlockKey key) noexcept;
  void forget() noexcept {
    cache_.clear();
    cache_.restore_revision(revision_);
  }

  LocalMap& cache_;
  std::uint32_t revision_;
  std::array<BlockSource, 2> sources_;
};

/// A map and its archive as the places of WholeMap: they must not change meanwhile.
class MapAndArchive {
 public:
  MapAndArchive(const LocalMap& map, StoredArchive& archive) noexcept
      : map_(map), archive_(archive) {}
  [[nodiscard]] BlockSource map() noexcept;
  [[nodiscard]] BlockSource archive() noexcept;
  /// All keys in ascending order. workspace: at least workspace_entries() entries. O(blocks).
  [[nodiscard]] std::span<const KeyedIndex> blocks_in_order(
      std::span<KeyedIndex> workspace) const noexcept;
  [[nodiscard]] std::size_t workspace_entries() const noexcept {
    return 2 * (map_.block_count() + archive_.index().size());
  }

 private:
  friend struct WholeMapCalls;
  const LocalMap& map_;
  StoredArchive& archive_;
};

}  // namespace tessera
