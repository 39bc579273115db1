// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Voxels that are asked for together: each step of a look-up is made for all of a group before the
// next, so that they wait for memory at the same time.
#pragma once

#include <array>
#include <span>

#include "tessera/map/local_map.hpp"

namespace tessera {

class QueryGroup {
 public:
  /// into[i]: the estimate of voxel_of(items[i]); both have the same length.
  template <class Item, class VoxelOf>
  static void query(const LocalMap& map, std::span<const Item> items, std::span<Estimate> into,
                    VoxelOf&& voxel_of) noexcept {
    constexpr std::size_t kGroup = LocalMap::kQueryGroup;
    for (std::size_t at = 0; at < items.size(); at += kGroup) {
      const std::size_t n = items.size() - at < kGroup ? items.size() - at : kGroup;
      std::array<Ask, kGroup> asks;
      for (std::size_t i = 0; i < n; ++i) asks[i].voxel = voxel_of(items[at + i]);
      answer(map, std::span<Ask>(asks).first(n), &into[at]);
    }
  }

 private:
  /// A voxel on its way through a group: each step reads what the step before has sent for.
  struct Ask {
    VoxelCoord voxel;
    bool inside = false;     ///< The grid.
    bool as_before = false;  ///< In the block of the one before.
    BlockKey key;
    const Block* block = nullptr;
    SlabHandle labels = 0;

    void send_for_bucket(const LocalMap& map, const Ask* before) noexcept {
      inside = in_grid(voxel);
      if (!inside) return;
      key = pack_in_grid(block_of(voxel));
      as_before = before != nullptr && before->inside && key == before->key;
      if (!as_before) map.index().prefetch(key);
    }
    void send_for_block(const LocalMap& map) noexcept {
      if (as_before || !inside) return;
      // Whose hash agrees is nearly always the one: its key, which the next step looks at, is
      // awaited there.
      const SlabHandle likely = map.index().find(key, [](SlabHandle) { return true; });
      if (likely == 0) return;
      block = &map.block_at(likely);
      __builtin_prefetch(block);
    }
    void send_for_pages(const LocalMap& map, const Ask* before) noexcept {
      if (before != nullptr && as_before) {
        block = before->block;
      } else if (block != nullptr && block->key != key.bits) {
        const SlabHandle handle = map.find_handle(key);
        block = handle == 0 ? nullptr : &map.block_at(handle);
      }
      if (block == nullptr) return;
      const int row = row_order(voxel);
      labels = block->labels[layer_of_row(row)];
      const SlabHandle passes = block->free_passes[layer_of_row(row)];
      if (labels != 0)
        __builtin_prefetch(map.pool().at(labels) +
                           octet_in_layer(octet_in_block(voxel)) * sizeof(SlabHandle));
      if (passes != 0) __builtin_prefetch(map.pool().at(passes) + row_in_layer(row));
    }
    void send_for_tuples(const LocalMap& map) const noexcept {
      if (labels == 0) return;
      const SlabHandle tuples = map.octet_handle(*block, octet_in_block(voxel));
      if (tuples != 0) map.tuples().prefetch(map.pool().at(tuples));
    }
  };

  static void answer(const LocalMap& map, std::span<Ask> asks, Estimate* into) noexcept {
    const Ask* before = nullptr;
    for (Ask& ask : asks) {
      ask.send_for_bucket(map, before);
      before = &ask;
    }
    for (Ask& ask : asks) ask.send_for_block(map);
    before = nullptr;
    for (Ask& ask : asks) {
      ask.send_for_pages(map, before);
      before = &ask;
    }
    for (const Ask& ask : asks) ask.send_for_tuples(map);
    for (const Ask& ask : asks)
      *into++ = ask.block == nullptr ? map.unobserved() : map.query(*ask.block, ask.voxel);
  }
};

}  // namespace tessera
