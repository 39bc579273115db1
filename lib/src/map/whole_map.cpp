// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/whole_map.hpp"

#include <algorithm>

namespace tessera {

/// Named, so that the gate of the stack knows who calls them.
struct WholeMapCalls {
  static const Block* find(void* whole, const KeyedIndex& item) {
    return static_cast<WholeMap*>(whole)->find(BlockKey{item.key});
  }
  static Status add_of_map(void* both, BlockKey key, LocalMap& into) {
    auto& places = *static_cast<MapAndArchive*>(both);
    const Block* const block = places.map_.find(unpack(key));
    return block == nullptr ? Status::kOk : places.archive_.copy(places.map_, *block, into);
  }
  static Status add_of_archive(void* both, BlockKey key, LocalMap& into) {
    auto& places = *static_cast<MapAndArchive*>(both);
    if (!places.archive_.index().find(key)) return Status::kOk;
    return places.archive_.read_into(into, key);
  }
};

BlockLookup WholeMap::lookup() noexcept { return {this, &WholeMapCalls::find}; }

/// Opened even if there is nothing of it.
Status WholeMap::fetch(BlockKey key) noexcept {
  for (const BlockSource& source : sources_) {
    if (source.add == nullptr) continue;
    const Status status = source.add(source.context, key, cache_);
    if (status != Status::kOk) return status;
  }
  return cache_.open_block(unpack(key)).status();
}

/// Whatever fails, no part of it stays in the cache. Not inlined, so that the gate of the stack
/// knows who calls the sources.
[[gnu::noinline]] const Block* WholeMap::find(BlockKey key) noexcept {
  if (const Block* const block = cache_.find(unpack(key))) return block;
  Status status = fetch(key);
  if (status == Status::kResourceExhausted) {
    forget();
    status = fetch(key);
  }
  if (status == Status::kOk) return cache_.find(unpack(key));
  forget();
  return nullptr;
}

BlockSource MapAndArchive::map() noexcept { return {this, &WholeMapCalls::add_of_map}; }
BlockSource MapAndArchive::archive() noexcept { return {this, &WholeMapCalls::add_of_archive}; }

/// Both lists are sorted, then joined in place: each key once.
std::span<const KeyedIndex> MapAndArchive::blocks_in_order(
    std::span<KeyedIndex> workspace) const noexcept {
  TESSERA_ASSERT(workspace.size() >= workspace_entries());
  const std::size_t in_map = map_.blocks_in_order(workspace.first(2 * map_.block_count())).size();
  // The first half of each part is the list, the second scratch.
  const std::span<KeyedIndex> rest = workspace.subspan(in_map);
  const std::size_t archived = archive_.index().blocks_in_order(rest).size();
  const std::size_t n = in_map + archived;
  radix_sort(workspace.first(n), workspace.subspan(n, n));
  KeyedIndex* const end =
      std::unique(workspace.data(), workspace.data() + n,
                  [](const KeyedIndex& a, const KeyedIndex& b) { return a.key == b.key; });
  return workspace.first(static_cast<std::size_t>(end - workspace.data()));
}

}  // namespace tessera
