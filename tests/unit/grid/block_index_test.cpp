// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The map's index holds as many blocks as it was made for, takes memory as they come, and refuses
// keys that are made to collide without losing any.
#include "tessera/grid/internal/block_index.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

/// An index in memory of exactly its size, full of rubbish at first, and the items' keys. The
/// handle of item i is i + 1.
struct OwnedIndex {
  explicit OwnedIndex(std::size_t capacity, std::uint64_t seed = 0)
      : memory(BlockIndex::required_bytes(capacity)) {
    memory.fill(std::byte{0xcd});
    Arena arena = memory.arena();
    const Result<BlockIndex> made = BlockIndex::make(arena, capacity, seed);
    REQUIRE(made.ok());
    REQUIRE(arena.remaining_bytes() == 0);
    index = *made;
  }
  Status insert(BlockKey key) {
    const Result<BlockIndex::Place> place = index.make_room(key);
    if (!place.ok()) return place.status();
    keys.push_back(key);
    index.insert(*place, key, static_cast<std::uint32_t>(keys.size()));
    return Status::kOk;
  }
  /// The item's number plus one, or 0.
  [[nodiscard]] std::uint32_t find(BlockKey key) const {
    return index.find(key, [&](std::uint32_t handle) { return keys[handle - 1] == key; });
  }
  bool erase(BlockKey key) {
    return index.erase(key, [&](std::uint32_t handle) { return keys[handle - 1] == key; });
  }
  AlignedMemory memory;
  std::vector<BlockKey> keys;
  BlockIndex index;
};

/// Key number i of a street: blocks side by side, a few layers high.
BlockKey street_key(std::size_t i) {
  const auto n = static_cast<std::int32_t>(i);
  return pack_in_grid({n / 200 - 1000, n / 4 % 50 - 25, n % 4 - 2});
}

std::uint32_t upper_hash(BlockKey key) {
  return static_cast<std::uint32_t>(mix64(key.bits + 0x9e3779b97f4a7c15U) >> 32U);
}

TEST_CASE("BlockIndex: as many keys as it was made for are taken and found, one more is refused") {
  const std::size_t capacity =
      GENERATE(1U, 2U, 37U, 383U, 384U, 385U, 767U, 768U, 1200U, 5000U, 40000U, 200000U);
  CAPTURE(capacity);
  OwnedIndex owned(capacity);
  std::size_t refused = 0;
  for (std::size_t i = 0; i < capacity; ++i)
    refused += owned.insert(street_key(i)) != Status::kOk ? 1U : 0U;
  REQUIRE(refused == 0);
  CHECK(owned.insert(street_key(capacity)) == Status::kResourceExhausted);
  CHECK(owned.index.size() == capacity);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < capacity; ++i) wrong += owned.find(street_key(i)) != i + 1 ? 1U : 0U;
  CHECK(wrong == 0);
  CHECK(owned.find(street_key(capacity)) == 0);
  CHECK(owned.index.used_bytes() <= BlockIndex::required_bytes(capacity));
}

TEST_CASE("BlockIndex: memory is taken as keys come, the rest stays untouched") {
  OwnedIndex owned(400000);
  const std::size_t fresh = owned.index.used_bytes();
  CHECK(fresh < BlockIndex::required_bytes(400000) / 100);
  for (std::size_t n = 1; n <= 40000; ++n) {
    REQUIRE(owned.insert(street_key(n)) == Status::kOk);
    // Pages are at least 7 / 16 full: half of a page that was split near its limit.
    REQUIRE(owned.index.used_bytes() <= fresh + n * 18 + 2 * BlockIndex::kPageBytes);
  }
  const auto bytes = std::as_bytes(owned.memory.span()).subspan(owned.index.used_bytes());
  CHECK(std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0xcd}; }));
}

/// Keys that share two buckets of any page, by the hash of seed 0.
std::vector<BlockKey> colliding_keys(std::size_t count) {
  std::vector<BlockKey> colliding;
  for (std::size_t i = 0; colliding.size() < count; ++i) {
    const BlockKey key{i};
    const std::uint32_t hash = upper_hash(key);
    const std::uint32_t first = hash % 64;
    const std::uint32_t second = hash / 64 % 64;
    if ((first == 5 && second == 44) || (first == 44 && second == 5)) colliding.push_back(key);
  }
  return colliding;
}

TEST_CASE("BlockIndex: keys made to collide by one seed do not by another") {
  const std::uint64_t seed = GENERATE(1U, 2U, 0x5eedU);
  OwnedIndex owned(300, seed);
  const std::vector<BlockKey> colliding = colliding_keys(100);
  for (std::size_t i = 0; i < colliding.size(); ++i) {
    CHECK(owned.insert(colliding[i]) == Status::kOk);
    CHECK(owned.find(colliding[i]) == i + 1);
  }
}

TEST_CASE("BlockIndex: keys made to share two buckets are refused when these are full, none lost") {
  OwnedIndex owned(300);
  const std::vector<BlockKey> colliding = colliding_keys(30);
  for (std::size_t i = 0; i < colliding.size(); ++i) {
    const std::size_t before = owned.index.size();
    const Status status = owned.insert(colliding[i]);
    CHECK((status == Status::kOk) == (i < 2 * BlockIndex::kBucketSlots));
    CHECK(owned.index.size() == before + (status == Status::kOk ? 1U : 0U));
  }
  for (std::size_t i = 0; i < colliding.size(); ++i)
    CHECK(owned.find(colliding[i]) == (i < 2 * BlockIndex::kBucketSlots ? i + 1 : 0));
  CHECK(owned.insert(street_key(1)) == Status::kOk);
}

TEST_CASE("BlockIndex: keys of one leaf fill its page, split all others off it, and lose nothing") {
  constexpr std::size_t kCapacity = 8 * BlockIndex::kLeafEntries - 1;
  OwnedIndex owned(kCapacity);
  std::vector<BlockKey> others;
  std::vector<BlockKey> of_leaf;
  for (std::size_t i = 0; of_leaf.size() < 600; ++i) {
    const BlockKey key = street_key(i);
    if (std::uint64_t{upper_hash(key)} * 8 >> 32U == 3) {
      of_leaf.push_back(key);
    } else if (others.size() < 300) {
      others.push_back(key);
    }
  }
  for (const BlockKey key : others) REQUIRE(owned.insert(key) == Status::kOk);
  std::size_t taken = 0;
  for (const BlockKey key : of_leaf) taken += owned.insert(key) == Status::kOk ? 1U : 0U;
  CHECK(taken > BlockIndex::kLeafEntries);
  CHECK(taken <= 512);
  std::size_t found = 0;
  for (const BlockKey key : of_leaf) found += owned.find(key) != 0 ? 1U : 0U;
  CHECK(found == taken);
  for (std::size_t i = 0; i < others.size(); ++i) REQUIRE(owned.find(others[i]) == i + 1);
}

TEST_CASE("BlockIndex: says what an ordered map says, through random inserts and erasures") {
  constexpr std::uint64_t kSeed = 41;
  oracle::Random random(kSeed);
  OwnedIndex owned(3000);
  std::map<std::uint64_t, std::uint32_t> model;
  for (int step = 0; step < 40000; ++step) {
    INFO("seed " << kSeed << ", step " << step);
    const BlockKey key = street_key(static_cast<std::size_t>(random.below(4000)));
    const auto known = model.find(key.bits);
    REQUIRE(owned.find(key) == (known == model.end() ? 0 : known->second));
    if (known != model.end()) {
      REQUIRE(owned.erase(key));
      model.erase(known);
    } else if (owned.insert(key) == Status::kOk) {
      model[key.bits] = static_cast<std::uint32_t>(owned.keys.size());
    } else {
      REQUIRE(model.size() == 3000);
    }
    REQUIRE(owned.index.size() == model.size());
  }
  std::set<std::uint32_t> visited;
  owned.index.for_each([&](std::uint32_t handle) { CHECK(visited.insert(handle).second); });
  REQUIRE(visited.size() == model.size());
  for (const auto& [bits, handle] : model) CHECK(visited.contains(handle));
}

TEST_CASE("BlockIndex: its stamp is even between changes and tells of entries that moved") {
  OwnedIndex owned(5000);
  std::size_t splits = 0;
  std::size_t moves = 0;
  for (std::size_t i = 0; i < 5000; ++i) {
    const std::uint64_t before = owned.index.move_stamp();
    const std::size_t used_bytes = owned.index.used_bytes();
    REQUIRE(owned.insert(street_key(i)) == Status::kOk);
    REQUIRE(owned.index.move_stamp() % 2 == 0);
    const bool moved = owned.index.move_stamp() != before;
    const bool split = owned.index.used_bytes() != used_bytes;
    REQUIRE((moved || !split));
    moves += moved ? 1U : 0U;
    splits += split ? 1U : 0U;
    REQUIRE(owned.index.find_shared(street_key(i), [&](std::uint32_t handle) {
      return owned.keys[handle - 1] == street_key(i);
    }) == i + 1);
  }
  CHECK(splits > 0);
  CHECK(moves > splits);
  CHECK(moves < 2500);  // most inserts find an empty slot
  const std::uint64_t before = owned.index.move_stamp();
  REQUIRE(owned.erase(street_key(7)));
  CHECK(owned.index.move_stamp() == before);
  owned.index.clear();
  CHECK(owned.index.move_stamp() != before);
}

TEST_CASE("BlockIndex: a walk in pieces meets every entry once a round, whatever the pieces") {
  OwnedIndex owned(2000);
  for (std::size_t i = 0; i < 1500; ++i) REQUIRE(owned.insert(street_key(i)) == Status::kOk);
  const std::size_t slots = (owned.index.used_bytes() - 64) / BlockIndex::kPageBytes * 512;
  const std::size_t piece = GENERATE(1U, 8U, 24U, 512U, 5000U);
  CAPTURE(piece);
  std::size_t place = 12345;  // beyond the end: as from the start
  std::multiset<std::uint32_t> visited;
  for (std::size_t seen = 0; seen < slots;) {
    const std::size_t asked = std::min(piece, slots - seen);
    const std::size_t looked_at = owned.index.for_some(place, asked, [&](std::uint32_t handle) {
      visited.insert(handle);
      return true;
    });
    REQUIRE((looked_at >= asked && looked_at < asked + BlockIndex::kBucketSlots));
    seen += looked_at;
  }
  CHECK(visited.size() == 1500);
  CHECK(std::set<std::uint32_t>(visited.begin(), visited.end()).size() == 1500);
}

TEST_CASE("BlockIndex: a walk that is stopped goes on at the same bucket") {
  OwnedIndex owned(10);
  for (std::size_t i = 0; i < 10; ++i) REQUIRE(owned.insert(street_key(i)) == Status::kOk);
  std::size_t place = 0;
  std::uint32_t first = 0;
  owned.index.for_some(place, 1000, [&](std::uint32_t handle) {
    first = handle;
    return false;
  });
  const std::size_t stopped_at = place;
  std::uint32_t again = 0;
  owned.index.for_some(place, 1, [&](std::uint32_t handle) {
    again = handle;
    return true;
  });
  CHECK(first != 0);
  CHECK(again == first);
  CHECK(place == stopped_at + 1);
}

TEST_CASE("BlockIndex: clear forgets every key and gives back its pages") {
  OwnedIndex owned(5000);
  const std::size_t fresh = owned.index.used_bytes();
  for (std::size_t i = 0; i < 5000; ++i) REQUIRE(owned.insert(street_key(i)) == Status::kOk);
  owned.index.clear();
  CHECK(owned.index.size() == 0);
  CHECK(owned.index.used_bytes() == fresh);
  for (std::size_t i = 0; i < 5000; ++i) REQUIRE(owned.find(street_key(i)) == 0);
  for (std::size_t i = 0; i < 5000; ++i) REQUIRE(owned.insert(street_key(i)) == Status::kOk);
}

TEST_CASE("BlockIndex: one that was never made holds nothing") {
  BlockIndex index;
  CHECK(index.find({1}, [](std::uint32_t) { return true; }) == 0);
  CHECK_FALSE(index.erase({1}, [](std::uint32_t) { return true; }));
  CHECK(index.make_room({1}).status() == Status::kResourceExhausted);
  index.clear();
  CHECK(index.size() == 0);
}

TEST_CASE("BlockIndex: memory one byte short is refused") {
  OwnedIndex owned(1000);
  const std::span<std::byte> bytes = owned.memory.span();
  Arena arena(bytes.first(bytes.size() - 1));
  CHECK(BlockIndex::make(arena, 1000).status() == Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
