// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/grid/internal/block_index.hpp"

namespace tessera {

Result<BlockIndex> BlockIndex::make(Arena& arena, std::size_t capacity,
                                    std::uint64_t seed) noexcept {
  if (arena.remaining_bytes() < required_bytes(capacity)) return Status::kResourceExhausted;
  BlockIndex index;
  index.leaves_ = arena.take<Leaf>(leaf_count(capacity));
  const std::span<std::byte> pages = arena.take_untouched(leaf_count(capacity) * kPageBytes);
  if (index.leaves_.empty() || pages.empty()) return Status::kResourceExhausted;
  index.pages_ = {reinterpret_cast<Page*>(pages.data()), leaf_count(capacity)};
  index.capacity_ = capacity;
  index.salt_ = salt_of(seed);
  index.clear();
  return index;
}

void BlockIndex::clear() noexcept {
  size_ = 0;
  if (leaves_.empty()) return;
  begin_move();
  for (Leaf& leaf : leaves_) store_shared(leaf.page, std::uint32_t{0});
  leaves_[0].first_leaf = 0;
  leaves_[0].end_leaf = static_cast<std::uint32_t>(leaves_.size());
  clear_shared_words(pages_.data(), kPageBytes);
  store_shared(pages_used_, std::size_t{1});
  end_move();
}

void BlockIndex::insert(Place place, BlockKey key, std::uint32_t handle) noexcept {
  TESSERA_ASSERT(*place == 0 && handle != 0);
  // What the handle names is complete before it can be found.
  store_shared(*place, std::uint64_t{hash_of(key)} << 32U | handle, std::memory_order_release);
  ++size_;
}

void BlockIndex::forget(Place slot) noexcept {
  store_shared(*slot, std::uint64_t{0});
  --size_;
}

Result<BlockIndex::Place> BlockIndex::make_room(BlockKey key) noexcept {
  if (size_ == capacity_) return Status::kResourceExhausted;
  const std::uint32_t hash = hash_of(key);
  for (;;) {
    const std::uint32_t page = leaves_[leaf_of(hash)].page;
    for (const std::uint32_t b : {first_bucket(hash), second_bucket(hash)}) {
      for (std::uint64_t& slot : pages_[page][b].slots) {
        if (slot == 0) return &slot;
      }
    }
    std::uint64_t* const place = make_room_in(pages_[page], hash);
    if (place != nullptr) return place;
    if (!split(page)) return Status::kResourceExhausted;
  }
}

BlockIndex::Place BlockIndex::make_room_in(Page& page, std::uint32_t hash) noexcept {
  // Breadth first from the key's two buckets, which are full, each bucket once: bucket i was
  // reached from bucket parent[i] by the entry in slot[i] of that. The first path to an empty slot
  // is a shortest one.
  std::array<std::uint8_t, kPageBuckets> bucket{};
  std::array<std::uint8_t, kPageBuckets> parent{};
  std::array<std::uint8_t, kPageBuckets> slot{};
  bucket[0] = static_cast<std::uint8_t>(first_bucket(hash));
  bucket[1] = static_cast<std::uint8_t>(second_bucket(hash));
  std::uint64_t seen = std::uint64_t{1} << bucket[0] | std::uint64_t{1} << bucket[1];
  std::size_t reached = 2;
  for (std::size_t i = 0; i < reached; ++i) {
    Bucket& here = page[bucket[i]];
    for (std::size_t s = 0; s < kBucketSlots; ++s) {
      const std::uint64_t entry = here.slots[s];
      if (entry != 0) {
        const auto its_hash = static_cast<std::uint32_t>(entry >> 32U);
        const std::uint32_t first = first_bucket(its_hash);
        const std::uint32_t other = first == bucket[i] ? second_bucket(its_hash) : first;
        if ((seen >> other & 1U) != 0) continue;
        seen |= std::uint64_t{1} << other;
        bucket[reached] = static_cast<std::uint8_t>(other);
        parent[reached] = static_cast<std::uint8_t>(i);
        slot[reached] = static_cast<std::uint8_t>(s);
        ++reached;
        continue;
      }
      // Each entry on the path moves up by one, the last one first.
      Place free_slot = &here.slots[s];
      begin_move();
      for (std::size_t step = i; step >= 2; step = parent[step]) {
        std::uint64_t& from = page[bucket[parent[step]]].slots[slot[step]];
        store_shared(*free_slot, from);
        free_slot = &from;
      }
      store_shared(*free_slot, std::uint64_t{0});
      end_move();
      return free_slot;
    }
  }
  return nullptr;
}

bool BlockIndex::split(std::uint32_t page) noexcept {
  const std::uint32_t first = leaves_[page].first_leaf;
  const std::uint32_t end = leaves_[page].end_leaf;
  if (end - first < 2) return false;
  // Pages serve disjoint leaves, so with two leaves in one page there is a page to spare.
  TESSERA_ASSERT(pages_used_ < pages_.size());
  const std::uint32_t middle = first + (end - first) / 2;
  const auto added = static_cast<std::uint32_t>(pages_used_);
  const auto moves = [&](std::uint64_t entry) {
    return entry != 0 && leaf_of(static_cast<std::uint32_t>(entry >> 32U)) >= middle;
  };
  begin_move();
  // Buckets do not depend on the leaf: each entry keeps its bucket and slot.
  for (std::size_t b = 0; b < kPageBuckets; ++b) {
    for (std::size_t s = 0; s < kBucketSlots; ++s) {
      const std::uint64_t entry = pages_[page][b].slots[s];
      store_shared(pages_[added][b].slots[s], moves(entry) ? entry : std::uint64_t{0});
    }
  }
  store_shared(pages_used_, pages_used_ + 1, std::memory_order_release);
  leaves_[added].first_leaf = middle;
  leaves_[added].end_leaf = end;
  leaves_[page].end_leaf = middle;
  for (std::size_t leaf = middle; leaf < end; ++leaf)
    store_shared(leaves_[leaf].page, added, std::memory_order_release);
  for (Bucket& bucket : pages_[page]) {
    for (std::uint64_t& entry : bucket.slots) {
      if (moves(entry)) store_shared(entry, std::uint64_t{0});
    }
  }
  end_move();
  return true;
}

}  // namespace tessera
