// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An archive in memory for tests of the moving window.
#pragma once

#include <map>
#include <stdexcept>
#include <vector>

#include "support/mapper.hpp"
#include "tessera/map/moving_window.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera::oracle {

class MemoryArchive {
 public:
  explicit MemoryArchive(const LocalMap& like) : memory_(required_bytes(config_of(like))) {
    Arena arena(memory_.span());
    Result<LocalMap> made = LocalMap::make(arena, config_of(like), like.classes());
    if (!made.ok()) throw std::logic_error("no room for one block");
    one_block_ = std::move(*made);
  }

  BlockArchive interface() {
    return {this,
            [](void* context, const LocalMap& map, const Block& block) {
              return static_cast<MemoryArchive*>(context)->evict(map, block);
            },
            [](void* context, BlockCoord region) {
              return static_cast<MemoryArchive*>(context)->archived(region);
            },
            [](void* context, LocalMap& map, BlockKey key) {
              return static_cast<MemoryArchive*>(context)->reload(map, key);
            },
            [](void* context) { static_cast<MemoryArchive*>(context)->blocks_.clear(); }};
  }
  Status reload(LocalMap& map, BlockKey key) {
    const Status status = restore_block(blocks_.at(key.bits), map).status;
    if (status == Status::kOk) blocks_.erase(key.bits);
    return status;
  }
  [[nodiscard]] std::vector<std::uint64_t> keys() const {
    std::vector<std::uint64_t> keys;
    for (const auto& [key, bytes] : blocks_) keys.push_back(key);
    return keys;
  }
  /// Blocks added to what was archived of them.
  [[nodiscard]] std::size_t merged() const { return merged_; }

  bool full = false;  ///< Takes nothing.

 private:
  static MapConfig config_of(const LocalMap& like) {
    MapConfig config = like.config();
    config.storage_bytes = one_block_storage(config.tuple, like.num_components());
    return config;
  }
  static std::vector<std::byte> encoded(const LocalMap& map, const Block& block) {
    std::vector<std::byte> bytes(most_block_bytes(map.num_components()));
    bytes.resize(save_block(map, block, bytes));
    return bytes;
  }
  bool evict(const LocalMap& map, const Block& block) {
    if (full) return false;
    std::vector<std::byte> bytes = encoded(map, block);
    if (bytes.empty()) return true;
    const auto earlier = blocks_.find(block.key);
    if (earlier != blocks_.end()) {
      one_block_.clear();
      if (!restore_block(earlier->second, one_block_).ok() ||
          !restore_block(bytes, one_block_).ok())
        throw std::logic_error("a block cannot be decoded");
      bytes = encoded(one_block_, *one_block_.find(unpack(BlockKey{block.key})));
      ++merged_;
    }
    blocks_[block.key] = bytes;
    return true;
  }
  const RegionMask* archived(BlockCoord region) {
    mask_ = {};
    for (const auto& [bits, bytes] : blocks_) {
      const BlockCoord b = unpack(BlockKey{bits});
      if (!(region_of(b) == region)) continue;
      const auto low = [](std::int32_t v) { return static_cast<unsigned>(v) & 7U; };
      mask_[low(b.z)] |= std::uint64_t{1} << (low(b.y) * 8 + low(b.x));
    }
    return &mask_;
  }

  AlignedMemory memory_;
  LocalMap one_block_;
  std::map<std::uint64_t, std::vector<std::byte>> blocks_;
  RegionMask mask_{};
  std::size_t merged_ = 0;
};

}  // namespace tessera::oracle
