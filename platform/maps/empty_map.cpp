// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/empty_map.hpp"

#include <utility>

namespace tessera {

Outcome<LocalMap> make_empty_map(const LocalMap& like, ArenaMemory& memory) {
  MapConfig config = like.config();
  config.storage_bytes = 4 * SlabPool::kPageBytes;
  TESSERA_TRY_ASSIGN(memory, ArenaMemory::allocate(required_bytes(config)));
  Arena arena(memory.span());
  Result<LocalMap> empty = LocalMap::make(arena, config, like.classes());
  TESSERA_ASSERT(empty.ok());  // its settings are those of a map
  return std::move(*empty);
}

}  // namespace tessera
