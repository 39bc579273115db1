// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A full map: what does not fit is refused with a status and counted, and the map stays as it was,
// to the last voxel.
#include <catch2/catch.hpp>

#include "support/small_map.hpp"

namespace tessera {
namespace {

/// A map of 4 pages: one of blocks, the others full of the free pages of 24 blocks.
SmallMap full_of_free_pages() {
  SmallMap small(config_of_pages(4));
  for (std::int32_t i = 0; i < 24; ++i) carve_layers(small.map, {8 * i - 96, -1, 8});
  return small;
}

TEST_CASE("full map: a block that the index has no place for is refused and counted") {
  SmallMap small(config_of_pages(4));
  const auto capacity = static_cast<std::int32_t>(max_blocks(small.map.config()));
  for (std::int32_t i = 0; i < capacity; ++i) {
    REQUIRE(small.map.open_block({i - 10, -i, 3}).ok());
  }
  const Content before = content_of(small.map);
  CHECK(small.map.open_block({5, 5, 5}).status() == Status::kResourceExhausted);
  CHECK(content_of(small.map) == before);
  CHECK(small.map.usage().blocks_refused == 1);
  CHECK(small.map.usage().blocks == static_cast<std::uint64_t>(capacity));
}

TEST_CASE("full map: blocks it has are opened again, however full") {
  SmallMap small(config_of_pages(4));
  std::int32_t i = 0;
  while (small.map.open_block({i, 0, -1}).ok()) ++i;
  for (std::int32_t k = 0; k < i; ++k) CHECK(small.map.open_block({k, 0, -1}).ok());
  CHECK(small.map.usage().blocks_refused == 1);
}

TEST_CASE("full map: a block that the storage has no place for is refused and counted") {
  SmallMap small(config_of_pages(9));  // one page of 64 blocks, and 8 pages of 32 free pages
  for (std::int32_t i = 0; i < 64; ++i) carve_layers(small.map, {8 * i - 256, 7, -8});
  REQUIRE(max_blocks(small.map.config()) > 64);
  const Content before = content_of(small.map);
  CHECK(small.map.open_block({0, 1, 0}).status() == Status::kResourceExhausted);
  CHECK(content_of(small.map) == before);
  CHECK(small.map.usage().blocks_refused == 1);
  CHECK(small.map.usage().storage_refused == 1);
}

TEST_CASE("full map: a refused block takes no storage, and the peak is never under what is used") {
  MapConfig config = config_of_pages(4);
  while (max_blocks(config) < 128)
    config.storage_bytes += 16;  // the index holds exactly two pages of blocks
  SmallMap small(config);
  for (std::int32_t i = 0; i < 128; ++i) REQUIRE(small.map.open_block({i, 0, 0}).ok());
  const MapUsage before = small.map.usage();
  REQUIRE(small.map.open_block({-1, 0, 0}).status() == Status::kResourceExhausted);
  CHECK(small.map.usage().used_bytes == before.used_bytes);
  CHECK(small.map.usage().peak_bytes >= small.map.usage().used_bytes);
}

TEST_CASE("full map: labels are refused where no label page fits, and counted") {
  SmallMap small = full_of_free_pages();
  const Content before = content_of(small.map);
  CHECK(hit(small.map, {0, -1, 8}, 1, 1.0F) == Status::kResourceExhausted);
  CHECK(content_of(small.map) == before);
  CHECK(small.map.usage().storage_refused == 1);
}

TEST_CASE("full map: labels are refused where no octet fits, and counted") {
  SmallMap small(config_of_pages(4), kMaxClasses);  // octets of 2048 bytes, two a page
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) == Status::kOk);
  REQUIRE(hit(small.map, {2, 0, 0}, 2, 1.0F) == Status::kOk);
  REQUIRE(hit(small.map, {-1, 0, 0}, 3, 1.0F) == Status::kOk);
  REQUIRE(hit(small.map, {-3, 0, 0}, 4, 1.0F) == Status::kOk);
  const Content before = content_of(small.map);
  CHECK(hit(small.map, {4, 0, 0}, 5, 1.0F) == Status::kResourceExhausted);
  CHECK(content_of(small.map) == before);
  CHECK(small.map.usage().storage_refused == 1);
}

TEST_CASE("full map: labels for an octet that exists are taken, however full") {
  SmallMap small(config_of_pages(4), kMaxClasses);
  std::int32_t x = 0;
  while (hit(small.map, {2 * x, 0, 0}, 1, 1.0F) == Status::kOk) ++x;
  REQUIRE(x == 4);
  CHECK(hit(small.map, {1, 1, 1}, kMaxClasses + 1, 2.0F) == Status::kOk);
  CHECK(label_evidence(small.map, {1, 1, 1}) == 2.0);
}

TEST_CASE("full map: refused labels leave the storage to others") {
  SmallMap small(config_of_pages(4));
  for (std::int32_t i = 0; i < 33; ++i) REQUIRE(carve(small.map, {8 * i, 0, 0}) == Status::kOk);
  const SlabPool::Counts rest{0, 0, 63, 0};  // 31 on the second page, 32 on the last
  REQUIRE(small.map.fits(rest));
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) ==
          Status::kResourceExhausted);  // a label page, but no octet
  CHECK(small.map.fits(rest));
  CHECK(small.map.usage().peak_bytes >= small.map.usage().used_bytes);
}

TEST_CASE("full map: a free pass is refused where no free page fits, and counted") {
  SmallMap small = full_of_free_pages();
  REQUIRE(small.map.open_block({50, 0, 0}).ok());
  const Content before = content_of(small.map);
  CHECK(carve(small.map, {400, 0, 0}) == Status::kResourceExhausted);
  CHECK(content_of(small.map) == before);
  CHECK(small.map.usage().storage_refused == 1);
}

TEST_CASE("full map: free passes of blocks with a free page are taken, however full") {
  SmallMap small = full_of_free_pages();
  REQUIRE(carve(small.map, {400, 0, 0}) == Status::kResourceExhausted);
  CHECK(carve(small.map, {-96, -2, 9}) == Status::kOk);
  CHECK(small.map.evidence(VoxelCoord{-96, -2, 9}).sigma[0] == 0.4F);
}

TEST_CASE("full map: with few classes too it is the storage that ends, not the index") {
  SmallMap small(config_of_pages(256), 1);
  std::int32_t i = 0;
  while (hit(small.map, {8 * (i % 64) - 256, 8 * (i / 64) - 256, -8}, 1, 1.0F) == Status::kOk) ++i;
  CHECK(small.map.usage().storage_refused == 1);
}

TEST_CASE("full map: a block outside the grid is out of range, and not counted as refused") {
  SmallMap small(config_of_pages(4));
  CHECK(small.map.open_block({kBlockLimit, 0, 0}).status() == Status::kOutOfRange);
  CHECK(small.map.open_block({0, -kBlockLimit - 1, 0}).status() == Status::kOutOfRange);
  CHECK(small.map.open_block({0, 0, kBlockLimit - 1}).ok());
  CHECK(small.map.open_block({-kBlockLimit, 0, 0}).ok());
  CHECK(small.map.usage().blocks_refused == 0);
  CHECK(small.map.block_count() == 2);
}

TEST_CASE("full map: clear makes it as new, counters included") {
  SmallMap small = full_of_free_pages();
  REQUIRE(hit(small.map, {0, -1, 8}, 1, 1.0F) != Status::kOk);
  small.map.begin_revision();
  small.map.clear();
  const MapUsage fresh = SmallMap(config_of_pages(4)).map.usage();
  const MapUsage cleared = small.map.usage();
  CHECK(content_of(small.map) == Content{});
  CHECK(cleared.used_bytes == fresh.used_bytes);
  CHECK(cleared.peak_bytes == fresh.peak_bytes);
  CHECK(cleared.blocks_refused == 0);
  CHECK(cleared.storage_refused == 0);
  CHECK(hit(small.map, {0, -1, 8}, 1, 1.0F) == Status::kOk);
}

}  // namespace
}  // namespace tessera
