// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The pool gives zeroed items that never overlap, takes them back, and knows exactly what would
// still fit.
#include "tessera/grid/internal/slab_pool.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <map>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

constexpr std::array<std::uint32_t, SlabPool::kMaxSizes> kSizes{32, 320, 512, 1376};
constexpr std::array<std::uint32_t, SlabPool::kMaxSizes> kPerPage{128, 12, 8, 2};

struct alignas(kArenaAlignment) Page {
  std::array<std::byte, SlabPool::kPageBytes> bytes{};
};

/// A pool over pages of its own, which start out full of rubbish.
struct OwnedPool {
  explicit OwnedPool(std::size_t page_count) : pages(page_count) {
    for (Page& page : pages) page.bytes.fill(std::byte{0xcd});
    pool = SlabPool(std::as_writable_bytes(std::span(pages)), kSizes);
  }
  [[nodiscard]] std::span<std::byte> item(int size, SlabHandle handle) const {
    return {pool.at(handle), kSizes[static_cast<std::size_t>(size)]};
  }
  std::vector<Page> pages;
  SlabPool pool;
};

/// How many items of a size the pool gives before it refuses.
std::uint32_t allocate_all(SlabPool& pool, int size) {
  std::uint32_t count = 0;
  while (pool.allocate(size).ok()) ++count;
  return count;
}

bool all_are(std::span<const std::byte> bytes, std::byte value) {
  return std::all_of(bytes.begin(), bytes.end(), [=](std::byte b) { return b == value; });
}

TEST_CASE("SlabPool: a page gives as many items as fit in it, for every size") {
  for (int size = 0; size < SlabPool::kMaxSizes; ++size) {
    INFO("size " << size);
    OwnedPool owned(3);
    CHECK(allocate_all(owned.pool, size) == 3 * kPerPage[static_cast<std::size_t>(size)]);
    CHECK(owned.pool.items(size) == 3 * kPerPage[static_cast<std::size_t>(size)]);
    CHECK(owned.pool.used_bytes() == owned.pool.capacity_bytes());
  }
}

TEST_CASE("SlabPool: one item below, at and above the capacity") {
  OwnedPool owned(1);
  for (std::uint32_t i = 0; i + 1 < kPerPage[2]; ++i) REQUIRE(owned.pool.allocate(2).ok());
  CHECK(owned.pool.refused() == 0);
  CHECK(owned.pool.allocate(2).ok());
  CHECK(owned.pool.allocate(2).status() == Status::kResourceExhausted);
  CHECK(owned.pool.items(2) == kPerPage[2]);
}

TEST_CASE("SlabPool: every refusal is counted, and a success is not") {
  OwnedPool owned(1);
  REQUIRE(owned.pool.allocate(0).ok());
  for (int i = 1; i <= 3; ++i) {
    REQUIRE_FALSE(owned.pool.allocate(1).ok());
    CHECK(owned.pool.refused() == static_cast<std::uint64_t>(i));
  }
  REQUIRE(owned.pool.allocate(0).ok());
  CHECK(owned.pool.refused() == 3);
}

TEST_CASE("SlabPool: without a whole page there is nothing to give") {
  alignas(kArenaAlignment) std::array<std::byte, SlabPool::kPageBytes> page{};
  SlabPool pool(std::span<std::byte>(page).first(SlabPool::kPageBytes - 1), kSizes);
  CHECK(pool.allocate(0).status() == Status::kResourceExhausted);
  CHECK(pool.used_bytes() == 0);
}

TEST_CASE("SlabPool: items are zeroed, fresh and reused") {
  OwnedPool owned(1);
  const SlabHandle first = *owned.pool.allocate(1);
  CHECK(all_are(owned.item(1, first), std::byte{0}));
  std::fill_n(owned.pool.at(first), kSizes[1], std::byte{0xff});
  owned.pool.release(1, first);
  const SlabHandle again = *owned.pool.allocate(1);
  CHECK(all_are(owned.item(1, again), std::byte{0}));
}

TEST_CASE("SlabPool: no item has the handle zero, which means none") {
  OwnedPool owned(2);
  for (int i = 0; i < 16; ++i) CHECK(*owned.pool.allocate(2) != 0);
}

TEST_CASE("SlabPool: a released item is used again before a page is taken") {
  OwnedPool owned(4);
  std::vector<SlabHandle> handles;
  for (std::uint32_t i = 0; i < kPerPage[3]; ++i) handles.push_back(*owned.pool.allocate(3));
  const std::size_t used_bytes = owned.pool.used_bytes();
  for (int cycle = 0; cycle < 100; ++cycle) {
    for (const SlabHandle handle : handles) owned.pool.release(3, handle);
    CHECK(owned.pool.items(3) == 0);
    for (SlabHandle& handle : handles) handle = *owned.pool.allocate(3);
  }
  CHECK(owned.pool.used_bytes() == used_bytes);
}

TEST_CASE("SlabPool: a page stays with the size it was first needed for") {
  OwnedPool owned(1);
  const SlabHandle handle = *owned.pool.allocate(0);
  owned.pool.release(0, handle);
  CHECK_FALSE(owned.pool.allocate(1).ok());
  CHECK(owned.pool.allocate(0).ok());
}

TEST_CASE("SlabPool: clear forgets everything, the refusals too") {
  OwnedPool owned(2);
  allocate_all(owned.pool, 1);
  owned.pool.clear();
  CHECK(owned.pool.used_bytes() == 0);
  CHECK(owned.pool.items(1) == 0);
  CHECK(owned.pool.refused() == 0);
  CHECK(allocate_all(owned.pool, 3) == 2 * kPerPage[3]);
}

TEST_CASE("SlabPool: what fits when it is empty does not depend on what is in use") {
  OwnedPool owned(3);
  allocate_all(owned.pool, 0);
  CHECK_FALSE(owned.pool.fits({1, 0, 0, 0}));
  CHECK(owned.pool.fits_empty({}));
  CHECK(owned.pool.fits_empty({3 * kPerPage[0], 0, 0, 0}));
  CHECK_FALSE(owned.pool.fits_empty({3 * kPerPage[0] + 1, 0, 0, 0}));
  CHECK(owned.pool.fits_empty({1, 1, kPerPage[2], 0}));
  CHECK_FALSE(owned.pool.fits_empty({1, 1, kPerPage[2], 1}));
}

TEST_CASE("SlabPool: fits without anything wanted, however full") {
  OwnedPool owned(1);
  allocate_all(owned.pool, 2);
  CHECK(owned.pool.fits({}));
  CHECK_FALSE(owned.pool.fits({0, 0, 1, 0}));
}

TEST_CASE("SlabPool: fits says what allocating shows, in pools with any past") {
  constexpr std::uint64_t kSeed = 31;
  oracle::Random random(kSeed);
  int fitted = 0;
  for (int round = 0; round < 3000; ++round) {
    INFO("seed " << kSeed << ", round " << round);
    OwnedPool owned(static_cast<std::size_t>(random.below(7)));
    std::array<std::vector<SlabHandle>, SlabPool::kMaxSizes> live;
    for (int step = random.below(60); step > 0; --step) {
      const int size = random.below(SlabPool::kMaxSizes);
      auto& handles = live[static_cast<std::size_t>(size)];
      if (!handles.empty() && random.below(3) == 0) {
        owned.pool.release(size, handles.back());
        handles.pop_back();
      } else if (const Result<SlabHandle> handle = owned.pool.allocate(size); handle.ok()) {
        handles.push_back(*handle);
      }
    }
    SlabPool::Counts wanted{};
    for (std::size_t size = 0; size < wanted.size(); ++size) {
      wanted[size] = static_cast<std::uint32_t>(random.below(static_cast<int>(kPerPage[size]) + 4));
      if (random.below(2) == 0) wanted[size] = 0;
    }
    const bool said = owned.pool.fits(wanted);
    bool all = true;
    for (std::size_t size = 0; size < wanted.size(); ++size) {
      for (std::uint32_t i = 0; i < wanted[size]; ++i) {
        all = owned.pool.allocate(static_cast<int>(size)).ok() && all;
      }
    }
    REQUIRE(said == all);
    fitted += said ? 1 : 0;
  }
  CHECK((fitted > 500 && fitted < 2500));
}

TEST_CASE("SlabPool: items never overlap, through random allocations and releases") {
  constexpr std::uint64_t kSeed = 32;
  oracle::Random random(kSeed);
  OwnedPool owned(12);
  struct Live {
    int size = 0;
    std::byte pattern{};
  };
  std::map<SlabHandle, Live> live;
  for (int step = 0; step < 5000; ++step) {
    INFO("seed " << kSeed << ", step " << step);
    if (!live.empty() && random.below(2) == 0) {
      const auto victim = std::next(live.begin(), random.below(static_cast<int>(live.size())));
      REQUIRE(all_are(owned.item(victim->second.size, victim->first), victim->second.pattern));
      owned.pool.release(victim->second.size, victim->first);
      live.erase(victim);
      continue;
    }
    const int size = random.below(SlabPool::kMaxSizes);
    const Result<SlabHandle> handle = owned.pool.allocate(size);
    if (!handle.ok()) continue;
    const auto pattern = static_cast<std::byte>(1 + random.below(255));
    const std::span<std::byte> item = owned.item(size, *handle);
    REQUIRE(all_are(item, std::byte{0}));
    std::fill(item.begin(), item.end(), pattern);
    REQUIRE(live.emplace(*handle, Live{size, pattern}).second);
  }
  for (const auto& [handle, what] : live) {
    CHECK(all_are(owned.item(what.size, handle), what.pattern));
  }
}

}  // namespace
}  // namespace tessera
