// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/two_maps.hpp"

#include "tessera/base/internal/bits.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

Result<TwoMaps> TwoMaps::make(Arena& arena, const GlobalMapConfig& config,
                              const ClassTable& classes) noexcept {
  const std::span<LocalMap> maps = arena.take<LocalMap>(2);
  if (maps.empty()) return Status::kResourceExhausted;
  Status status = LocalMap::make_at(maps[0], arena, config.map, classes);
  if (status == Status::kOk)
    status = LocalMap::make_at(maps[1], arena, staged_config(config), classes);
  if (status != Status::kOk) return status;
  TwoMaps made;
  made.map_ = &maps.front();
  made.staged_ = &maps.back();
  return made;
}

bool TwoMaps::stage(BlockCoord block, const BlockContent& content) noexcept {
  const Result<SlabHandle> handle = staged_->open_block(block);
  if (!handle.ok()) return false;
  if (staged_->replace(*handle, content) == Status::kOk) return true;
  staged_->close_if_empty(*handle);
  return false;
}

bool TwoMaps::replace(BlockCoord block, const BlockContent& content) noexcept {
  if (!content.any()) {
    if (const SlabHandle handle = map_->find_handle(block); handle != 0) map_->remove_block(handle);
    return true;
  }
  const Result<SlabHandle> handle = map_->open_block(block);
  if (!handle.ok()) return false;
  const bool all = map_->replace(*handle, content) == Status::kOk;
  map_->close_if_empty(*handle);
  return all;
}

TwoMaps::Merged TwoMaps::merge(BlockContent& content, const GlobalRecords& records,
                               std::uint64_t budget) noexcept {
  Merged merged{.work = 1};
  while (staged_->block_count() != 0) {
    merged.work += staged_->visit_blocks(
        merged_, BlockIndex::kBucketSlots, [&](BlockKey key, SlabHandle handle) {
          content.clear();
          add_block(*staged_, staged_->block_at(handle), content);
          if (!replace(unpack(key), content)) {
            ++merged.refused;
            if (const std::uint32_t number = records.find(unpack(key)); number != 0)
              records.at(number).refused = true;
          }
          staged_->remove_block(handle);
          merged.work += kBlockVoxels + kBlockVoxels * static_cast<std::uint64_t>(
                                                           count_ones(content.components()));
          return true;
        });
    if (merged.work >= budget) break;
  }
  merged.complete = staged_->block_count() == 0;
  if (merged.complete && view_ % 2 != 0) store_shared(view_, view_ - 1, std::memory_order_release);
  return merged;
}

Estimate TwoMaps::query(VoxelCoord voxel, bool staged_first) const noexcept {
  if (staged_first) {
    if (const Block* const block = staged_->find(block_of(voxel)); block != nullptr)
      return staged_->query(*block, voxel);
  }
  return map_->query(voxel);
}

}  // namespace tessera
