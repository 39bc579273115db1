// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/internal/eviction_queue.hpp"

#include "tessera/base/assert.hpp"

namespace tessera {

Result<EvictionQueue*> EvictionQueue::make(Arena& arena, std::size_t blocks) noexcept {
  const std::span<EvictionQueue> place = arena.take<EvictionQueue>(1);
  if (place.empty()) return Status::kResourceExhausted;
  EvictionQueue& queue = place.front();
  queue.requests_ = arena.take<Request>(kRequests);
  queue.leaving_ = arena.take<LeavingBlock>(kRequests);
  queue.answers_ = arena.take<LeavingBlock>(kRequests);
  queue.notes_ = arena.take<Note>(kNotes);
  queue.returned_ = arena.take<BlockKey>(kNotes);
  // Blocks that have returned keep their place until the next tick.
  const Result<KeyIndex> away = KeyIndex::make(arena, blocks + kNotes);
  if (queue.returned_.empty() || !away.ok()) return Status::kResourceExhausted;
  queue.away_ = *away;
  queue.most_archived_ = blocks;
  return &queue;
}

void EvictionQueue::begin_step() noexcept {
  ++step_;
  const std::uint32_t written = answers_written_.load(std::memory_order_acquire);
  std::uint32_t taken = answers_taken_.load(std::memory_order_relaxed);
  for (; taken != written; ++taken) {
    const LeavingBlock& answer = answers_[taken % kRequests];
    Request& request = requests_[place_of(answer.key)];
    if (request.step != 0 && request.key == answer.key) request.stamp = answer.stamp;
  }
  answers_taken_.store(taken, std::memory_order_release);
}

EvictionQueue::Answer EvictionQueue::answer_to(BlockKey key, std::uint64_t stamp) const noexcept {
  const Request& request = requests_[place_of(key)];
  if (request.step == 0 || request.key != key) return Answer::kNone;
  if (request.stamp == stamp) return Answer::kPublished;
  return request.stamp == (stamp | 1U) ? Answer::kNotWhole : Answer::kNone;
}

void EvictionQueue::ask(BlockKey key, std::uint64_t stamp) noexcept {
  Request& request = requests_[place_of(key)];
  const bool is_its = request.step != 0 && request.key == key;
  const bool is_free = request.step == 0 || step_ - request.step > kForgotten;
  if (!is_its && !is_free) return;
  const bool waits = is_its && request.stamp == 0 && step_ - request.asked < kAgain;
  if (is_its) request.step = step_;
  if (waits || (is_its && request.stamp == stamp) || !has_room()) return;
  request = {.key = key, .step = step_, .asked = step_};
  push({key, Kind::kAsks});
}

bool EvictionQueue::has_room() const noexcept {
  const std::uint32_t taken = notes_taken_.load(std::memory_order_acquire);
  return notes_written_.load(std::memory_order_relaxed) - taken < kNotes;
}

void EvictionQueue::push(const Note& note) noexcept {
  TESSERA_ASSERT(has_room());
  const std::uint32_t written = notes_written_.load(std::memory_order_relaxed);
  notes_[written % kNotes] = note;
  notes_written_.store(written + 1, std::memory_order_release);
}

void EvictionQueue::note_archived(BlockKey key, bool is_new, bool is_published) noexcept {
  archived_ += is_new ? 1U : 0U;
  Request& request = requests_[place_of(key)];
  if (request.step != 0 && request.key == key) request = {};
  push({key, is_published ? Kind::kArchived : Kind::kArchivedUnpublished});
}

void EvictionQueue::note_reloaded(BlockKey key) noexcept {
  archived_ -= archived_ != 0 ? 1U : 0U;
  push({key, Kind::kReloaded});
}

bool EvictionQueue::note_cleared() noexcept {
  if (!has_room()) return false;
  for (Request& request : requests_) request = {};
  archived_ = 0;
  push({{}, Kind::kCleared});
  return true;
}

bool EvictionQueue::list(BlockKey key) noexcept {
  if (!may_archive() || away_.insert(key, kAwayUnpublished) != Status::kOk) return false;
  ++archived_;
  ++unpublished_;
  return true;
}

void EvictionQueue::take_notes() noexcept {
  const std::uint32_t written = notes_written_.load(std::memory_order_acquire);
  std::uint32_t taken = notes_taken_.load(std::memory_order_relaxed);
  for (; taken != written; ++taken) take(notes_[taken % kNotes]);
  notes_taken_.store(taken, std::memory_order_release);
}

void EvictionQueue::take(const Note& note) noexcept {
  switch (note.kind) {
    case Kind::kAsks:
      // It asks again, should there be no room.
      if (leaving_count_ < leaving_.size()) leaving_[leaving_count_++] = {.key = note.key};
      return;
    case Kind::kArchived:
      return take_archived(note.key, kAway);
    case Kind::kArchivedUnpublished:
      return take_archived(note.key, kAwayUnpublished);
    case Kind::kReloaded:
      return take_reloaded(note.key);
    case Kind::kCleared:
      return take_cleared();
  }
}

/// What others have of archived blocks is wrong from now on.
void EvictionQueue::take_cleared() noexcept {
  leaving_count_ = returned_count_ = 0;
  unpublished_ = 0;
  away_.for_each([this](BlockKey key, std::uint32_t) { away_.assign(key, kWithdrawn); });
  withdrawn_ = away_.size();
}

void EvictionQueue::begin_epoch() noexcept {
  unpublished_ = 0;
  away_.for_each([this](BlockKey key, std::uint32_t value) {
    if (value != kAway && value != kAwayUnpublished) return;
    away_.assign(key, kAwayUnpublished);
    ++unpublished_;
  });
}

/// In the memory of those that have returned, of which there are none.
std::span<const BlockKey> EvictionQueue::some_withdrawn() noexcept {
  if (withdrawn_ == 0) return {};
  std::size_t count = 0;
  away_.for_some(withdrawn_place_, kWithdrawnBuckets, [&](BlockKey key, std::uint32_t value) {
    if (value == kWithdrawn) returned_[count++] = key;
  });
  return returned_.first(count);
}

/// Of a block that was archived unpublished, and is again, others lack something still.
void EvictionQueue::take_archived(BlockKey key, std::uint32_t value) noexcept {
  const std::optional<std::uint32_t> before = away_.find(key);
  if (before == kAwayUnpublished) return;
  if (before == kWithdrawn) --withdrawn_;
  if (value == kAwayUnpublished) ++unpublished_;
  if (before) {
    away_.assign(key, value);
  } else if (away_.insert(key, value) != Status::kOk) {
    ++unlisted_;
  }
}

/// It counts as away until the next tick, as this one may have read the map before it returned.
void EvictionQueue::take_reloaded(BlockKey key) noexcept {
  const std::optional<std::uint32_t> before = away_.find(key);
  if (!before || before == kReturned || before == kWithdrawn) return;
  if (before == kAwayUnpublished) --unpublished_;
  if (returned_count_ == returned_.size()) return;  // it stays away: more than a ring in a tick
  away_.assign(key, kReturned);
  returned_[returned_count_++] = key;
}

/// What finds no room among the answers is answered after the next tick.
void EvictionQueue::answer() noexcept {
  std::size_t kept = 0;
  for (const LeavingBlock& block : leaving_.first(leaving_count_)) {
    if (block.stamp == 0 || !push_answer(block)) leaving_[kept++] = block;
  }
  leaving_count_ = kept;
}

bool EvictionQueue::push_answer(const LeavingBlock& block) noexcept {
  const std::uint32_t written = answers_written_.load(std::memory_order_relaxed);
  if (written - answers_taken_.load(std::memory_order_acquire) == kRequests) return false;
  answers_[written % kRequests] = block;
  answers_written_.store(written + 1, std::memory_order_release);
  return true;
}

}  // namespace tessera
