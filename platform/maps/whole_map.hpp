// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map and its archive as one: blocks are read into the map's memory when they are requested.
#pragma once

#include <vector>

#include "base/outcome.hpp"
#include "maps/archive_file.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

class WholeMap {
 public:
  /// Both must outlive it. An empty map is cleared whenever it is full.
  WholeMap(LocalMap& map, ArchiveFile& archive);
  /// All keys in ascending order. Fails with kFailure iff a block that both have cannot be merged.
  Outcome<std::vector<KeyedIndex>> keys();
  /// Of a block by its key; null iff it cannot be read.
  BlockLookup lookup();
  [[nodiscard]] Failure unreadable() const;

 private:
  void forget();
  const Block* find(BlockKey key);

  LocalMap& map_;
  ArchiveFile& archive_;
  std::size_t kept_;  ///< Blocks that the archive did not take.
  std::uint32_t revision_;
  std::vector<BlockKey> fetched_;
};

}  // namespace tessera
