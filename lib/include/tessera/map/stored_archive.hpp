// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The archive of a moving window over whatever keeps bytes: a file, flash, another process. Knows
// which blocks are archived, and adds a block that leaves the window twice to what is kept of it.
// In fixed memory, so that nothing is allocated while the robot drives.
#pragma once

#include "tessera/map/internal/archive_index.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera {

/// Keeps the bytes of blocks.
struct BlockStore {
  void* context = nullptr;
  /// Keeps bytes for the block, instead of what it keeps already. place: any number that the store
  /// wants to have with the block; as it was, or 0. False: they are not kept, and nothing changed.
  bool (*put)(void* context, BlockKey key, std::span<const std::byte> bytes,
              std::uint32_t& place) = nullptr;
  /// Reads the bytes that are kept; how many: 0 if they cannot be had.
  std::size_t (*get)(void* context, BlockKey key, std::uint32_t place,
                     std::span<std::byte> into) = nullptr;
  /// The bytes are not needed any more. May be null.
  void (*drop)(void* context, BlockKey key, std::uint32_t place) = nullptr;
  /// Nor are those of any block. May be null.
  void (*clear)(void* context) = nullptr;
};

/// What happened to blocks since the archive was made.
struct ArchiveCounts {
  std::uint64_t evictions_merged = 0;  ///< Merged with the archived content of the block.
  std::uint64_t no_index = 0;          ///< Refused: the index is full.
  std::uint64_t not_written = 0;       ///< Refused by the store: for example a full disk.
  std::uint64_t not_read = 0;          ///< Not reloaded: unreadable or damaged.
};

class StoredArchive {
 public:
  /// Bytes of arena that make takes. map: that of the map whose blocks are archived.
  [[nodiscard]] static constexpr std::size_t required_bytes(const MapConfig& map,
                                                            int num_components,
                                                            std::size_t blocks) noexcept {
    return arena_bytes<StoredArchive>(1) + ArchiveIndex::required_bytes(blocks) +
           tessera::required_bytes(one_block_config(map, num_components)) +
           2 * arena_bytes<std::byte>(most_block_bytes(num_components));
  }
  /// An archive in the arena, of use as long as its memory is, for up to blocks blocks of such a
  /// map. Fails with kInvalidArgument iff a function for putting or getting is missing;
  /// kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<StoredArchive*> make(Arena& arena, const MapConfig& map,
                                                   const ClassTable& classes, std::size_t blocks,
                                                   const BlockStore& store) noexcept;
  /// For the arena: holds nothing, and takes nothing.
  StoredArchive() noexcept = default;
  StoredArchive(const StoredArchive&) = delete;
  StoredArchive& operator=(const StoredArchive&) = delete;
  StoredArchive(StoredArchive&&) = delete;
  StoredArchive& operator=(StoredArchive&&) = delete;
  ~StoredArchive() = default;

  /// For a Mapper. Work: evict writes at most two blocks in
  /// bytes and reads one, reload reads one, beside that of the store.
  [[nodiscard]] BlockArchive interface() noexcept;
  bool evict(const LocalMap& map, const Block& block) noexcept;
  Status reload(LocalMap& map, BlockKey key) noexcept;
  /// Adds an archived block to a map and keeps it.
  Status read_into(LocalMap& map, BlockKey key) noexcept;
  /// Adds a block of another map to a map. For WholeMap, which has no memory of its own.
  Status copy(const LocalMap& from, const Block& block, LocalMap& into) noexcept;
  /// The store has the block from earlier. False: there is no room for it.
  bool list(BlockKey key, std::uint32_t place) noexcept;
  /// Lets go of all blocks. O(blocks).
  void clear() noexcept;

  [[nodiscard]] const ArchiveIndex& index() const noexcept { return index_; }
  [[nodiscard]] const ArchiveCounts& counts() const noexcept { return counts_; }

 private:
  static constexpr MapConfig one_block_config(MapConfig config, int num_components) noexcept {
    config.storage_bytes = one_block_storage(config.tuple, num_components);
    config.label_votes = true;  // if those that come have any
    return config;
  }
  [[nodiscard]] bool put(BlockKey key, std::span<const std::byte> bytes) noexcept;
  [[nodiscard]] std::span<const std::byte> get(BlockKey key) noexcept;

  BlockStore store_{};
  ArchiveIndex index_{};
  LocalMap one_block_{};  ///< Where a block is merged with its archived content.
  std::span<std::byte> write_{};
  std::span<std::byte> read_{};
  ArchiveCounts counts_{};
};

}  // namespace tessera
