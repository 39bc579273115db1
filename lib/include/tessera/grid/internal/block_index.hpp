// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// From a block's key to its handle, in memory that grows with the number of blocks: extendible
// hashing over pages of 4 KiB. A page is 64 buckets of eight slots, a bucket is one cache line, a
// slot one word: 32 bits of the key's hash and the handle. The key itself is with the block, which
// the caller is asked for.
//
// The hash's upper part names a leaf, and a table says which page serves it. At first one page
// serves all leaves; a page that has no room for an insert is split, and a new page takes over half
// of its leaves. Within a page an entry is in one of two buckets. Entries are copied to their new
// place before they leave the old one: at no moment is an entry absent.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/internal/digest.hpp"
#include "tessera/base/internal/lanes.hpp"
#include "tessera/base/internal/shared_words.hpp"
#include "tessera/base/status.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera {

class BlockIndex {
 public:
  static constexpr std::size_t kPageBytes = 4096;
  static constexpr int kBucketSlots = 8;
  static constexpr int kPageBuckets = 64;
  static constexpr int kMaxProbes = 2 * kBucketSlots;  ///< Slots compared by find(), at most.
  /// Entries of a leaf if all leaves are alike. A page takes about 490; so that no leaf is beyond
  /// that by chance, five standard deviations less.
  static constexpr std::size_t kLeafEntries = 384;

  /// An empty slot that an insert may use until the index is changed again.
  using Place = std::uint64_t*;

  /// Bytes for an index of up to capacity entries: twelve for each leaf, and a page for each.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::size_t capacity) noexcept {
    return arena_bytes<Leaf>(leaf_count(capacity)) + leaf_count(capacity) * kPageBytes;
  }
  /// An index in memory from the arena. Fails with kResourceExhausted iff it does not fit.
  /// O(leaves); of the pages only the first is touched. seed: who does not know it cannot choose
  /// keys that collide. What is found does not depend on it, only which keys are refused where
  /// many collide.
  [[nodiscard]] static Result<BlockIndex> make(Arena& arena, std::size_t capacity,
                                               std::uint64_t seed = 0) noexcept;

  /// Holds nothing and takes nothing.
  BlockIndex() noexcept = default;

  /// The handle of key, or 0. is_item(handle) says whether that handle's item has the key. Reads
  /// two buckets (128 bytes) at most, and asks only where 32 bits of the hash agree.
  template <class IsItem>
  [[nodiscard]] std::uint32_t find(BlockKey key, IsItem&& is_item) const noexcept {
    const std::uint64_t* const slot = slot_of(key, is_item);
    return slot == nullptr ? 0 : static_cast<std::uint32_t>(*slot);
  }

  /// Prefetches the memory that find() reads. O(1). Inlined, as a call of what
  /// only prefetches is left out as one without effect.
  [[gnu::always_inline]] void prefetch(BlockKey key) const noexcept {
    if (leaves_.empty()) return;
    const std::uint32_t hash = hash_of(key);
    const Page& page = pages_[leaves_[leaf_of(hash)].page];
    __builtin_prefetch(&page[first_bucket(hash)]);
    __builtin_prefetch(&page[second_bucket(hash)]);
  }

  /// find() for another thread than the writer's. A key that is present all the while may be missed
  /// where move_stamp() was odd before or is another one after. is_item may be asked of handles
  /// that are no item's any more.
  template <class IsItem>
  [[nodiscard]] std::uint32_t find_shared(BlockKey key, IsItem&& is_item) const noexcept {
    if (leaves_.empty()) return 0;
    const std::uint32_t hash = hash_of(key);
    // A page is complete before a leaf names it.
    const Page& page = pages_[load_shared(leaves_[leaf_of(hash)].page, std::memory_order_acquire)];
    for (const std::uint32_t b : {first_bucket(hash), second_bucket(hash)}) {
      for (const std::uint64_t& slot : page[b].slots) {
        const std::uint64_t entry = load_shared(slot, std::memory_order_acquire);
        // Of an entry that is being written there may be the hash alone (shared_words.hpp).
        if (entry >> 32U != hash || static_cast<std::uint32_t>(entry) == 0) continue;
        if (is_item(static_cast<std::uint32_t>(entry))) return static_cast<std::uint32_t>(entry);
      }
    }
    return 0;
  }
  /// Pages in use, and the handle in a slot of one (0: none), for another thread than the writer's.
  [[nodiscard]] std::size_t pages_shared() const noexcept {
    return load_shared(pages_used_, std::memory_order_acquire);
  }
  [[nodiscard]] std::uint32_t handle_shared(std::size_t page, std::size_t slot) const noexcept {
    const Bucket& bucket = pages_[page][slot / kBucketSlots];
    return static_cast<std::uint32_t>(
        load_shared(bucket.slots[slot % kBucketSlots], std::memory_order_acquire));
  }
  /// Changes whenever entries change their places; odd while they do.
  [[nodiscard]] std::uint64_t move_stamp() const noexcept {
    return load_shared(move_stamp_, std::memory_order_acquire);
  }

  /// Room for a key that is not present. Fails with kResourceExhausted iff capacity() keys are
  /// present already, or no slot within reach is empty in a page that serves a single leaf
  /// (possible for keys chosen to collide by who knows the seed: 16 do); no entry is lost, but
  /// pages may have been taken. At most 64 buckets read for each split, and one more time; a split
  /// moves at most 512 entries and rewrites at most half of the table of leaves, and a page is
  /// split at most log2(leaves) times.
  [[nodiscard]] Result<Place> make_room(BlockKey key) noexcept;
  /// Adds a key at a place that make_room gave for it. handle: not 0. O(1).
  void insert(Place place, BlockKey key, std::uint32_t handle) noexcept;

  /// Removes a key; true iff it was present. As find().
  template <class IsItem>
  bool erase(BlockKey key, IsItem&& is_item) noexcept {
    std::uint64_t* const slot = slot_of(key, is_item);
    if (slot == nullptr) return false;
    forget(slot);
    return true;
  }

  /// Calls visit(handle) for every entry, in no order that means anything. The entry visited may be
  /// erased. O(pages in use).
  template <class Visit>
  void for_each(Visit&& visit) const noexcept {
    for (std::size_t i = 0; i < pages_used_; ++i) {
      for (const Bucket& bucket : pages_[i]) {
        for (const std::uint64_t slot : bucket.slots) {
          if (slot != 0) visit(static_cast<std::uint32_t>(slot));
        }
      }
    }
  }

  /// The same for the entries of the next slots from place on, around the end and once around at
  /// most; moves place on. Ends early, at the bucket at hand, after visit gave false. Returns the
  /// slots looked at: at most slots and a bucket.
  template <class Visit>
  std::size_t for_some(std::size_t& place, std::size_t slots, Visit&& visit) const noexcept {
    std::size_t seen = 0;
    bool go_on = true;
    const std::size_t buckets = pages_used_ * kPageBuckets;
    for (std::size_t n = 0; n < buckets && seen < slots && go_on; ++n) {
      if (place >= buckets) place = 0;
      for (const std::uint64_t slot : pages_[place / kPageBuckets][place % kPageBuckets].slots) {
        if (slot != 0) go_on = visit(static_cast<std::uint32_t>(slot)) && go_on;
      }
      seen += kBucketSlots;
      if (go_on) ++place;
    }
    return seen;
  }

  /// Forgets every entry and gives back all pages but the first. O(leaves).
  void clear() noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// Of the pages in use; for_some() goes through so many.
  [[nodiscard]] std::size_t slots() const noexcept {
    return pages_used_ * kPageBuckets * kBucketSlots;
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  /// Bytes of the table of leaves and of the pages in use.
  [[nodiscard]] std::size_t used_bytes() const noexcept {
    return arena_bytes<Leaf>(leaves_.size()) + pages_used_ * kPageBytes;
  }

 private:
  /// handle | hash << 32; 0 if empty.
  struct alignas(64) Bucket {
    std::array<std::uint64_t, kBucketSlots> slots;
  };
  using Page = std::array<Bucket, kPageBuckets>;
  static_assert(sizeof(Page) == kPageBytes);
  /// Entry i tells of leaf i and of page i; there are as many pages as leaves.
  struct Leaf {
    std::uint32_t page = 0;        ///< That serves the leaf.
    std::uint32_t first_leaf = 0;  ///< That the page serves.
    std::uint32_t end_leaf = 0;
  };

  [[nodiscard]] static constexpr std::size_t leaf_count(std::size_t capacity) noexcept {
    return capacity / kLeafEntries + 1;
  }
  [[nodiscard]] std::uint32_t hash_of(BlockKey key) const noexcept {
    return static_cast<std::uint32_t>(mix64(key.bits + salt_) >> 32U);
  }
  /// Of the hash's upper bits; buckets are of its lower ones.
  [[nodiscard]] std::size_t leaf_of(std::uint32_t hash) const noexcept {
    return static_cast<std::size_t>((std::uint64_t{hash} * leaves_.size()) >> 32U);
  }
  [[nodiscard]] static constexpr std::uint32_t first_bucket(std::uint32_t hash) noexcept {
    return hash % kPageBuckets;
  }
  /// Never the first: a bucket full of such keys would refuse early.
  [[nodiscard]] static constexpr std::uint32_t second_bucket(std::uint32_t hash) noexcept {
    const std::uint32_t bucket = (hash / kPageBuckets) % kPageBuckets;
    return bucket != first_bucket(hash) ? bucket : bucket ^ (kPageBuckets / 2);
  }

  /// The slots whose hash is this one, a bit each; empty ones too if it is 0. Without a branch,
  /// which the next look-up would have to wait for.
  [[nodiscard]] static unsigned slots_with(const Bucket& bucket, std::uint32_t hash) noexcept {
    // A slot is two lanes; the one with the hash is the upper, wherever that is in memory.
    constexpr std::int32_t kLower = std::endian::native == std::endian::little ? 0 : 1;
    constexpr std::int32_t kUpper = 1 - kLower;
    const auto h = static_cast<std::int32_t>(hash);
    const Int4 wanted{h, h, h, h};
    Int4 same{};
    for (std::int32_t pair = 0; pair < kBucketSlots / 2; ++pair) {
      Int4 slots;
      std::memcpy(&slots, &bucket.slots[static_cast<std::size_t>(2 * pair)], sizeof(slots));
      const std::int32_t first = 1 << (2 * pair);
      same |= (slots == wanted) &
              Int4{first * kLower, first * kUpper, 2 * first * kLower, 2 * first * kUpper};
    }
    return static_cast<unsigned>(same[kUpper] | same[2 + kUpper]);
  }
  template <class IsItem>
  [[nodiscard]] Place slot_of(BlockKey key, IsItem&& is_item) const noexcept {
    if (leaves_.empty()) return nullptr;
    const std::uint32_t hash = hash_of(key);
    Page& page = pages_[leaves_[leaf_of(hash)].page];
    for (const std::uint32_t b : {first_bucket(hash), second_bucket(hash)}) {
      for (unsigned same = slots_with(page[b], hash); same != 0; same &= same - 1) {
        std::uint64_t& slot = page[b].slots[static_cast<std::size_t>(std::countr_zero(same))];
        if (slot != 0 && is_item(static_cast<std::uint32_t>(slot))) return &slot;
      }
    }
    return nullptr;
  }
  /// Relaxed: a reader may still see the entry after what the caller does next. A caller that
  /// changes or reuses the item first marks it as gone and puts a release fence behind that mark,
  /// as LocalMap::remove_block does.
  void forget(Place slot) noexcept;
  void begin_move() noexcept {
    store_shared(move_stamp_, move_stamp_ + 1);
    std::atomic_thread_fence(std::memory_order_release);
  }
  void end_move() noexcept {
    store_shared(move_stamp_, move_stamp_ + 1, std::memory_order_release);
  }
  [[nodiscard]] Place make_room_in(Page& page, std::uint32_t hash) noexcept;
  [[nodiscard]] bool split(std::uint32_t page) noexcept;

  std::span<Leaf> leaves_;
  std::span<Page> pages_;
  std::size_t pages_used_ = 0;
  std::size_t capacity_ = 0;
  std::size_t size_ = 0;
  std::uint64_t salt_ = salt_of(0);
  std::uint64_t move_stamp_ = 0;
};

}  // namespace tessera
