// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/frame_moves.hpp"

namespace tessera {

Result<FrameMoves> FrameMoves::make(Arena& arena, std::uint32_t contributions) noexcept {
  FrameMoves made;
  made.moves_ = arena.take<Move>(contributions);
  if (made.moves_.empty()) return Status::kResourceExhausted;
  return made;
}

Replicas::Change FrameMoves::set_frame(const Replicas& replicas, Slot slot,
                                       const GridTransform& T_global_local, std::uint32_t revision,
                                       const MapSession& session) noexcept {
  if (!replicas.contribution(slot).present) return Replicas::Change::kStale;
  Move& move = moves_[slot];
  std::uint32_t known = replicas.contribution(slot).frame_revision;
  if (move.under_way) known = move.revision;
  if (move.waits) known = move.next_revision;
  if (revision <= known || move.leaves) return Replicas::Change::kStale;
  move.next = T_global_local;
  move.next_session = session;
  move.next_revision = revision;
  wait(move);
  return Replicas::Change::kTaken;
}

void FrameMoves::remove(const Replicas& replicas, Slot slot) noexcept {
  Move& move = moves_[slot];
  if (move.leaves || !replicas.contribution(slot).present) return;
  move.leaves = true;
  // A move that is only being marked becomes this one.
  if (move.under_way && phase_ == Phase::kMarking) return;
  wait(move);
}

bool FrameMoves::forget(Slot slot) noexcept {
  if (moves_[slot].under_way || moves_[slot].leaves) return false;
  waiting_ -= moves_[slot].waits ? 1U : 0U;
  moves_[slot] = {};
  return true;
}

bool FrameMoves::mark_change(const Replicas& replicas, GlobalRecords& records, Slot slot,
                             BlockKey key) const noexcept {
  const Move& move = moves_[slot];
  // While its move is marked, wherever it is and wherever it will be. Once that is done the move
  // does not wait for what arrives, which would put it off for as long as something does.
  const bool marking = move.under_way && phase_ == Phase::kMarking;
  const UpdatePart part = marking          ? UpdatePart::kMove
                          : move.under_way ? UpdatePart::kMovedUpdate
                                           : UpdatePart::kUpdate;
  const BlockCoord local = unpack(key);
  const GridTransform& T_global_local = replicas.contribution(slot).T_global_local;
  return records.mark_sums(T_global_local.global_blocks(local), part) &&
         (!marking || records.mark_sums(move.to.global_blocks(local), part));
}

void FrameMoves::begin() noexcept {
  if (phase_ != Phase::kSettled || waiting_ == 0) return;
  for (Move& move : moves_) {
    if (!move.waits) continue;
    move.to = move.next;
    move.to_session = move.next_session;
    move.revision = move.next_revision;
    move.waits = false;
    move.under_way = true;
  }
  waiting_ = 0;
  marked_slot_ = 0;
  marking_slot_ = false;
  phase_ = Phase::kMarking;
}

std::uint64_t FrameMoves::mark(Replicas& replicas, GlobalRecords& records,
                               std::uint64_t budget) noexcept {
  constexpr std::uint64_t kWorkOfBlock = 54;  // 27 look-ups before, 27 after
  std::uint64_t work = 0;
  while (work < budget) {
    ++work;
    if (marked_slot_ == moves_.size()) break;
    const Move& move = moves_[marked_slot_];
    const Replicas::Contribution& contribution = replicas.contribution(marked_slot_);
    if (!marking_slot_) marked_record_ = move.under_way ? contribution.first_block : 0;
    marking_slot_ = marked_record_ != 0;
    if (!marking_slot_) {
      ++marked_slot_;
      continue;
    }
    const Replicas::Replica& replica = replicas.record(marked_record_);
    const BlockCoord local = unpack(BlockKey{replica.key});
    // Where there is no place for a block, that was counted, and what has a place goes on.
    if (Objection::is(contribution.id.submap)) {
      mark_objection(replicas, records, replica);
    } else {
      static_cast<void>(
          records.mark_sums(contribution.T_global_local.global_blocks(local), UpdatePart::kMove));
      if (!move.leaves)
        static_cast<void>(records.mark_sums(move.to.global_blocks(local), UpdatePart::kMove));
    }
    marked_record_ = replica.next;
    if (marked_record_ == 0) ++marked_slot_;
    marking_slot_ = marked_record_ != 0;
    work += kWorkOfBlock;
  }
  if (marked_slot_ != moves_.size()) return work;
  for (Slot slot = 0; slot < moves_.size(); ++slot) {
    const Move& move = moves_[slot];
    if (!move.under_way) continue;
    if (move.leaves) {
      replicas.set_leaving(slot);
    } else {
      replicas.set_frame(slot, move.to, move.revision, move.to_session);
    }
  }
  phase_ = Phase::kStaging;
  return work;
}

/// What it is against, wherever that is and wherever it will be.
void FrameMoves::mark_objection(const Replicas& replicas, GlobalRecords& records,
                                const Replicas::Replica& record) const noexcept {
  Objection objection;
  if (!read_objection(replicas, &record, objection)) return;
  const Result<Slot> against = replicas.find(objection.against);
  if (!against.ok()) return;
  const BlockCoord local = unpack(objection.key);
  const GridTransform& frame = replicas.contribution(*against).T_global_local;
  static_cast<void>(records.mark_sums(frame.global_blocks(local), UpdatePart::kMove));
  const Move& move = moves_[*against];
  if (move.under_way)
    static_cast<void>(records.mark_sums(move.to.global_blocks(local), UpdatePart::kMove));
}

void FrameMoves::begin_merging() noexcept {
  phase_ = Phase::kMerging;
  for (Move& move : moves_) move.under_way = false;
}

std::uint64_t FrameMoves::finish(Replicas& replicas, std::uint64_t budget) noexcept {
  std::uint64_t work = 0;
  bool leaving = false;
  for (Slot slot = 0; slot < moves_.size(); ++slot) {
    if (!replicas.contribution(slot).leaving) continue;
    work += drop_replicas(replicas, slot, work < budget ? budget - work : 1);
    leaving = leaving || replicas.contribution(slot).leaving;
  }
  if (!leaving) phase_ = Phase::kSettled;
  return work;
}

std::uint64_t FrameMoves::drop_replicas(Replicas& replicas, Slot slot,
                                        std::uint64_t budget) noexcept {
  std::uint64_t work = 0;
  for (; replicas.contribution(slot).first_block != 0 && work < budget; work += kBlockOctets)
    replicas.drop(replicas.contribution(slot).first_block);
  if (replicas.contribution(slot).first_block != 0) return work;
  replicas.close(slot);
  waiting_ -= moves_[slot].waits ? 1U : 0U;
  moves_[slot] = {};
  return work + 1;
}

}  // namespace tessera
