// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks from wherever they are kept, for what goes over a map that is not in memory as a whole.
#pragma once

#include "tessera/map/local_map.hpp"

namespace tessera {

/// Gives blocks one by one.
struct BlockLookup {
  void* context = nullptr;
  /// The block with item.key, in the map that it is looked up for, valid until the next call;
  /// nullptr: it cannot be had.
  const Block* (*find)(void* context, const KeyedIndex& item) = nullptr;
};

/// Those of a map that is in memory as a whole.
class BlocksInMemory {
 public:
  explicit BlocksInMemory(const LocalMap& map) noexcept : map_(map) {}
  /// Valid as long as this.
  [[nodiscard]] BlockLookup lookup() noexcept {
    return {this, [](void* self, const KeyedIndex& item) {
              return &static_cast<BlocksInMemory*>(self)->map_.block_at(item.index);
            }};
  }

 private:
  const LocalMap& map_;
};

}  // namespace tessera
