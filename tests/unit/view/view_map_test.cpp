// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "view/view_map.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "support/small_map.hpp"
#include "unit/view/view_messages.hpp"

using namespace tessera;

namespace {

constexpr std::size_t kLeast = kViewHeaderBytes + kMostViewBlockBytes;

/// What a page has: blocks by key, and where it is in the map's changes.
struct Page {
  ViewCursor cursor;
  std::map<std::uint64_t, ReadBlock> blocks;
  std::size_t messages = 0;

  /// Until the round is over; gives the blocks that came.
  std::size_t follow(ViewMap& map, ViewBudget& budget, std::size_t bytes = std::size_t{1} << 16U) {
    std::vector<std::byte> room(bytes);
    std::size_t came = 0;
    for (int i = 0; i < 100'000; ++i) {
      ViewHeader header;
      const std::size_t put = map.put_changes(cursor, header, budget, room);
      REQUIRE(put <= room.size());
      ++messages;
      std::size_t at = kViewHeaderBytes;
      for (std::uint32_t n = 0; n < header.blocks; ++n) {
        const ReadBlock block = read_block(room, at);
        blocks[pack_in_grid(block.coord).bits] = block;
      }
      REQUIRE(at == put);
      came += header.blocks;
      cursor = header.next;
      if (header.round_is_over) return came;
      if (header.deferred) return came;
    }
    FAIL("the round does not end");
    return came;
  }
};

void fill(LocalMap& map, int blocks) {
  map.begin_revision();
  for (int i = 0; i < blocks; ++i)
    REQUIRE(hit(map, {8 * (i % 40), 8 * (i / 40), 3}, 1 + i % 3, 1.0F) == Status::kOk);
}

}  // namespace

TEST_CASE("ViewMap: a page gets all of a map, in messages of any size, and then nothing more") {
  SmallMap small(config_of_pages(4096));
  fill(small.map, 1500);
  REQUIRE(carve(small.map, {5000, 0, 0}) == Status::kOk);  // Without labels: not told.
  for (const std::size_t bytes :
       {kLeast, kLeast + 100, std::size_t{1} << 15U, std::size_t{1} << 20U}) {
    ViewMap map(small.map, {});
    ViewBudget budget(0);
    Page page;
    CHECK(page.follow(map, budget, bytes) == 1500);
    CHECK(page.blocks.size() == 1500);
    CHECK(page.cursor.blocks == 1500);
    CHECK(page.follow(map, budget, bytes) == 0);
    CHECK(page.cursor.blocks == 1500);
  }
}

TEST_CASE("ViewMap: only what has changed comes again") {
  SmallMap small(config_of_pages(4096));
  fill(small.map, 500);
  ViewMap map(small.map, {});
  ViewBudget budget(0);
  Page page;
  page.follow(map, budget);
  small.map.begin_revision();
  REQUIRE(hit(small.map, {0, 0, 4}, 2, 1.0F) == Status::kOk);
  REQUIRE(hit(small.map, {-80, 0, 4}, 2, 1.0F) == Status::kOk);
  CHECK(page.follow(map, budget) == 2);
  CHECK(page.blocks.size() == 501);
  CHECK(page.blocks.at(pack_in_grid({0, 0, 0}).bits).voxels.size() == 2);
  CHECK(page.blocks.at(pack_in_grid({0, 0, 0}).bits).revision == 2);
}

TEST_CASE("ViewMap: what changes while a round is under way is not lost") {
  SmallMap small(config_of_pages(8192));
  fill(small.map, 600);
  ViewMap map(small.map, {});
  ViewBudget budget(0);
  Page page;
  std::vector<std::byte> room(kLeast);
  // A block is changed or opened after every message; enough are opened to split pages of the
  // index.
  for (int i = 0; i < 1200; ++i) {
    ViewHeader header;
    map.put_changes(page.cursor, header, budget, room);
    std::size_t at = kViewHeaderBytes;
    for (std::uint32_t n = 0; n < header.blocks; ++n) {
      const ReadBlock block = read_block(room, at);
      page.blocks[pack_in_grid(block.coord).bits] = block;
    }
    page.cursor = header.next;
    REQUIRE(hit(small.map, {8 * (i % 40), 8 * (i / 40 % 15), 3 + i % 3}, 2, 1.0F) == Status::kOk);
    REQUIRE(hit(small.map, {8 * (i % 40), 800 + 8 * (i / 40), 0}, 1, 1.0F) == Status::kOk);
  }
  // The round at hand, and one after it.
  page.follow(map, budget);
  page.follow(map, budget);
  CHECK(page.blocks.size() == 1800);
  std::size_t voxels = 0;
  for (const auto& [key, block] : page.blocks) voxels += block.voxels.size();
  CHECK(voxels == small.map.usage().label_voxels);
}

TEST_CASE("ViewMap: blocks that left the map are missing among its keys") {
  SmallMap small(config_of_pages(4096));
  fill(small.map, 700);
  ViewMap map(small.map, {});
  ViewBudget budget(0);
  Page page;
  page.follow(map, budget);
  small.map.remove_block(small.map.find_handle({0, 0, 0}));
  CHECK(page.follow(map, budget) == 0);
  CHECK(page.cursor.blocks == 699);
  std::set<std::uint64_t> keys;
  std::uint64_t next = 0;
  std::vector<std::byte> room(8 * (1 + MapReader::kPageBlocks));
  do {
    const std::size_t bytes = map.put_keys(next, budget, room);
    REQUIRE(bytes % 8 == 0);
    for (std::size_t at = 8; at < bytes; at += 8) keys.insert(read_at<std::uint64_t>(room, at));
    next = read_at<std::uint64_t>(room, 0);
  } while (next != 0);
  CHECK(keys.size() == 699);
  CHECK_FALSE(keys.contains(pack_in_grid({0, 0, 0}).bits));
}

TEST_CASE("ViewMap: a cleared map has no blocks, and what is new comes") {
  SmallMap small(config_of_pages(4096));
  fill(small.map, 100);
  ViewMap map(small.map, {});
  ViewBudget budget(0);
  Page page;
  page.follow(map, budget);
  small.map.clear();
  CHECK(page.follow(map, budget) == 0);
  CHECK(page.cursor.blocks == 0);
  fill(small.map, 30);
  CHECK(page.follow(map, budget) == 30);
}

TEST_CASE("ViewMap: any cursor ends") {
  SmallMap small(config_of_pages(4096));
  fill(small.map, 900);
  ViewMap map(small.map, {});
  ViewBudget budget(0);
  const std::uint64_t most = ~std::uint64_t{0};
  for (const ViewCursor& cursor :
       {ViewCursor{most, most, most, 0xffff'ffffU, 0xffff'ffffU}, ViewCursor{0, 1, most, 0, 0},
        ViewCursor{0, most, 300, 0, 17}, ViewCursor{most, 0, 5, 5, 5},
        ViewCursor{0, 1, 0, 1U << 31U, 0}}) {
    Page page;
    page.cursor = cursor;
    page.follow(map, budget, kLeast);
    CHECK(page.messages < 2000);
  }
}

TEST_CASE("ViewBudget: so many voxels a second, and what is left comes later") {
  SmallMap small(config_of_pages(4096));
  fill(small.map, 1000);
  ViewMap map(small.map, {});
  ViewBudget budget(200);
  Page page;
  std::int64_t now_us = 1'000'000'000;
  CHECK(page.follow(map, budget) == 0);  // Nothing is saved up before time has begun.
  int seconds = 0;
  for (; page.blocks.size() < 1000 && seconds < 20; ++seconds) {
    budget.renew(now_us += 1'000'000);
    CHECK(page.follow(map, budget) <= 201);
  }
  CHECK(seconds >= 5);
  CHECK(page.blocks.size() == 1000);
  budget.renew(now_us += 3'600'000'000);  // An hour saves up a second's worth.
  Page other;
  CHECK(other.follow(map, budget) <= 201);
  budget.renew(now_us - 1'000'000);  // A clock that goes back gives nothing.
  CHECK(other.follow(map, budget) == 0);
}
