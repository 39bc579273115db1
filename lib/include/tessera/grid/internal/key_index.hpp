// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A hash index from block keys to 32-bit values in fixed memory with a hard bound on work: a key
// lives in one of two buckets of five, so a look-up reads two cache lines at most, whatever the
// keys. Inserting may move earlier keys to their other bucket along a path found by a search of at
// most kMaxSearched buckets; where none is found the insert is refused.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/internal/digest.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera {

class KeyIndex {
 public:
  static constexpr int kBucketSlots = 5;
  static constexpr int kMaxProbes = 2 * kBucketSlots;  ///< Keys compared by find(), at most.
  static constexpr int kMaxSearched = 62;  ///< Buckets visited by insert(), at most: 2 + 10 + 50.

  /// Bytes for an index that holds up to capacity keys at 80 % load.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::size_t capacity) noexcept {
    return arena_bytes<Bucket>(bucket_count(capacity));
  }
  /// An index in memory from the arena. Fails with kResourceExhausted iff it does not fit.
  /// O(capacity). seed: as BlockIndex::make has it; 10 keys that collide fill their buckets.
  [[nodiscard]] static Result<KeyIndex> make(Arena& arena, std::size_t capacity,
                                             std::uint64_t seed = 0) noexcept;

  /// Holds nothing and takes nothing.
  KeyIndex() noexcept = default;

  /// The value of key, or nothing. Reads two buckets (128 bytes) at most.
  [[nodiscard]] std::optional<std::uint32_t> find(BlockKey key) const noexcept {
    if (buckets_.empty()) return std::nullopt;
    const std::uint64_t hash = hash_of(key);
    for (const std::uint32_t b : {first_bucket(hash), second_bucket(hash)}) {
      const Bucket& bucket = buckets_[b];
      for (std::size_t slot = 0; slot < kBucketSlots; ++slot) {
        if (bucket.keys[slot] == key.bits + 1) return bucket.values[slot];
      }
    }
    return std::nullopt;
  }

  /// Fetches the memory that find() reads. O(1). Inlined, as a call of what
  /// only prefetches is left out as one without effect.
  [[gnu::always_inline]] void prefetch(BlockKey key) const noexcept {
    if (buckets_.empty()) return;
    const std::uint64_t hash = hash_of(key);
    __builtin_prefetch(&buckets_[first_bucket(hash)], 1);
    __builtin_prefetch(&buckets_[second_bucket(hash)], 1);
  }

  /// Adds a key that is not present. Fails with kResourceExhausted iff capacity() keys are present
  /// already or no bucket within reach has room (possible for keys chosen to collide); the index is
  /// then unchanged. At most kMaxSearched buckets read and two keys moved.
  Status insert(BlockKey key, std::uint32_t value) noexcept;

  /// Sets the value of a key that is present. Reads two buckets at most.
  void assign(BlockKey key, std::uint32_t value) noexcept;

  /// Removes a key; true iff it was present. Reads two buckets at most.
  bool erase(BlockKey key) noexcept;

  /// Calls visit(BlockKey, value) for every key, in no order that means anything. O(capacity).
  template <class Visit>
  void for_each(Visit&& visit) const noexcept {
    for (const Bucket& bucket : buckets_) {
      for (std::size_t slot = 0; slot < kBucketSlots; ++slot) {
        if (bucket.keys[slot] != 0) visit(BlockKey{bucket.keys[slot] - 1}, bucket.values[slot]);
      }
    }
  }
  /// The same for the keys of the next buckets from place on, around the end and once around at
  /// most; moves place on. visit must not insert or erase. O(buckets).
  template <class Visit>
  void for_some(std::size_t& place, std::size_t buckets, Visit&& visit) const noexcept {
    const std::size_t count = buckets < buckets_.size() ? buckets : buckets_.size();
    for (std::size_t n = 0; n < count; ++n, ++place) {
      if (place >= buckets_.size()) place = 0;
      const Bucket& bucket = buckets_[place];
      for (std::size_t slot = 0; slot < kBucketSlots; ++slot) {
        if (bucket.keys[slot] != 0) visit(BlockKey{bucket.keys[slot] - 1}, bucket.values[slot]);
      }
    }
  }
  /// Forgets every key. O(capacity).
  void clear() noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }

 private:
  /// One cache line. Keys are stored plus one, so that zero means empty and fresh memory is an
  /// empty index.
  struct alignas(64) Bucket {
    std::array<std::uint64_t, kBucketSlots> keys{};
    std::array<std::uint32_t, kBucketSlots> values{};
  };
  static_assert(sizeof(Bucket) == 64);

  [[nodiscard]] static constexpr std::size_t bucket_count(std::size_t capacity) noexcept {
    return capacity / 4 + 2;  // 5 slots for 4 keys
  }
  [[nodiscard]] std::uint64_t hash_of(BlockKey key) const noexcept {
    return mix64(key.bits + salt_);
  }
  [[nodiscard]] std::uint32_t first_bucket(std::uint64_t hash) const noexcept {
    return scale(static_cast<std::uint32_t>(hash));
  }
  [[nodiscard]] std::uint32_t second_bucket(std::uint64_t hash) const noexcept {
    const std::uint32_t first = first_bucket(hash);
    const std::uint32_t second = scale(static_cast<std::uint32_t>(hash >> 32U));
    // Two different buckets always, or a bucket full of such keys would refuse early.
    return second != first ? second : (second + 1 == buckets_.size() ? 0 : second + 1);
  }
  [[nodiscard]] std::uint32_t scale(std::uint32_t part) const noexcept {
    return static_cast<std::uint32_t>((std::uint64_t{part} * buckets_.size()) >> 32U);
  }
  [[nodiscard]] std::uint32_t other_bucket(std::uint64_t stored_key,
                                           std::uint32_t bucket) const noexcept {
    const std::uint64_t hash = hash_of(BlockKey{stored_key - 1});
    const std::uint32_t first = first_bucket(hash);
    return first == bucket ? second_bucket(hash) : first;
  }
  static int empty_slot(const Bucket& bucket) noexcept;
  void fill(Bucket& bucket, int slot, BlockKey key, std::uint32_t value) noexcept;
  /// insert(), where both of the key's buckets are full.
  Status insert_by_moving(BlockKey key, std::uint32_t value) noexcept;

  std::span<Bucket> buckets_;
  std::size_t capacity_ = 0;
  std::size_t size_ = 0;
  std::uint64_t salt_ = salt_of(0);
};

}  // namespace tessera
