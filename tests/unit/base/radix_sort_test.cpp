// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// radix_sort orders as std::stable_sort does, whatever the keys.
#include "tessera/base/internal/radix_sort.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

/// Items with these keys, numbered in their order.
std::vector<KeyedIndex> numbered(const std::vector<std::uint64_t>& keys) {
  std::vector<KeyedIndex> items;
  for (const std::uint64_t key : keys)
    items.push_back({key, static_cast<std::uint32_t>(items.size())});
  return items;
}

/// True iff radix_sort gives what std::stable_sort gives.
bool sorts_stably(std::vector<KeyedIndex> items) {
  std::vector<KeyedIndex> expected = items;
  std::stable_sort(expected.begin(), expected.end(),
                   [](const KeyedIndex& a, const KeyedIndex& b) { return a.key < b.key; });
  std::vector<KeyedIndex> scratch(items.size());
  radix_sort(items, scratch);
  return std::equal(items.begin(), items.end(), expected.begin(), expected.end(),
                    [](const KeyedIndex& a, const KeyedIndex& b) {
                      return a.key == b.key && a.index == b.index;
                    });
}

TEST_CASE("radix_sort: nothing, one item and two items") {
  CHECK(sorts_stably({}));
  CHECK(sorts_stably(numbered({5})));
  CHECK(sorts_stably(numbered({2, 1})));
  CHECK(sorts_stably(numbered({1, 2})));
}

TEST_CASE("radix_sort: equal keys keep their order") {
  CHECK(sorts_stably(numbered(std::vector<std::uint64_t>(1000, 42))));
  CHECK(sorts_stably(numbered({3, 1, 3, 1, 3, 2, 2, 1})));
}

TEST_CASE("radix_sort: random keys of every width sort as std::stable_sort does") {
  constexpr std::uint64_t kSeed = 2;
  oracle::Random random(kSeed);
  for (unsigned width = 1; width <= 64; ++width) {
    INFO("seed " << kSeed << ", keys of " << width << " bits");
    std::vector<std::uint64_t> keys(700);
    for (std::uint64_t& key : keys) key = random.bits() >> (64 - width);
    REQUIRE(sorts_stably(numbered(keys)));
  }
}

TEST_CASE("radix_sort: keys that differ in one byte only, low or high") {
  constexpr std::uint64_t kSeed = 3;
  oracle::Random random(kSeed);
  for (unsigned shift = 0; shift < 64; shift += 8) {
    INFO("seed " << kSeed << ", byte at bit " << shift);
    std::vector<std::uint64_t> keys(300);
    for (std::uint64_t& key : keys) {
      key = 0x1122334455667788U ^ ((random.bits() & 0xffU) << shift);
    }
    REQUIRE(sorts_stably(numbered(keys)));
  }
}

TEST_CASE("radix_sort: keys with the highest bit sort as unsigned numbers, last") {
  CHECK(sorts_stably(
      numbered({~std::uint64_t{0}, 0, std::uint64_t{1} << 63U, 1, 0x7fffffffffffffffU})));
}

TEST_CASE("radix_sort: an odd number of passes ends in the items, not in the scratch") {
  for (const std::uint64_t stride : {1U, 0x101U, 0x10101U}) {
    std::vector<std::uint64_t> keys;
    for (std::uint64_t i = 0; i < 200; ++i) keys.push_back(((i * 37) % 200) * stride);
    CHECK(sorts_stably(numbered(keys)));
  }
}

TEST_CASE("radix_sort: scratch beyond the items' number is not touched") {
  std::vector<KeyedIndex> items = numbered({9, 3, 500, 70000});
  std::vector<KeyedIndex> scratch(6, KeyedIndex{77, 78});
  radix_sort(items, scratch);
  CHECK(items.back().key == 70000);
  CHECK((scratch[4].key == 77 && scratch[5].index == 78));
}

}  // namespace
}  // namespace tessera
