// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/frame_moves.hpp"

#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

Result<FrameMoves> FrameMoves::make(Arena& arena, std::uint32_t contributions,
                                    const RobotPlaces& places) noexcept {
  FrameMoves made;
  made.moves_ = arena.take<Move>(contributions);
  made.places_ = places;
  if (made.moves_.empty()) return Status::kResourceExhausted;
  return made;
}

void FrameMoves::open(Replicas& replicas, Slot slot, const GridTransform& T_world_local) noexcept {
  replicas.set_frame(slot, T_world_local, 0);
  if (!places_.used()) return;
  const ContributionId& id = replicas.contribution(slot).id;
  const RobotPlaces::Place* const place = places_.find(id.robot);
  const RobotPlaces::Placed now = places_.placed(places_.now(place), id, T_world_local);
  replicas.set_place(slot, now.T_global_local, now.hidden, now.place);
  if (phase_ != Phase::kMarking || place == nullptr || !place->moves()) return;
  // It has no block yet, and those that come are marked as they do.
  Move& move = moves_[slot];
  move.to = places_.placed(place->to, id, T_world_local);
  move.to_world = T_world_local;
  move.under_way = true;
}

Replicas::Change FrameMoves::set_frame(const Replicas& replicas, Slot slot,
                                       const GridTransform& T_world_local, std::uint32_t revision,
                                       const MapSession& session) noexcept {
  if (!replicas.contribution(slot).present) return Replicas::Change::kStale;
  Move& move = moves_[slot];
  std::uint32_t known = replicas.contribution(slot).frame_revision;
  if (move.under_way) known = move.revision;
  if (move.waits) known = move.next_revision;
  if (revision <= known || move.leaves) return Replicas::Change::kStale;
  move.next = T_world_local;
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

/// moves: what arrives is part of a move that is under way.
bool FrameMoves::mark_change(const Replicas& replicas, GlobalRecords& records, Slot slot,
                             BlockKey key, bool moves) const noexcept {
  const Move& move = moves_[slot];
  const Replicas::Contribution& contribution = replicas.contribution(slot);
  // While its move is marked, wherever it is and wherever it will be. Once that is done the move
  // does not wait for what arrives, which would put it off for as long as something does.
  const bool marking = moves && phase_ == Phase::kMarking;
  const UpdatePart part = marking ? UpdatePart::kMove
                          : moves ? UpdatePart::kMovedUpdate
                                  : UpdatePart::kUpdate;
  const BlockCoord local = unpack(key);
  if (!contribution.hidden &&
      !records.mark_sums(contribution.T_global_local.global_blocks(local), part))
    return false;
  return !marking || !move.under_way || move.to.hidden ||
         records.mark_sums(move.to.T_global_local.global_blocks(local), part);
}

void FrameMoves::mark_change(const Replicas& replicas, GlobalRecords& records, Slot objections,
                             const Objection& objection) const noexcept {
  // Where a robot gets a place, what it objects to is as the rest of it: shown with the move.
  const bool moves = places_.used() && moves_[objections].under_way;
  if (replicas.contribution(objections).hidden && !moves) return;
  const Result<Slot> against = replicas.find(objection.against);
  if (against.ok())
    static_cast<void>(mark_change(replicas, records, *against, objection.key,
                                  moves || moves_[*against].under_way));
}

void FrameMoves::begin(Replicas& replicas) noexcept {
  if (phase_ != Phase::kSettled || (waiting_ == 0 && !places_.waits())) return;
  places_.begin();
  bool any = false;
  const RobotPlaces::Place* place = nullptr;
  std::uint64_t robot = ~std::uint64_t{0};
  for (const Slot slot : replicas.in_order()) {
    const std::uint32_t next_robot = replicas.contribution(slot).id.robot;
    if (robot != next_robot) place = places_.find(next_robot);
    robot = next_robot;
    any = begin(replicas, slot, place) || any;
  }
  waiting_ = 0;
  if (!any) return places_.settle();
  marked_slot_ = 0;
  marking_slot_ = false;
  has_hidden_ = false;
  phase_ = Phase::kMarking;
}

/// False: it does not move.
bool FrameMoves::begin(Replicas& replicas, Slot slot, const RobotPlaces::Place* place) noexcept {
  Move& move = moves_[slot];
  const bool waits = move.waits;
  if (!waits && (place == nullptr || !place->moves())) return false;
  const Replicas::Contribution& one = replicas.contribution(slot);
  move.to_world = waits ? move.next : one.T_world_local;
  move.to_session = waits ? move.next_session : one.session;
  move.revision = waits ? move.next_revision : one.frame_revision;
  move.to = places_.placed(places_.to(place), one.id, move.to_world);
  move.waits = false;
  if (!move.leaves && one.hidden && move.to.hidden) {
    put_in_force(replicas, slot);
    return false;
  }
  move.under_way =
      waits || one.hidden != move.to.hidden || one.T_global_local != move.to.T_global_local;
  return move.under_way;
}

void FrameMoves::put_in_force(Replicas& replicas, Slot slot) noexcept {
  const Move& move = moves_[slot];
  replicas.set_frame(slot, move.to_world, move.revision, move.to_session);
  replicas.set_place(slot, move.to.T_global_local, move.to.hidden, move.to.place);
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
    const bool will_be = !move.leaves && !move.to.hidden;
    const bool marks = move.under_way && (!contribution.hidden || will_be);
    if (!marking_slot_) marked_record_ = marks ? contribution.first_block : 0;
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
    } else if (has_blocks(contribution.id)) {
      if (!contribution.hidden)
        static_cast<void>(
            records.mark_sums(contribution.T_global_local.global_blocks(local), UpdatePart::kMove));
      if (will_be)
        static_cast<void>(
            records.mark_sums(move.to.T_global_local.global_blocks(local), UpdatePart::kMove));
    }
    marked_record_ = replica.next;
    if (marked_record_ == 0) ++marked_slot_;
    marking_slot_ = marked_record_ != 0;
    work += kWorkOfBlock;
  }
  if (marked_slot_ == moves_.size()) end_marking(replicas);
  return work;
}

/// What was marked is in force.
void FrameMoves::end_marking(Replicas& replicas) noexcept {
  for (Slot slot = 0; slot < moves_.size(); ++slot) {
    const Move& move = moves_[slot];
    if (!move.under_way) continue;
    if (move.leaves) {
      replicas.set_leaving(slot);
      continue;
    }
    has_hidden_ = has_hidden_ || (!replicas.contribution(slot).hidden && move.to.hidden);
    put_in_force(replicas, slot);
  }
  places_.settle();
  phase_ = Phase::kStaging;
}

/// What it is against, wherever that is and wherever it will be.
void FrameMoves::mark_objection(const Replicas& replicas, GlobalRecords& records,
                                const Replicas::Replica& record) const noexcept {
  Objection objection;
  if (!read_objection(replicas, &record, objection)) return;
  const Result<Slot> against = replicas.find(objection.against);
  if (!against.ok()) return;
  const BlockCoord local = unpack(objection.key);
  const Replicas::Contribution& there = replicas.contribution(*against);
  if (!there.hidden)
    static_cast<void>(
        records.mark_sums(there.T_global_local.global_blocks(local), UpdatePart::kMove));
  const Move& move = moves_[*against];
  if (move.under_way && !move.to.hidden)
    static_cast<void>(
        records.mark_sums(move.to.T_global_local.global_blocks(local), UpdatePart::kMove));
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
