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
  made.notes_ = arena.take<Note>(replicas.blocks);
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
  has_begun_ = false;
  if (scratch_ == nullptr) return Status::kResourceExhausted;
  scratch_->lost = false;
  scratch_->newest_version = scratch_->blocks_taken = scratch_->blocks_gone = 0;
  if (slot >= replicas.config().contributions) return Status::kInvalidArgument;
  const Replicas::Contribution& contribution = replicas.contribution(slot);
  if (!contribution.present || contribution.leaving || !has_blocks(contribution.id))
    return Status::kInvalidArgument;
  if (replicas.config().blocks > notes_.size()) return Status::kResourceExhausted;
  if (replicas_ != &replicas || slot_ != slot || id_ != contribution.id) scratch_->owner = {};
  const bool goes_on = scratch_->owner.source != nullptr;
  for (Note& note : notes_.first(scratch_->noted)) {
    if (!goes_on) note = {};
    note.marks = static_cast<std::uint8_t>(note.marks & ~(Note::kThere | Note::kChanged));
  }
  if (!goes_on) scratch_->noted = 0;
  replicas_ = &replicas;
  slot_ = slot;
  id_ = contribution.id;
  for (std::uint32_t number = contribution.first_block; number != 0;) {
    const Replicas::Replica& part = replicas.record(number);
    note_part(part);
    number = part.next;
  }
  note_parts_gone();
  scratch_->end = scratch_->noted;
  has_begun_ = true;
  return Status::kOk;
}

void ReplicaSketchSource::note_part(const Replicas::Replica& part) noexcept {
  const std::uint32_t number = replicas_->number_of(part);
  scratch_->noted = std::max<std::size_t>(scratch_->noted, number);
  Note& note = notes_[number - 1];
  // Parts of one block have its key: it is that of the first.
  const bool is_first = replicas_->find(slot_, BlockKey{part.key}) == &part;
  if (!is_first && note.has(Note::kFirst)) return;  // it is taken anew, by another part
  unsigned marks = note.marks | Note::kThere;
  if (is_first && !is_as_taken(part)) marks |= Note::kChanged;
  note.marks = static_cast<std::uint8_t>(marks);
  if (!note.has(Note::kTaken)) note.key = part.key;
}

/// A block that went and came back may have its first part where it was, and others not yet. Its
/// first part is noted as of no version until it is taken again.
void ReplicaSketchSource::note_parts_gone() const noexcept {
  for (std::size_t at = 0; at < scratch_->noted; ++at) {
    Note& note = notes_[at];
    if (!note.has(Note::kTaken) || note.has(Note::kFirst)) continue;
    const bool is_there = note.has(Note::kThere);
    const std::uint64_t key =
        is_there ? replicas_->record(static_cast<std::uint32_t>(at) + 1).key : 0;
    if (is_there && key == note.key) continue;
    if (const Replicas::Replica* const first = replicas_->find(slot_, BlockKey{note.key});
        first != nullptr) {
      Note& of_first = notes_[replicas_->number_of(*first) - 1];
      of_first.version = 0;
      of_first.marks = static_cast<std::uint8_t>(of_first.marks | Note::kChanged);
    }
    note = {.key = key,
            .marks = static_cast<std::uint8_t>(note.marks & (Note::kThere | Note::kChanged))};
  }
}

bool ReplicaSketchSource::is_as_taken(const Replicas::Replica& first) const noexcept {
  if (!notes_[replicas_->number_of(first) - 1].has(Note::kFirst)) return false;
  for (const Replicas::Replica* part = &first; part != nullptr; part = replicas_->next_part(*part))
    if (!notes_[replicas_->number_of(*part) - 1].is_of(*part)) return false;
  return true;
}

SketchSource ReplicaSketchSource::source() const noexcept {
  return {this, scratch_ == nullptr ? 0.0 : scratch_->map.lattice().resolution_m(), take, true};
}

bool ReplicaSketchSource::is_there() const noexcept {
  const Replicas::Contribution& contribution = replicas_->contribution(slot_);
  return contribution.present && !contribution.leaving && contribution.id == id_;
}

bool ReplicaSketchSource::goes_on(const MapSketch& sketch) const noexcept {
  return scratch_->owner.source != nullptr && sketch.owner() == scratch_->owner;
}

/// From nothing: all that is there is to be taken.
void ReplicaSketchSource::begin_sketch(MapSketch& sketch) const noexcept {
  sketch.begin(scratch_->map.lattice().resolution_m());
  for (std::size_t at = 0; at < scratch_->noted; ++at) {
    Note& note = notes_[at];
    if (!note.has(Note::kThere)) {
      note = {};
      continue;
    }
    const Replicas::Replica& part = replicas_->record(static_cast<std::uint32_t>(at) + 1);
    const bool was_taken = note.has(Note::kTaken);
    const std::uint64_t key = was_taken ? part.key : note.key;
    const bool is_first =
        was_taken ? replicas_->find(slot_, BlockKey{key}) == &part : note.has(Note::kChanged);
    note = {.key = key};
    note.marks = static_cast<std::uint8_t>(Note::kThere | (is_first ? Note::kChanged : 0U));
  }
}

bool ReplicaSketchSource::take(const void* context, SketchSource::Cursor& cursor,
                               MapSketch& sketch) noexcept {
  const auto& self = *static_cast<const ReplicaSketchSource*>(context);
  if (self.scratch_ == nullptr) return true;
  Scratch& scratch = *self.scratch_;
  if (!self.has_begun_) {
    sketch.begin(scratch.map.lattice().resolution_m());
    return true;
  }
  scratch.lost = scratch.lost || !self.is_there();
  if (cursor.taken == 0) {
    const bool goes_on = !scratch.lost && self.goes_on(sketch);
    scratch.owner = {};
    scratch.is_whole = true;
    if (!goes_on) {
      self.begin_sketch(sketch);
      cursor.taken = scratch.end;
    }
  }
  if (scratch.lost) return true;
  if (cursor.taken < scratch.end) {
    self.forget_some(cursor.taken, sketch);
    if (cursor.taken == scratch.end) sketch.drop_forgotten();
    return false;
  }
  std::size_t at = cursor.taken - scratch.end;
  self.take_some(at, sketch);
  cursor.taken = scratch.end + at;
  if (at < scratch.end) return false;
  if (sketch.is_too_thin()) {
    self.begin_sketch(sketch);
    cursor.taken = scratch.end;
    return false;
  }
  if (scratch.is_whole) scratch.owner = {&scratch, ++scratch.turns};
  sketch.set_owner(scratch.owner);
  return true;
}

void ReplicaSketchSource::forget_some(std::size_t& at, MapSketch& sketch) const noexcept {
  const std::size_t end = std::min(at + kMostPassed, scratch_->end);
  for (std::size_t forgotten = 0; at < end && forgotten < kMostForgotten; ++at) {
    Note& note = notes_[at];
    const bool is_to_be_taken = note.has(Note::kChanged);
    if (note.has(Note::kThere) && !is_to_be_taken) continue;
    if (note.has(Note::kFirst)) {
      sketch.forget(BlockKey{note.key}, note.cells);
      ++forgotten;
    }
    if (!is_to_be_taken) {
      note = {};
      continue;
    }
    if (note.has(Note::kTaken)) {
      const Replicas::Replica& part = replicas_->record(static_cast<std::uint32_t>(at) + 1);
      note.key = part.key;
      if (replicas_->find(slot_, BlockKey{part.key}) != &part) {  // another's by now
        scratch_->is_whole = false;
        note = {};
        continue;
      }
    }
    note.marks = static_cast<std::uint8_t>(Note::kThere | Note::kChanged);
  }
}

void ReplicaSketchSource::take_some(std::size_t& at, MapSketch& sketch) const noexcept {
  const std::size_t end = std::min(at + kMostPassed, scratch_->end);
  std::size_t bytes = 0;
  for (std::size_t blocks = 0; at < end && blocks < kBlocks && bytes < kMostBytes; ++at) {
    if (notes_[at].has(Note::kThere | Note::kChanged)) {
      bytes += add_block(BlockKey{notes_[at].key}, sketch);
      ++blocks;
    }
    const Note& note = notes_[at];
    if (note.has(Note::kTaken) && (note.marks & Note::kLive) != 0)
      scratch_->newest_version = std::max(scratch_->newest_version, note.version);
  }
}

std::size_t ReplicaSketchSource::note_taken(const Replicas::Replica& first) const noexcept {
  Scratch& scratch = *scratch_;
  std::size_t bytes = 0;
  for (const Replicas::Replica* part = &first; part != nullptr;
       part = replicas_->next_part(*part)) {
    bytes += part->bytes;
    if (part->live != 0) scratch.newest_version = std::max(scratch.newest_version, part->version);
    const std::size_t at = replicas_->number_of(*part) - 1;
    Note& note = notes_[at];
    scratch.noted = std::max(scratch.noted, at + 1);
    // The record may have come to be of this block while the sketch was taken: the other one's note
    // is lost, or, if it waits, stays, as it may have come back elsewhere.
    const bool is_other = note.key != part->key;
    const bool waits = is_other && note.has(Note::kChanged) && !note.has(Note::kTaken);
    if (waits || (is_other && note.has(Note::kTaken))) scratch.is_whole = false;
    if (waits) continue;
    const unsigned kept = is_other ? 0U : note.marks & (Note::kThere | Note::kChanged);
    const unsigned marks = kept | part->live | Note::kTaken | (part == &first ? Note::kFirst : 0U);
    note = {.key = part->key,
            .version = part->version,
            .marks = static_cast<std::uint8_t>(marks),
            .hash = static_cast<std::uint8_t>(part->hash.low)};
  }
  return bytes;
}

std::size_t ReplicaSketchSource::add_block(BlockKey key, MapSketch& sketch) const noexcept {
  Scratch& scratch = *scratch_;
  const Replicas::Replica* const first = replicas_->find(slot_, key);
  if (first == nullptr) {
    ++scratch.blocks_gone;
    return 0;
  }
  ++scratch.blocks_taken;
  const std::size_t bytes = note_taken(*first);
  scratch.content.clear();
  if (!replicas_->read_block(first, scratch.packed, scratch.content)) return bytes;
  const Result<SlabHandle> block = scratch.map.open_block(unpack(key));
  if (!block.ok()) return bytes;  // A key outside the grid: no map has such a block.
  const Status status = scratch.map.replace(*block, scratch.content);
  TESSERA_ASSERT(status == Status::kOk);
  static_cast<void>(status);
  const MapSketch::BlockCells cells = sketch.add(scratch.map, *block);
  notes_[replicas_->number_of(*first) - 1].cells = cells;
  scratch.map.remove_block(*block);
  return bytes;
}

}  // namespace tessera
