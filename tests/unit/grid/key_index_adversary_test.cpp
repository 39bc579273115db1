// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Keys chosen by somebody who knows the hash cannot make the index slow or wrong: they are refused,
// and nothing else.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <vector>

#include "tessera/grid/internal/key_index.hpp"

namespace tessera {
namespace {

constexpr std::size_t kCapacity = 64;
constexpr std::uint32_t kBuckets = KeyIndex::required_bytes(kCapacity) / 64;

/// The two buckets of a key, computed as an attacker would who has read the index's source.
std::array<std::uint32_t, 2> buckets_of(BlockKey key) {
  const std::uint64_t hash = mix64(key.bits + 0x9e3779b97f4a7c15U);
  const auto scale = [](std::uint64_t part) {
    return static_cast<std::uint32_t>((part * kBuckets) >> 32U);
  };
  const std::uint32_t first = scale(hash & 0xffffffffU);
  const std::uint32_t second = scale(hash >> 32U);
  return {first, second != first ? second : (second + 1) % kBuckets};
}

/// The first count keys, from (0, 0, 0) on along x, whose buckets are both among those given.
std::vector<BlockKey> colliding_keys(const std::vector<std::uint32_t>& among, std::size_t count) {
  const auto is_among = [&](std::uint32_t bucket) {
    return std::find(among.begin(), among.end(), bucket) != among.end();
  };
  std::vector<BlockKey> keys;
  for (std::int32_t x = -kBlockLimit; keys.size() < count; ++x) {
    const BlockKey key = pack_in_grid({x, -1, 0});
    const auto [first, second] = buckets_of(key);
    if (is_among(first) && is_among(second)) keys.push_back(key);
  }
  return keys;
}

struct Attacked {
  explicit Attacked(const std::vector<std::uint32_t>& among)
      : slots(among.size() * KeyIndex::kBucketSlots), keys(colliding_keys(among, slots + 20)) {
    Arena arena(memory);
    const Result<KeyIndex> made = KeyIndex::make(arena, kCapacity);
    REQUIRE(made.ok());
    index = *made;
    for (std::size_t i = 0; i < slots; ++i) {
      INFO("key " << i << " of " << slots);
      REQUIRE(index.insert(keys[i], static_cast<std::uint32_t>(i)) == Status::kOk);
    }
  }
  /// True iff the keys that filled the buckets, and no others, are there with their values.
  [[nodiscard]] bool intact() const {
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const std::optional<std::uint32_t> found = index.find(keys[i]);
      if (found.has_value() != (i < slots)) return false;
      if (i < slots && *found != i) return false;
    }
    std::size_t visited = 0;
    index.for_each([&](BlockKey, std::uint32_t) { ++visited; });
    return index.size() == slots && visited == slots;
  }

  std::size_t slots;
  std::vector<BlockKey> keys;
  alignas(kArenaAlignment) std::array<std::byte, KeyIndex::required_bytes(kCapacity)> memory{};
  KeyIndex index;
};

TEST_CASE("KeyIndex: keys made to collide by one seed do not by another") {
  const std::uint64_t seed = GENERATE(1U, 2U, 0x5eedU);
  alignas(kArenaAlignment) std::array<std::byte, KeyIndex::required_bytes(kCapacity)> memory{};
  Arena arena(memory);
  KeyIndex index = *KeyIndex::make(arena, kCapacity, seed);
  for (const BlockKey key : colliding_keys({3, 7}, 30)) CHECK(index.insert(key, 1) == Status::kOk);
}

TEST_CASE(
    "KeyIndex: keys that share both buckets are refused once these are full, far below capacity") {
  Attacked attacked({3, 7});
  REQUIRE(attacked.index.size() < attacked.index.capacity());
  CHECK(attacked.index.insert(attacked.keys[attacked.slots], 99) == Status::kResourceExhausted);
  CHECK(attacked.intact());
}

TEST_CASE("KeyIndex: refusing again and again leaves the index unchanged") {
  Attacked attacked({0, 17});
  for (std::size_t i = attacked.slots; i < attacked.keys.size(); ++i) {
    REQUIRE(attacked.index.insert(attacked.keys[i], 99) == Status::kResourceExhausted);
    REQUIRE(attacked.intact());
  }
}

TEST_CASE("KeyIndex: keys confined to a larger set of buckets fill it, then are refused") {
  Attacked attacked({1, 4, 9, 16});
  CHECK(attacked.index.insert(attacked.keys[attacked.slots], 99) == Status::kResourceExhausted);
  CHECK(attacked.intact());
}

TEST_CASE("KeyIndex: other keys still find a place beside the buckets under attack") {
  Attacked attacked({3, 7});
  std::size_t placed = 0;
  for (std::int32_t x = 0; placed < 30; ++x) {
    const BlockKey key = pack_in_grid({x, 1, 1});
    const auto [first, second] = buckets_of(key);
    if (first == 3 || first == 7 || second == 3 || second == 7) continue;
    REQUIRE(attacked.index.insert(key, 1) == Status::kOk);
    ++placed;
  }
  for (std::size_t i = 0; i < attacked.slots; ++i) {
    CHECK(attacked.index.find(attacked.keys[i]) == static_cast<std::uint32_t>(i));
  }
}

TEST_CASE("KeyIndex: a key that was refused is taken once one of its rivals is erased") {
  Attacked attacked({3, 7});
  REQUIRE(attacked.index.erase(attacked.keys[4]));
  CHECK(attacked.index.insert(attacked.keys[attacked.slots], 99) == Status::kOk);
  CHECK(attacked.index.find(attacked.keys[attacked.slots]) == 99U);
  CHECK(attacked.index.insert(attacked.keys[4], 4) == Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
