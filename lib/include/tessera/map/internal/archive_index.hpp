// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Index of the blocks in an archive and their places: in fixed memory, so that nothing is allocated
// while the robot drives.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/grid/internal/key_index.hpp"
#include "tessera/map/moving_window.hpp"

namespace tessera {

class ArchiveIndex {
 public:
  /// Bytes of arena for up to blocks blocks in up to blocks / 8 regions.
  static constexpr std::size_t required_bytes(std::size_t blocks) noexcept {
    return KeyIndex::required_bytes(blocks) + KeyIndex::required_bytes(regions(blocks)) +
           arena_bytes<RegionMask>(regions(blocks));
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  static Result<ArchiveIndex> make(Arena& arena, std::size_t blocks) noexcept;
  ArchiveIndex() noexcept = default;

  /// What the store gave as the place of the block.
  [[nodiscard]] std::optional<std::uint32_t> find(BlockKey key) const noexcept {
    return keys_.find(key);
  }
  /// Makes room for a block, which may already exist. False: there is no room.
  bool open(BlockKey key) noexcept;
  /// Sets the place of a block for which there is room.
  void assign(BlockKey key, std::uint32_t place) noexcept { keys_.assign(key, place); }
  void erase(BlockKey key) noexcept;
  /// The blocks of a region; nullptr: none.
  [[nodiscard]] const RegionMask* archived(BlockCoord region) const noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return keys_.size(); }
  [[nodiscard]] std::size_t capacity() const noexcept { return keys_.capacity(); }
  /// All keys in ascending order, with the places as index. workspace: at least 2 * size() entries.
  [[nodiscard]] std::span<const KeyedIndex> blocks_in_order(
      std::span<KeyedIndex> workspace) const noexcept;
  /// Forgets all blocks. O(capacity).
  void clear() noexcept;

 private:
  static constexpr std::size_t regions(std::size_t blocks) noexcept { return blocks / 8 + 64; }
  [[nodiscard]] RegionMask* mask_of(BlockCoord block) noexcept;

  KeyIndex keys_{};
  KeyIndex regions_{};
  std::span<RegionMask> masks_;
};

}  // namespace tessera
