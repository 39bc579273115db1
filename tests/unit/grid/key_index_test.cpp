// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The index does what std::unordered_map does, in fixed memory, up to its capacity.
#include "tessera/grid/internal/key_index.hpp"

#include <catch2/catch.hpp>
#include <unordered_map>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

/// An index with memory of exactly its size.
struct OwnedIndex {
  explicit OwnedIndex(std::size_t capacity) : memory(KeyIndex::required_bytes(capacity)) {
    Arena arena = memory.arena();
    const Result<KeyIndex> made = KeyIndex::make(arena, capacity);
    REQUIRE(made.ok());
    REQUIRE(arena.remaining_bytes() == 0);
    index = *made;
  }
  AlignedMemory memory;
  KeyIndex index;
};

using Model = std::unordered_map<std::uint64_t, std::uint32_t>;

/// True iff the index holds exactly what the model holds.
bool agrees(const KeyIndex& index, const Model& model) {
  if (index.size() != model.size()) return false;
  for (const auto& [bits, value] : model) {
    if (index.find(BlockKey{bits}) != value) return false;
  }
  std::size_t visited = 0;
  bool known = true;
  index.for_each([&](BlockKey key, std::uint32_t value) {
    ++visited;
    const auto entry = model.find(key.bits);
    known = known && entry != model.end() && entry->second == value;
  });
  return known && visited == model.size();
}

// The bound on work is fixed by construction: two buckets of five, and a search two moves deep.
static_assert(KeyIndex::kMaxProbes == 2 * KeyIndex::kBucketSlots && KeyIndex::kMaxProbes == 10);
static_assert(KeyIndex::kMaxSearched == 2 + 2 * 5 + 2 * 5 * 5);
static_assert(KeyIndex::required_bytes(0) == 2 * 64);
static_assert(KeyIndex::required_bytes(1000) == (1000 / 4 + 2) * 64);

TEST_CASE("KeyIndex: without memory it holds nothing and takes nothing") {
  KeyIndex index;
  CHECK_FALSE(index.find(BlockKey{7}).has_value());
  CHECK(index.insert(BlockKey{7}, 1) == Status::kResourceExhausted);
  CHECK_FALSE(index.erase(BlockKey{7}));
  CHECK(index.size() == 0);
}

TEST_CASE("KeyIndex: memory one cache line short is refused, exact memory is enough") {
  AlignedMemory memory(KeyIndex::required_bytes(100));
  Arena short_arena(memory.span().first(memory.span().size() - 1));
  CHECK(KeyIndex::make(short_arena, 100).status() == Status::kResourceExhausted);
  Arena arena = memory.arena();
  CHECK(KeyIndex::make(arena, 100).ok());
}

TEST_CASE("KeyIndex: a new index is empty, whatever was in its memory") {
  AlignedMemory memory(KeyIndex::required_bytes(10));
  memory.fill(std::byte{0x5a});
  Arena arena = memory.arena();
  const Result<KeyIndex> index = KeyIndex::make(arena, 10);
  REQUIRE(index.ok());
  CHECK(agrees(*index, {}));
  CHECK(index->capacity() == 10);
}

TEST_CASE("KeyIndex: the smallest and the largest key of the grid are keys like others") {
  OwnedIndex owned(10);
  for (const std::uint64_t bits : {std::uint64_t{0}, std::uint64_t{0x7fffffffffffffffU}}) {
    CHECK_FALSE(owned.index.find(BlockKey{bits}).has_value());
    REQUIRE(owned.index.insert(BlockKey{bits}, 3) == Status::kOk);
    CHECK(owned.index.find(BlockKey{bits}) == 3U);
  }
}

TEST_CASE("KeyIndex: a value of zero is a value") {
  OwnedIndex owned(4);
  REQUIRE(owned.index.insert(pack_in_grid({-1, -1, -1}), 0) == Status::kOk);
  CHECK(owned.index.find(pack_in_grid({-1, -1, -1})) == 0U);
}

TEST_CASE("KeyIndex: erasing a key that is absent changes nothing and says so") {
  OwnedIndex owned(4);
  REQUIRE(owned.index.insert(pack_in_grid({1, 2, 3}), 9) == Status::kOk);
  CHECK_FALSE(owned.index.erase(pack_in_grid({3, 2, 1})));
  CHECK(agrees(owned.index, {{pack_in_grid({1, 2, 3}).bits, 9}}));
}

TEST_CASE("KeyIndex: holds capacity - 1 and capacity keys, refuses capacity + 1 unchanged") {
  for (const std::size_t capacity : {0U, 1U, 2U, 3U, 4U, 5U, 31U, 200U}) {
    INFO("capacity " << capacity);
    OwnedIndex owned(capacity);
    Model model;
    for (std::size_t i = 0; i < capacity; ++i) {
      const BlockKey key = pack_in_grid({static_cast<std::int32_t>(i) - 3, -7, 2});
      REQUIRE(owned.index.insert(key, static_cast<std::uint32_t>(i)) == Status::kOk);
      model[key.bits] = static_cast<std::uint32_t>(i);
      REQUIRE(agrees(owned.index, model));
    }
    CHECK(owned.index.insert(pack_in_grid({0, 0, 0}), 1) == Status::kResourceExhausted);
    CHECK(agrees(owned.index, model));
  }
}

TEST_CASE("KeyIndex: a full index takes a key again once one was erased") {
  OwnedIndex owned(50);
  for (std::int32_t i = 0; i < 50; ++i) {
    REQUIRE(owned.index.insert(pack_in_grid({i, 0, 0}), 1) == Status::kOk);
  }
  REQUIRE(owned.index.erase(pack_in_grid({20, 0, 0})));
  CHECK(owned.index.insert(pack_in_grid({50, 0, 0}), 2) == Status::kOk);
  CHECK(owned.index.find(pack_in_grid({50, 0, 0})) == 2U);
  CHECK_FALSE(owned.index.find(pack_in_grid({20, 0, 0})).has_value());
}

TEST_CASE("KeyIndex: clear forgets every key") {
  OwnedIndex owned(50);
  for (std::int32_t i = 0; i < 50; ++i) {
    REQUIRE(owned.index.insert(pack_in_grid({i, -i, 0}), 1) == Status::kOk);
  }
  owned.index.clear();
  CHECK(agrees(owned.index, {}));
  CHECK(owned.index.insert(pack_in_grid({1, -1, 0}), 4) == Status::kOk);
}

TEST_CASE("KeyIndex: random keys fill it to capacity without a refusal") {
  for (const std::uint64_t seed : {11U, 12U, 13U, 14U, 15U}) {
    for (const std::size_t capacity : {100U, 1000U, 30000U}) {
      INFO("seed " << seed << ", capacity " << capacity);
      oracle::Random random(seed);
      OwnedIndex owned(capacity);
      Model model;
      while (model.size() < capacity) {
        const std::uint64_t bits = random.bits() >> 1U;
        if (!model.emplace(bits, static_cast<std::uint32_t>(bits)).second) continue;
        REQUIRE(owned.index.insert(BlockKey{bits}, static_cast<std::uint32_t>(bits)) ==
                Status::kOk);
      }
      CHECK(agrees(owned.index, model));
    }
  }
}

TEST_CASE(
    "KeyIndex: the blocks of a street, side by side on both sides of zero, fill it to capacity") {
  constexpr std::int32_t kHalf = 20;
  OwnedIndex owned(std::size_t{4} * kHalf * kHalf * 6);
  Model model;
  for (std::int32_t z = -3; z < 3; ++z) {
    for (std::int32_t y = -kHalf; y < kHalf; ++y) {
      for (std::int32_t x = -kHalf; x < kHalf; ++x) {
        const BlockKey key = pack_in_grid({x, y, z});
        const auto value = static_cast<std::uint32_t>(model.size());
        REQUIRE(owned.index.insert(key, value) == Status::kOk);
        model[key.bits] = value;
      }
    }
  }
  CHECK(model.size() == owned.index.capacity());
  CHECK(agrees(owned.index, model));
}

TEST_CASE("KeyIndex: agrees with std::unordered_map through random inserts, finds and erases") {
  for (const std::uint64_t seed : {21U, 22U, 23U}) {
    INFO("seed " << seed);
    oracle::Random random(seed);
    constexpr std::size_t kCapacity = 60;
    OwnedIndex owned(kCapacity);
    Model model;
    for (int step = 0; step < 6000; ++step) {
      INFO("step " << step);
      const BlockKey key =
          pack_in_grid({random.below(5) - 2, random.below(5) - 2, random.below(5) - 2});
      const auto value = static_cast<std::uint32_t>(random.bits());
      const bool present = model.count(key.bits) == 1;
      REQUIRE(owned.index.find(key).has_value() == present);
      if (random.below(3) == 0) {
        REQUIRE(owned.index.erase(key) == present);
        model.erase(key.bits);
      } else if (!present) {
        const Status expected = model.size() < kCapacity ? Status::kOk : Status::kResourceExhausted;
        REQUIRE(owned.index.insert(key, value) == expected);
        if (expected == Status::kOk) model[key.bits] = value;
      }
      REQUIRE(agrees(owned.index, model));
    }
  }
}

TEST_CASE("KeyIndex: some buckets at a time, every key is met once a round") {
  for (const std::size_t buckets : {1U, 7U, 52U, 1000U}) {
    OwnedIndex owned(200);  // 52 buckets
    Model model;
    for (std::uint64_t key = 0; key < 150; ++key) {
      REQUIRE(owned.index.insert(BlockKey{key}, static_cast<std::uint32_t>(key + 7)) ==
              Status::kOk);
      model[key] = static_cast<std::uint32_t>(key + 7);
    }
    std::size_t place = 0;
    Model met;
    for (std::size_t seen = 0; seen < 52; seen += buckets) {
      const std::size_t left = 52 - seen;
      owned.index.for_some(
          place, buckets < left ? buckets : left,
          [&](BlockKey key, std::uint32_t value) { CHECK(met.emplace(key.bits, value).second); });
    }
    CHECK(met == model);
    owned.index.for_some(place, buckets, [&](BlockKey key, std::uint32_t) { met.erase(key.bits); });
    CHECK(met.size() < model.size());  // around the end
  }
}

}  // namespace
}  // namespace tessera
