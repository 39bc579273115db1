// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The global map that is read, and beside it what a move of contributions makes of some of its
// blocks: shown all at once, and then copied into the map.
#pragma once

#include "tessera/base/internal/shared_words.hpp"
#include "tessera/fusion/global_map_config.hpp"
#include "tessera/fusion/internal/global_records.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

class TwoMaps {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(
      const GlobalMapConfig& config) noexcept {
    return arena_bytes<LocalMap>(2) + tessera::required_bytes(config.map) +
           tessera::required_bytes(staged_config(config));
  }
  /// Fails with kInvalidArgument iff config.map is out of range; kResourceExhausted iff the arena
  /// is too small.
  [[nodiscard]] static Result<TwoMaps> make(Arena& arena, const GlobalMapConfig& config,
                                            const ClassTable& classes) noexcept;
  TwoMaps() noexcept = default;

  [[nodiscard]] LocalMap& map() const noexcept { return *map_; }
  [[nodiscard]] const LocalMap& staged() const noexcept { return *staged_; }

  /// Stages a block. It stays staged if it is nothing: it hides what the map has. False iff there
  /// is no room.
  [[nodiscard]] bool stage(BlockCoord block, const BlockContent& content) noexcept;
  [[nodiscard]] bool is_staged(BlockCoord block) const noexcept {
    return staged_->find_handle(block) != 0;
  }
  void unstage(BlockCoord block) noexcept {
    if (const SlabHandle handle = staged_->find_handle(block); handle != 0)
      staged_->remove_block(handle);
  }
  /// Replaces a block of the map. False iff it does not take all of it.
  [[nodiscard]] bool replace(BlockCoord block, const BlockContent& content) noexcept;

  /// All that is staged hides what the map has from now on: one more generation. O(1).
  void show_staged() noexcept { store_shared(view_, view_ + 3, std::memory_order_release); }
  /// What a call of merge() did.
  struct Merged {
    std::uint64_t work = 0;
    std::uint64_t refused = 0;  ///< Blocks of which the map took not all.
    bool complete = false;      ///< Nothing is staged any more.
  };
  /// Copies staged blocks into the map, until that is done or so much work is: a bucket of the
  /// index at least. Records of refused blocks are marked as such. content: scratch.
  [[nodiscard]] Merged merge(BlockContent& content, const GlobalRecords& records,
                             std::uint64_t budget) noexcept;

  /// A voxel's estimate; staged_first: what is staged is shown.
  [[nodiscard]] Estimate query(VoxelCoord voxel, bool staged_first) const noexcept;
  /// Twice the generation; one more while what is staged hides what the map has. Other threads
  /// read it.
  [[nodiscard]] const std::uint64_t& view() const noexcept { return view_; }
  [[nodiscard]] std::uint64_t generation() const noexcept { return view_ / 2; }
  [[nodiscard]] std::size_t used_bytes() const noexcept {
    return map_->usage().used_bytes + staged_->usage().used_bytes;
  }

 private:
  [[nodiscard]] static constexpr MapConfig staged_config(const GlobalMapConfig& config) noexcept {
    MapConfig staged = config.map;
    staged.storage_bytes = config.staged_bytes;
    return staged;
  }

  LocalMap* map_ = nullptr;  ///< In the arena, for they are large.
  LocalMap* staged_ = nullptr;
  std::uint64_t view_ = 0;
  SweepCursor merged_{};
};

}  // namespace tessera
