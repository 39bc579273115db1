// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks on their way out of a map that is shared, between the thread that maps and the one that
// publishes. A block leaves the map once everything in it was published; while it is archived, in
// whole or in part, what was published of it stays. Where memory is short a block leaves at once.
//
// Two rings of fixed size, each from one thread to the other; no locks, and nobody waits: a block
// whose request finds no room stays in the map and asks again.
#pragma once

#include <atomic>
#include <span>

#include "tessera/exchange/publication.hpp"
#include "tessera/grid/internal/key_index.hpp"

namespace tessera {

class EvictionQueue {
 public:
  /// Places of blocks that wait to leave, by the hashes of their keys.
  static constexpr std::size_t kRequests = 4096;
  static constexpr std::size_t kNotes = 16384;  ///< Of the ring to the publishing thread.

  /// blocks: that are archived at once, at most.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::size_t blocks) noexcept {
    return arena_bytes<EvictionQueue>(1) + arena_bytes<Request>(kRequests) +
           2 * arena_bytes<LeavingBlock>(kRequests) + arena_bytes<Note>(kNotes) +
           arena_bytes<BlockKey>(kNotes) + KeyIndex::required_bytes(blocks + kNotes);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<EvictionQueue*> make(Arena& arena, std::size_t blocks) noexcept;
  EvictionQueue() noexcept = default;
  EvictionQueue(const EvictionQueue&) = delete;
  EvictionQueue& operator=(const EvictionQueue&) = delete;
  EvictionQueue(EvictionQueue&&) = delete;
  EvictionQueue& operator=(EvictionQueue&&) = delete;
  ~EvictionQueue() = default;

  // --- For the thread that maps: O(1); begin_step, note_cleared: O(kRequests) --------------------

  /// Takes the answers that have come. To be called before a step of the window.
  void begin_step() noexcept;
  /// What was answered to the request of a block.
  enum class Answer : std::uint8_t { kNone, kPublished, kNotWhole };
  /// kPublished: everything in the block was published. kNotWhole: it cannot be, as a part of it is
  /// archived. stamp: Block::stamp.
  [[nodiscard]] Answer answer_to(BlockKey key, std::uint64_t stamp) const noexcept;
  /// Asks for that, unless it was asked for.
  void ask(BlockKey key, std::uint64_t stamp) noexcept;
  /// A block more can be noted as archived or reloaded.
  [[nodiscard]] bool has_room() const noexcept;
  /// The archive may hold another block.
  [[nodiscard]] bool may_archive() const noexcept { return archived_ < most_archived_; }
  /// The archive holds the block: to be called before the block leaves the map. is_new: it did not
  /// hold a part of it before.
  void note_archived(BlockKey key, bool is_new, bool is_published) noexcept;
  /// All of the block is in the map: to be called after it is.
  void note_reloaded(BlockKey key) noexcept;
  /// Map and archive are empty. False: no room for the note, try again.
  [[nodiscard]] bool note_cleared() noexcept;
  /// Before either thread works with this: the archive holds the block from before. False: no room.
  bool list(BlockKey key) noexcept;

  // --- For the thread that publishes -------------------------------------------------------------

  /// To be called before each tick. returned(key): all of the block is in the map, or nothing of it
  /// is anywhere as the map was cleared, and that may differ from what was published; false: there
  /// is no room to look into it now. O(kNotes).
  template <class Returned>
  void begin_tick(Returned&& returned) noexcept {
    take_notes();
    for (const BlockKey key : returned_.first(returned_count_)) {
      // It may have been archived again since.
      if (away_.find(key) != kReturned) continue;
      away_.erase(key);
      static_cast<void>(returned(key));
    }
    returned_count_ = 0;
    for (const BlockKey key : some_withdrawn()) {
      if (!returned(key)) break;
      away_.erase(key);
      --withdrawn_;
    }
  }
  /// Others have blocks that were archived before the map was cleared.
  [[nodiscard]] bool is_withdrawing() const noexcept { return withdrawn_ != 0; }
  /// Nothing of what is archived was published in the epoch that begins. O(blocks).
  void begin_epoch() noexcept;
  /// Takes the notes that have come. O(kNotes).
  void take_notes() noexcept;
  /// Blocks that ask to leave, for Publisher::tick to settle.
  [[nodiscard]] std::span<LeavingBlock> leaving() noexcept {
    return leaving_.first(leaving_count_);
  }
  /// Answers those that are settled. O(kRequests).
  void answer() noexcept;
  /// Whether a part of the block was archived and not in the map at any time since the tick began.
  /// Exact for what was read of the map between begin_tick and this call: archiving is noted before
  /// a block leaves the map, and what returns counts from the next tick on.
  [[nodiscard]] bool is_away(BlockKey key) noexcept {
    take_notes();
    const std::optional<std::uint32_t> value = away_.find(key);
    return value && *value != kWithdrawn;
  }
  /// Archived blocks of which others do not have all, as they left where memory was short.
  [[nodiscard]] std::uint64_t unpublished() const noexcept { return unpublished_; }
  /// Archived blocks that found no place here, as their keys collide: what was published of them
  /// may be taken back.
  [[nodiscard]] std::uint64_t unlisted() const noexcept { return unlisted_; }

 private:
  enum class Kind : std::uint32_t { kAsks, kArchived, kArchivedUnpublished, kReloaded, kCleared };
  struct Note {
    BlockKey key{};
    Kind kind = Kind::kAsks;
  };
  /// Of a block that wants to leave, by the hash of its key. A block whose place another one has
  /// waits until that has left, or has not wanted to for kForgotten steps.
  struct Request {
    BlockKey key{};
    std::uint64_t stamp = 0;  ///< As it was published; 0: not answered yet.
    std::uint32_t step = 0;   ///< When it last wanted to leave; 0: nobody did.
    std::uint32_t asked = 0;  ///< When that was asked for.
  };
  /// Longer than a round of the window through a large map: what was answered must not be forgotten
  /// before the block is met again.
  static constexpr std::uint32_t kForgotten = 1024;
  /// Steps after which it is asked for again: the other side had no room for the request.
  static constexpr std::uint32_t kAgain = 4096;
  // Values of away_.
  static constexpr std::uint32_t kAway = 0;
  static constexpr std::uint32_t kAwayUnpublished = 1;
  static constexpr std::uint32_t kReturned = 2;
  static constexpr std::uint32_t kWithdrawn = 3;         ///< Archived when the map was cleared.
  static constexpr std::size_t kWithdrawnBuckets = 512;  ///< Of away_, looked at in a tick.
  [[nodiscard]] static std::size_t place_of(BlockKey key) noexcept {
    return mix64(key.bits) % kRequests;
  }
  void push(const Note& note) noexcept;
  void take(const Note& note) noexcept;
  void take_archived(BlockKey key, std::uint32_t value) noexcept;
  void take_reloaded(BlockKey key) noexcept;
  void take_cleared() noexcept;
  [[nodiscard]] std::span<const BlockKey> some_withdrawn() noexcept;
  [[nodiscard]] bool push_answer(const LeavingBlock& block) noexcept;

  // Of the thread that maps.
  std::span<Request> requests_{};
  std::uint32_t step_ = 0;
  std::size_t archived_ = 0;
  std::size_t most_archived_ = 0;
  // Of the thread that publishes.
  KeyIndex away_{};
  std::span<LeavingBlock> leaving_{};
  std::size_t leaving_count_ = 0;
  std::span<BlockKey> returned_{};
  std::size_t returned_count_ = 0;
  std::size_t withdrawn_ = 0;
  std::size_t withdrawn_place_ = 0;
  std::uint64_t unpublished_ = 0;
  std::uint64_t unlisted_ = 0;
  // Rings, with how much was ever written to them and taken.
  std::span<Note> notes_{};
  std::span<LeavingBlock> answers_{};
  std::atomic<std::uint32_t> notes_written_{0};
  std::atomic<std::uint32_t> notes_taken_{0};
  std::atomic<std::uint32_t> answers_written_{0};
  std::atomic<std::uint32_t> answers_taken_{0};
};

}  // namespace tessera
