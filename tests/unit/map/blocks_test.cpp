// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks: opened once, kept in an order that does not depend on history, taken back when they hold
// nothing, and marked with the revision that changed them last.
#include <algorithm>
#include <catch2/catch.hpp>
#include <tuple>
#include <vector>

#include "support/random.hpp"
#include "support/small_map.hpp"

namespace tessera {
namespace {

std::vector<std::uint64_t> keys_in_order(const LocalMap& map) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  std::vector<std::uint64_t> keys;
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) keys.push_back(item.key);
  return keys;
}

TEST_CASE("open_block: a block is opened once, later calls give the same one") {
  SmallMap small(config_of_pages(4));
  const Result<SlabHandle> first = small.map.open_block({-1, 0, 0});
  REQUIRE(first.ok());
  CHECK(*small.map.open_block({-1, 0, 0}) == *first);
  CHECK(*small.map.open_block({0, 0, 0}) != *first);
  CHECK(small.map.block_count() == 2);
}

TEST_CASE("find: blocks that were opened, and no others") {
  SmallMap small(config_of_pages(4));
  const SlabHandle handle = *small.map.open_block({-1, 2, -3});
  CHECK(small.map.find({-1, 2, -3}) == &small.map.block_at(handle));
  CHECK(small.map.find({-1, 2, 3}) == nullptr);
  CHECK(small.map.find({kBlockLimit, 0, 0}) == nullptr);
}

TEST_CASE("blocks_in_order: sorted by (z, y, x), across zero") {
  SmallMap small(config_of_pages(32));
  oracle::Random random(81);
  for (int i = 0; i < 150; ++i) {
    REQUIRE(
        small.map.open_block({random.below(9) - 4, random.below(9) - 4, random.below(9) - 4}).ok());
  }
  const std::vector<std::uint64_t> keys = keys_in_order(small.map);
  CHECK(keys.size() == small.map.block_count());
  for (std::size_t i = 1; i < keys.size(); ++i) {
    const BlockCoord a = unpack(BlockKey{keys[i - 1]});
    const BlockCoord b = unpack(BlockKey{keys[i]});
    CHECK(std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x));
  }
}

TEST_CASE("blocks_in_order: the same blocks in any order of opening give the same sequence") {
  std::vector<BlockCoord> blocks;
  for (std::int32_t i = 0; i < 64; ++i) blocks.push_back({i % 4 - 2, i / 4 % 4 - 2, i / 16 - 2});
  SmallMap in_order(config_of_pages(16));
  for (const BlockCoord& block : blocks) REQUIRE(in_order.map.open_block(block).ok());
  oracle::Random random(82);
  for (std::size_t i = blocks.size(); i > 1; --i) {
    std::swap(blocks[i - 1], blocks[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  }
  SmallMap shuffled(config_of_pages(32));
  for (const BlockCoord& block : blocks) REQUIRE(shuffled.map.open_block(block).ok());
  CHECK(keys_in_order(shuffled.map) == keys_in_order(in_order.map));
}

TEST_CASE("close_if_empty: takes back a block that holds nothing") {
  SmallMap small(config_of_pages(4));
  const SlabHandle handle = *small.map.open_block({0, 0, -1});
  small.map.close_if_empty(handle);
  CHECK(small.map.block_count() == 0);
  CHECK(small.map.find({0, 0, -1}) == nullptr);
}

TEST_CASE("close_if_empty: leaves blocks with labels and blocks with free passes alone") {
  SmallMap small(config_of_pages(8));
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) == Status::kOk);
  REQUIRE(carve(small.map, {-1, 0, 0}) == Status::kOk);
  const Content before = content_of(small.map);
  small.map.close_if_empty(*small.map.open_block({0, 0, 0}));
  small.map.close_if_empty(*small.map.open_block({-1, 0, 0}));
  CHECK(content_of(small.map) == before);
}

TEST_CASE("close_empty_blocks: takes back all that hold nothing and keeps the rest as it is") {
  SmallMap small(config_of_pages(16));
  for (std::int32_t i = -8; i < 8; i += 3)
    REQUIRE(hit(small.map, {8 * i, 0, 0}, 2, 1.5F) == Status::kOk);
  const Content before = content_of(small.map);
  for (std::int32_t i = -20; i < 20; ++i) REQUIRE(small.map.open_block({i, 0, 0}).ok());
  REQUIRE(small.map.block_count() == 40);
  small.map.close_empty_blocks();
  CHECK(content_of(small.map) == before);
}

TEST_CASE("close_empty_blocks: blocks taken back make room in storage and index for others") {
  SmallMap small(config_of_pages(4));
  const std::size_t used_bytes = [&] {
    REQUIRE(small.map.open_block({0, 0, 0}).ok());
    return small.map.usage().used_bytes;
  }();
  for (std::int32_t round = 0; round < 100; ++round) {
    for (std::int32_t i = 0; i < 30; ++i) REQUIRE(small.map.open_block({i, round, -round}).ok());
    small.map.close_empty_blocks();
    REQUIRE(small.map.block_count() == 0);
  }
  CHECK(small.map.usage().used_bytes == used_bytes);
}

TEST_CASE("revision: a block carries the revision that changed it last, others keep theirs") {
  SmallMap small(config_of_pages(16));
  small.map.begin_revision();
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) == Status::kOk);
  REQUIRE(carve(small.map, {8, 0, 0}) == Status::kOk);
  small.map.begin_revision();
  REQUIRE(hit(small.map, {-1, 0, 0}, 1, 1.0F) == Status::kOk);
  REQUIRE(carve(small.map, {8, 0, 0}) == Status::kOk);
  CHECK(small.map.revision() == 2);
  CHECK(small.map.find({0, 0, 0})->revision == 1);
  CHECK(small.map.find({1, 0, 0})->revision == 2);
  CHECK(small.map.find({-1, 0, 0})->revision == 2);
}

TEST_CASE("revision: reading, opening and adding nothing leave it") {
  SmallMap small(config_of_pages(16));
  small.map.begin_revision();
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) == Status::kOk);
  small.map.begin_revision();
  const SlabHandle block = *small.map.open_block({0, 0, 0});
  REQUIRE(small.map.add_labels(block, 0, OctetEvidence{}) == Status::kOk);
  REQUIRE(small.map.add_free_pass(block, VoxelMask{}) == Status::kOk);
  static_cast<void>(small.map.query(VoxelCoord{0, 0, 0}));
  CHECK(small.map.find({0, 0, 0})->revision == 1);
}

TEST_CASE("revision: a free pass through voxels that are saturated changes nothing, so it stays") {
  MapConfig config = config_of_pages(16);
  config.max_evidence = 2.0F;
  config.free_weight = 1.0F;
  SmallMap small(config);
  small.map.begin_revision();
  for (int i = 0; i < 2; ++i) REQUIRE(carve(small.map, {-5, 0, 0}) == Status::kOk);
  small.map.begin_revision();
  REQUIRE(carve(small.map, {-5, 0, 0}) == Status::kOk);
  CHECK(small.map.find({-1, 0, 0})->revision == 1);
}

}  // namespace
}  // namespace tessera
