// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/grid/internal/key_index.hpp"

namespace tessera {

Result<KeyIndex> KeyIndex::make(Arena& arena, std::size_t capacity, std::uint64_t seed) noexcept {
  KeyIndex index;
  index.buckets_ = arena.take<Bucket>(bucket_count(capacity));
  if (index.buckets_.empty()) return Status::kResourceExhausted;
  index.capacity_ = capacity;
  index.salt_ = salt_of(seed);
  return index;
}

void KeyIndex::clear() noexcept {
  for (Bucket& bucket : buckets_) bucket = Bucket{};
  size_ = 0;
}

void KeyIndex::assign(BlockKey key, std::uint32_t value) noexcept {
  const std::uint64_t hash = hash_of(key);
  for (const std::uint32_t b : {first_bucket(hash), second_bucket(hash)}) {
    for (std::size_t slot = 0; slot < kBucketSlots; ++slot) {
      if (buckets_[b].keys[slot] == key.bits + 1) buckets_[b].values[slot] = value;
    }
  }
}

bool KeyIndex::erase(BlockKey key) noexcept {
  if (buckets_.empty()) return false;
  const std::uint64_t hash = hash_of(key);
  for (const std::uint32_t b : {first_bucket(hash), second_bucket(hash)}) {
    Bucket& bucket = buckets_[b];
    for (std::size_t slot = 0; slot < kBucketSlots; ++slot) {
      if (bucket.keys[slot] != key.bits + 1) continue;
      bucket.keys[slot] = 0;
      --size_;
      return true;
    }
  }
  return false;
}

int KeyIndex::empty_slot(const Bucket& bucket) noexcept {
  for (std::size_t slot = 0; slot < kBucketSlots; ++slot) {
    if (bucket.keys[slot] == 0) return static_cast<int>(slot);
  }
  return -1;
}

Status KeyIndex::insert(BlockKey key, std::uint32_t value) noexcept {
  TESSERA_ASSERT(!find(key).has_value());
  if (size_ == capacity_) return Status::kResourceExhausted;
  const std::uint64_t hash = hash_of(key);
  // Mostly one of the key's two buckets has room.
  for (const std::uint32_t b : {first_bucket(hash), second_bucket(hash)}) {
    const int free_slot = empty_slot(buckets_[b]);
    if (free_slot < 0) continue;
    fill(buckets_[b], free_slot, key, value);
    return Status::kOk;
  }
  return insert_by_moving(key, value);
}

void KeyIndex::fill(Bucket& bucket, int slot, BlockKey key, std::uint32_t value) noexcept {
  bucket.keys[static_cast<std::size_t>(slot)] = key.bits + 1;
  bucket.values[static_cast<std::size_t>(slot)] = value;
  ++size_;
}

Status KeyIndex::insert_by_moving(BlockKey key, std::uint32_t value) noexcept {
  // Breadth first from the key's two buckets: entry i was reached from entry parent[i] by the key
  // in slot[i] of it. The first full-path found is a shortest one, so it visits no bucket twice and
  // its keys can be moved from its end back.
  std::array<std::uint32_t, kMaxSearched> bucket{};
  std::array<int, kMaxSearched> parent{};
  std::array<int, kMaxSearched> slot{};
  const std::uint64_t hash = hash_of(key);
  bucket[0] = first_bucket(hash);
  bucket[1] = second_bucket(hash);
  parent[0] = parent[1] = -1;
  int reached = 2;
  for (int i = 0; i < reached; ++i) {
    const auto at = static_cast<std::size_t>(i);
    int free_slot = empty_slot(buckets_[bucket[at]]);
    if (free_slot < 0) {
      for (int s = 0; s < kBucketSlots && reached < kMaxSearched; ++s, ++reached) {
        const auto next = static_cast<std::size_t>(reached);
        bucket[next] =
            other_bucket(buckets_[bucket[at]].keys[static_cast<std::size_t>(s)], bucket[at]);
        parent[next] = i;
        slot[next] = s;
      }
      continue;
    }
    // A key is copied to its new place before its old one is overwritten: at no moment is it
    // absent.
    for (int step = i;;) {
      const auto here = static_cast<std::size_t>(step);
      Bucket& target = buckets_[bucket[here]];
      const auto into = static_cast<std::size_t>(free_slot);
      if (parent[here] < 0) {
        fill(target, free_slot, key, value);
        return Status::kOk;
      }
      const Bucket& source = buckets_[bucket[static_cast<std::size_t>(parent[here])]];
      const auto from = static_cast<std::size_t>(slot[here]);
      target.keys[into] = source.keys[from];
      target.values[into] = source.values[from];
      free_slot = slot[here];
      step = parent[here];
    }
  }
  return Status::kResourceExhausted;
}

}  // namespace tessera
