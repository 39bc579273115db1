// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/whole_map.hpp"

#include <algorithm>

#include "maps/stored_map.hpp"

namespace tessera {

WholeMap::WholeMap(LocalMap& map, ArchiveFile& archive)
    : map_(map), archive_(archive), kept_(map.block_count()), revision_(map.revision()) {
  if (kept_ == 0) forget();
}

Outcome<std::vector<KeyedIndex>> WholeMap::keys() {
  std::vector<KeyedIndex> workspace = workspace_for(map_);
  const std::span<const KeyedIndex> kept = map_.blocks_in_order(workspace);
  for (const KeyedIndex& item : kept) {
    const BlockKey key{item.key};
    if (archive_.index().find(key) && archive_.reload(map_, key) != Status::kOk)
      return unreadable();
  }
  const std::vector<KeyedIndex> archived = archive_.index().keys_in_order();
  std::vector<KeyedIndex> all(kept.size() + archived.size());
  std::merge(kept.begin(), kept.end(), archived.begin(), archived.end(), all.begin(),
             [](const KeyedIndex& a, const KeyedIndex& b) { return a.key < b.key; });
  return all;
}

BlockLookup WholeMap::lookup() {
  return {this, [](void* context, const KeyedIndex& item) {
            return static_cast<WholeMap*>(context)->find(BlockKey{item.key});
          }};
}

Failure WholeMap::unreadable() const {
  return {"cannot read a block of " + archive_.path() +
              "; the map is not written: check the disk, or give a larger --memory",
          FailureKind::kFailure};
}

void WholeMap::forget() {
  if (kept_ == 0) {
    map_.clear();  // so that pages of the storage can serve other sizes again
    map_.restore_revision(revision_);
  } else {
    for (const BlockKey key : fetched_) {
      const Result<SlabHandle> handle = map_.open_block(unpack(key));  // exists
      if (handle.ok()) map_.remove_block(*handle);
    }
  }
  fetched_.clear();
}

const Block* WholeMap::find(BlockKey key) {
  if (const Block* const block = map_.find(unpack(key))) return block;
  Status status = archive_.read_into(map_, key);
  if (status == Status::kResourceExhausted) {
    forget();
    status = archive_.read_into(map_, key);
  }
  if (status != Status::kOk) return nullptr;
  fetched_.push_back(key);
  return map_.find(unpack(key));
}

}  // namespace tessera
