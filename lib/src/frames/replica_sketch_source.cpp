// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/replica_sketch_source.hpp"

#include <algorithm>

#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

Result<ReplicaSketchSource> ReplicaSketchSource::make(Arena& arena, const MapConfig& map,
                                                      const ClassTable& classes,
                                                      const ReplicasConfig& replicas) noexcept {
  const int num_components = classes.num_components();
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes(map, num_components, replicas))
    return Status::kResourceExhausted;
  ReplicaSketchSource made;
  made.keys_ = arena.take<std::uint64_t>(replicas.blocks);
  made.scratch_ = arena.take<Scratch>(1).data();
  Scratch& scratch = *made.scratch_;
  const Status status =
      LocalMap::make_at(scratch.map, arena, scratch_map(map, num_components), classes);
  if (status != Status::kOk) return status;
  scratch.content = *BlockContent::make(arena, num_components);
  scratch.packed = arena.take<std::byte>(most_packed_bytes(num_components));
  return made;
}

Status ReplicaSketchSource::begin(const Replicas& replicas, Replicas::Slot slot) noexcept {
  key_count_ = 0;
  if (scratch_ == nullptr) return Status::kResourceExhausted;
  scratch_->lost = false;
  scratch_->newest_version = scratch_->blocks_taken = scratch_->blocks_gone = 0;
  if (slot >= replicas.config().contributions) return Status::kInvalidArgument;
  const Replicas::Contribution& contribution = replicas.contribution(slot);
  if (!contribution.present || contribution.leaving || !has_blocks(contribution.id))
    return Status::kInvalidArgument;
  if (contribution.blocks > keys_.size()) return Status::kResourceExhausted;
  replicas_ = &replicas;
  slot_ = slot;
  id_ = contribution.id;
  for (std::uint32_t number = contribution.first_block; number != 0;) {
    const Replicas::Replica& part = replicas.record(number);
    // Parts of one block have its key: it is that of the first.
    if (replicas.find(slot, BlockKey{part.key}) == &part) keys_[key_count_++] = part.key;
    number = part.next;
  }
  return Status::kOk;
}

SketchSource ReplicaSketchSource::source() const noexcept {
  return {this, scratch_ == nullptr ? 0.0 : scratch_->map.lattice().resolution_m(), take};
}

bool ReplicaSketchSource::is_there() const noexcept {
  const Replicas::Contribution& contribution = replicas_->contribution(slot_);
  return contribution.present && !contribution.leaving && contribution.id == id_;
}

bool ReplicaSketchSource::take(const void* context, SketchSource::Cursor& cursor,
                               MapSketch& sketch) noexcept {
  const auto& self = *static_cast<const ReplicaSketchSource*>(context);
  if (self.key_count_ == 0) return true;
  self.scratch_->lost = self.scratch_->lost || !self.is_there();
  if (self.scratch_->lost) return true;
  const std::size_t end = std::min(cursor.taken + kBlocks, self.key_count_);
  for (std::size_t bytes = 0; cursor.taken < end && bytes < kMostBytes; ++cursor.taken)
    bytes += self.add_block(BlockKey{self.keys_[cursor.taken]}, sketch);
  return cursor.taken == self.key_count_;
}

std::size_t ReplicaSketchSource::add_block(BlockKey key, MapSketch& sketch) const noexcept {
  Scratch& scratch = *scratch_;
  const Replicas::Replica* const first = replicas_->find(slot_, key);
  if (first == nullptr) {
    ++scratch.blocks_gone;
    return 0;
  }
  ++scratch.blocks_taken;
  std::size_t bytes = 0;
  for (const Replicas::Replica* part = first; part != nullptr; part = replicas_->next_part(*part)) {
    bytes += part->bytes;
    if (part->live != 0) scratch.newest_version = std::max(scratch.newest_version, part->version);
  }
  scratch.content.clear();
  if (!replicas_->read_block(first, scratch.packed, scratch.content)) return bytes;
  const Result<SlabHandle> block = scratch.map.open_block(unpack(key));
  if (!block.ok()) return bytes;  // A key outside the grid: no map has such a block.
  const Status status = scratch.map.replace(*block, scratch.content);
  TESSERA_ASSERT(status == Status::kOk);
  static_cast<void>(status);
  sketch.add(scratch.map, *block);
  scratch.map.remove_block(*block);
  return bytes;
}

}  // namespace tessera
