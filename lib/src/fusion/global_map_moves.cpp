// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Contributions that move or leave: the map is as before until all that this changes is ready.
#include "tessera/fusion/global_map.hpp"

namespace tessera {

Replicas::Change GlobalMap::set_frame(Slot slot, const GridTransform& T_global_local,
                                      std::uint32_t revision) noexcept {
  if (!replicas_.contribution(slot).present) return Replicas::Change::kStale;
  Move& move = moves_[slot];
  std::uint32_t known = replicas_.contribution(slot).frame_revision;
  if (move.under_way) known = move.revision;
  if (move.waits) known = move.next_revision;
  if (revision <= known || move.leaves) return Replicas::Change::kStale;
  move.next = T_global_local;
  move.next_revision = revision;
  moves_waiting_ += move.waits ? 0U : 1U;
  move.waits = true;
  return Replicas::Change::kTaken;
}

void GlobalMap::remove(Slot slot) noexcept {
  Move& move = moves_[slot];
  if (move.leaves || !replicas_.contribution(slot).present) return;
  move.leaves = true;
  // A move that is only being marked becomes this one.
  if (move.under_way && phase_ == Phase::kMarking) return;
  moves_waiting_ += move.waits ? 0U : 1U;
  move.waits = true;
}

void GlobalMap::remove_before(std::uint32_t robot, std::uint32_t epoch) noexcept {
  for (const Slot slot : replicas_.in_order()) {
    const ContributionId& id = replicas_.contribution(slot).id;
    if (id.robot == robot && id.epoch < epoch) remove(slot);
  }
}

/// All that wait go together.
void GlobalMap::begin_moves() noexcept {
  for (Move& move : moves_) {
    if (!move.waits) continue;
    move.to = move.next;
    move.revision = move.next_revision;
    move.waits = false;
    move.under_way = true;
  }
  moves_waiting_ = 0;
  marked_slot_ = 0;
  marking_slot_ = false;
  phase_ = Phase::kMarking;
}

/// Marks where each block of what moves is and will be; then the frames are in force.
std::uint64_t GlobalMap::mark_moves(std::uint64_t budget) noexcept {
  constexpr std::uint64_t kWorkOfBlock = 54;  // 27 look-ups before, 27 after
  std::uint64_t work = 0;
  while (work < budget) {
    ++work;
    if (marked_slot_ == moves_.size()) break;
    const Move& move = moves_[marked_slot_];
    const Replicas::Contribution& contribution = replicas_.contribution(marked_slot_);
    if (!marking_slot_) marked_record_ = move.under_way ? contribution.first_block : 0;
    marking_slot_ = marked_record_ != 0;
    if (!marking_slot_) {
      ++marked_slot_;
      continue;
    }
    const Replicas::Replica& replica = replicas_.record(marked_record_);
    const BlockCoord local = unpack(BlockKey{replica.key});
    // Where there is no place for a block, that was counted, and what has a place goes on.
    static_cast<void>(open_records(contribution.T_global_local, local, Part::kMove));
    if (!move.leaves) static_cast<void>(open_records(move.to, local, Part::kMove));
    marked_record_ = replica.next;
    if (marked_record_ == 0) ++marked_slot_;
    marking_slot_ = marked_record_ != 0;
    work += kWorkOfBlock;
  }
  if (marked_slot_ != moves_.size()) return work;
  for (Slot slot = 0; slot < moves_.size(); ++slot) {
    const Move& move = moves_[slot];
    if (!move.under_way) continue;
    move.leaves ? replicas_.set_leaving(slot) : replicas_.set_frame(slot, move.to, move.revision);
  }
  phase_ = Phase::kStaging;
  return work;
}

void GlobalMap::set_part(Record& record, Part part) noexcept {
  if (part == Part::kUpdate) return;
  record.hidden = true;
  if (part != Part::kMove) return;
  records_moving_ += record.moving ? 0U : 1U;
  record.moving = true;
}

GlobalMap::Part GlobalMap::part_of(const Record& record) noexcept {
  if (record.moving) return Part::kMove;
  return record.hidden ? Part::kMovedUpdate : Part::kUpdate;
}

void GlobalMap::moved(Record& record) noexcept {
  records_moving_ -= record.moving ? 1U : 0U;
  record.moving = false;
}

/// All that was staged is the map from now on.
void GlobalMap::show_moves() noexcept {
  phase_ = Phase::kMerging;
  store_shared(view_, view_ + 3, std::memory_order_release);
  for (Move& move : moves_) move.under_way = false;
}

/// Content that is staged stays there if it is nothing: it hides what the map has. False iff there
/// is no room.
bool GlobalMap::stage_content(BlockCoord block) noexcept {
  const Result<SlabHandle> handle = staged_->open_block(block);
  if (!handle.ok()) return false;
  if (staged_->replace(*handle, content_) == Status::kOk) return true;
  staged_->close_if_empty(*handle);
  return false;
}

void GlobalMap::show_content(BlockCoord block) noexcept {
  if (!content_.any()) {
    if (const SlabHandle handle = map_->find_handle(block); handle != 0) map_->remove_block(handle);
    return;
  }
  const Result<SlabHandle> handle = map_->open_block(block);
  if (!handle.ok() || map_->replace(*handle, content_) != Status::kOk) ++counted_.refused_outputs;
  if (handle.ok()) map_->close_if_empty(*handle);
}

void GlobalMap::write_content(Record& record) noexcept {
  const BlockCoord block = unpack(BlockKey{record.key});
  scale_to_passes();
  const SlabHandle staged = staged_->find_handle(block);
  if (phase_ != Phase::kStaging && phase_ != Phase::kMarking) record.hidden = false;
  if (phase_ == Phase::kStaging && (record.hidden || staged != 0)) {
    if (stage_content(block)) return;
    ++counted_.torn_blocks;
  }
  show_content(block);
  if (phase_ == Phase::kMerging && staged != 0) staged_->remove_block(staged);
}

/// However small the budget, the cursor goes on, or a block of each that leaves is dropped.
std::uint64_t GlobalMap::merge_staged(std::uint64_t budget) noexcept {
  std::uint64_t work = 1;
  while (staged_->block_count() != 0) {
    work += staged_->visit_blocks(
        merged_, BlockIndex::kBucketSlots, [&](BlockKey key, SlabHandle handle) {
          content_.clear();
          add_block(*staged_, staged_->block_at(handle), content_);
          show_content(unpack(key));
          staged_->remove_block(handle);
          work += kBlockVoxels +
                  kBlockVoxels * static_cast<std::uint64_t>(count_ones(content_.components()));
          return true;
        });
    if (work >= budget) break;
  }
  if (staged_->block_count() != 0) return work;
  if (view_ % 2 != 0) store_shared(view_, view_ - 1, std::memory_order_release);
  bool leaving = false;
  for (Slot slot = 0; slot < moves_.size(); ++slot) {
    if (!replicas_.contribution(slot).leaving) continue;
    work += drop_replicas(slot, work < budget ? budget - work : 1);
    leaving = leaving || replicas_.contribution(slot).leaving;
  }
  if (!leaving) phase_ = Phase::kSettled;
  return work;
}

std::uint64_t GlobalMap::drop_replicas(Slot slot, std::uint64_t budget) noexcept {
  std::uint64_t work = 0;
  for (; replicas_.contribution(slot).first_block != 0 && work < budget; work += kBlockOctets)
    replicas_.drop(replicas_.contribution(slot).first_block);
  if (replicas_.contribution(slot).first_block != 0) return work;
  replicas_.close(slot);
  moves_waiting_ -= moves_[slot].waits ? 1U : 0U;
  moves_[slot] = {};
  return work + 1;
}

Estimate GlobalMap::query(VoxelCoord voxel) const noexcept {
  if (phase_ == Phase::kMerging) {
    if (const Block* const block = staged_->find(block_of(voxel)); block != nullptr)
      return staged_->query(*block, voxel);
  }
  return map_->query(voxel);
}

}  // namespace tessera
