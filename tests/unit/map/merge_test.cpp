// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks that leave a map and come back: removing, visiting, and adding stored content.
#include <algorithm>
#include <catch2/catch.hpp>

#include "support/small_map.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera {

namespace {

std::vector<std::byte> encoded(const LocalMap& map, BlockCoord block) {
  std::vector<std::byte> bytes(most_block_bytes(map.num_components()));
  bytes.resize(save_block(map, *map.find(block), bytes));
  return bytes;
}

MapConfig settings(TuplePolicy tuple, float max_evidence) {
  MapConfig config = config_of_pages(32);
  config.tuple = tuple;
  config.max_evidence = max_evidence;
  return config;
}

}  // namespace

TEST_CASE("stored block: a block that comes back to an empty map is the same, revision included") {
  for (const TuplePolicy tuple : {TuplePolicy::kDense, TuplePolicy::kCompact}) {
    SmallMap there(settings(tuple, 10.0F));
    there.map.restore_revision(7);
    REQUIRE(hit(there.map, {-3, 5, 1}, 2, 1.5F) == Status::kOk);
    REQUIRE(hit(there.map, {-3, 5, 1}, 3, 20.0F) == Status::kOk);
    REQUIRE(carve(there.map, {-3, 5, 1}) == Status::kOk);
    REQUIRE(carve(there.map, {-8, 0, 7}) == Status::kOk);
    SmallMap here(settings(tuple, 10.0F));
    REQUIRE(restore_block(encoded(there.map, {-1, 0, 0}), here.map).ok());
    here.map.restore_revision(7);
    CHECK(content_of(here.map) == content_of(there.map));
  }
}

TEST_CASE("stored block: content that meets content is added, and later revisions win") {
  SmallMap a(settings(TuplePolicy::kDense, 0.0F));
  SmallMap b(settings(TuplePolicy::kDense, 0.0F));
  a.map.restore_revision(9);
  REQUIRE(hit(a.map, {1, 1, 1}, 2, 1.5F) == Status::kOk);
  REQUIRE(carve(a.map, {0, 0, 0}) == Status::kOk);
  b.map.restore_revision(4);
  REQUIRE(hit(b.map, {1, 1, 1}, 2, 0.25F) == Status::kOk);
  REQUIRE(hit(b.map, {1, 1, 1}, 1, 3.0F) == Status::kOk);
  REQUIRE(hit(b.map, {7, 7, 7}, 3, 1.0F) == Status::kOk);
  REQUIRE(carve(b.map, {0, 0, 0}) == Status::kOk);
  REQUIRE(carve(b.map, {1, 1, 1}) == Status::kOk);
  REQUIRE(restore_block(encoded(b.map, {}), a.map).ok());
  const VoxelEvidence sum = a.map.evidence(VoxelCoord{1, 1, 1});
  CHECK(sum.sigma[0] == 0.4F);
  CHECK(sum.sigma[1] == 3.0F);
  CHECK(sum.sigma[2] == 1.75F);
  CHECK(a.map.free_passes(*a.map.find({}), 0, 0) == 2);
  CHECK(a.map.evidence(VoxelCoord{7, 7, 7}).sigma[3] == 1.0F);
  CHECK(a.map.find({})->revision == 9);
  const Content content = content_of(a.map);
  CHECK(content.label_voxels == recount_label_voxels(content));
  CHECK(content.free_voxels == recount_free_voxels(content));
}

TEST_CASE("stored block: sums are held to the cap in proportion, passes to their most") {
  SmallMap a(settings(TuplePolicy::kDense, 10.0F));
  SmallMap b(settings(TuplePolicy::kDense, 10.0F));
  REQUIRE(hit(a.map, {0, 0, 0}, 1, 6.0F) == Status::kOk);
  REQUIRE(hit(b.map, {0, 0, 0}, 2, 9.0F) == Status::kOk);
  for (int i = 0; i < 20; ++i) {
    REQUIRE(carve(a.map, {2, 0, 0}) == Status::kOk);
    REQUIRE(carve(b.map, {2, 0, 0}) == Status::kOk);
  }
  REQUIRE(restore_block(encoded(b.map, {}), a.map).ok());
  const VoxelEvidence sum = a.map.evidence(VoxelCoord{0, 0, 0});
  CHECK(sum.sigma[1] == Approx(4.0F));
  CHECK(sum.sigma[2] == Approx(6.0F));
  CHECK(a.map.evidence(VoxelCoord{2, 0, 0}).sigma[0] == Approx(0.4F * 25.0F));
}

TEST_CASE("stored block: of compact tuples the three largest counts keep their class") {
  SmallMap a(settings(TuplePolicy::kCompact, 0.0F), 6);
  SmallMap b(settings(TuplePolicy::kCompact, 0.0F), 6);
  for (const auto& [component, weight] : {std::pair{1, 1.0F}, {2, 2.0F}, {3, 5.0F}})
    REQUIRE(hit(a.map, {0, 0, 0}, component, weight) == Status::kOk);
  for (const auto& [component, weight] : {std::pair{4, 2.0F}, {5, 3.0F}, {1, 0.5F}})
    REQUIRE(hit(b.map, {0, 0, 0}, component, weight) == Status::kOk);
  REQUIRE(restore_block(encoded(b.map, {}), a.map).ok());
  const VoxelEvidence sum = a.map.evidence(VoxelCoord{0, 0, 0});
  CHECK(sum.sigma[3] == 5.0F);
  CHECK(sum.sigma[5] == 3.0F);
  CHECK(sum.sigma[2] == 2.0F);  // of equals the lower class
  CHECK(sum.sigma[4] == 0.0F);
  CHECK(sum.rest == 3.5F);
}

TEST_CASE("stored block: one that is damaged or does not fit changes nothing") {
  SmallMap from(settings(TuplePolicy::kDense, 0.0F));
  for (int i = 0; i < 8; ++i) REQUIRE(hit(from.map, {i, i, i}, 1, 1.0F) == Status::kOk);
  REQUIRE(carve(from.map, {0, 1, 2}) == Status::kOk);
  const std::vector<std::byte> sound = encoded(from.map, {});
  SmallMap into(settings(TuplePolicy::kDense, 0.0F));
  REQUIRE(hit(into.map, {0, 0, 0}, 2, 1.0F) == Status::kOk);
  const Content before = content_of(into.map);
  for (std::size_t i = 0; i < sound.size(); ++i) {
    std::vector<std::byte> bytes = sound;
    bytes[i] ^= std::byte{0x10};
    REQUIRE(!restore_block(bytes, into.map).ok());
    REQUIRE(!restore_block(std::span(sound).first(i), into.map).ok());
  }
  CHECK(content_of(into.map) == before);
  SmallMap full(config_of_pages(4));
  REQUIRE(carve(full.map, {100, 0, 0}) == Status::kOk);
  REQUIRE(hit(full.map, {200, 0, 0}, 1, 1.0F) == Status::kOk);  // a page for each size
  const Content small = content_of(full.map);
  std::vector<std::byte> large(most_block_bytes(5));
  SmallMap all(config_of_pages(32));
  for (int i = 0; i < kBlockVoxels; i += 2)
    REQUIRE(hit(all.map, {i % 8, i / 8 % 8, i / 64}, 1, 1.0F) == Status::kOk);
  large.resize(save_block(all.map, *all.map.find({}), large));
  CHECK(restore_block(large, full.map).status == Status::kResourceExhausted);
  CHECK(content_of(full.map) == small);
}

TEST_CASE("stored block: the bounds on its bytes and storage hold for a full one") {
  for (const int classes : {1, 19, 62}) {
    MapConfig config = settings(TuplePolicy::kDense, 0.0F);
    config.storage_bytes = one_block_storage(config.tuple, classes + 2);
    config.label_votes = true;
    SmallMap full(config, classes);
    for (int i = 0; i < kBlockVoxels; ++i) {
      const VoxelCoord v{i % 8, i / 8 % 8, i / 64};
      REQUIRE(carve(full.map, v) == Status::kOk);
      for (int l = 1; l <= classes + 1; ++l) REQUIRE(hit(full.map, v, l, 1.0F) == Status::kOk);
    }
    const int voted = std::min(classes, static_cast<int>(LabelVotes::kClasses));
    LabelVotes votes;
    votes.begun = true;
    for (int l = 1; l <= voted; ++l) votes.add(3, static_cast<std::uint8_t>(l), 1);
    for (std::size_t layer = 0; layer < kBlockLayers; ++layer)
      full.map.set_votes(full.map.find_handle(BlockCoord{}), layer, votes);
    std::vector<std::byte> bytes(most_block_bytes(classes + 2));
    const std::size_t n = save_block(full.map, *full.map.find({}), bytes);
    // Dense tuples have no rest, and a table of one class has votes of one.
    const std::size_t unused =
        5 * kBlockVoxels + kBlockLayers * 9 * static_cast<std::size_t>(5 - voted);
    CHECK(n + unused == bytes.size());
    CHECK(save_block(full.map, *full.map.find({}), std::span(bytes).first(n - 1)) == 0);
  }
}

TEST_CASE("merge_passes: without room for a free page nothing changes, and it is counted") {
  SmallMap small(config_of_pages(4));
  const Result<SlabHandle> block = small.map.open_block({0, 0, 0});
  REQUIRE(block.ok());
  // Labels take the other pages.
  for (std::int32_t i = 0; small.map.fits({0, 0, 1, 0}); ++i) {
    REQUIRE(i < 10000);
    static_cast<void>(hit(small.map, {8 * i, 0, 0}, 1, 1.0F));
  }
  const Content before = content_of(small.map);
  const std::uint64_t refused = small.map.usage().storage_refused;
  const std::vector<std::byte> passes(kOctetVoxels, std::byte{3});
  CHECK(small.map.merge_passes(*block, 63, passes, 0xffU) == Status::kResourceExhausted);
  CHECK(small.map.usage().storage_refused == refused + 1);
  CHECK(content_of(small.map) == before);
  CHECK(small.map.merge_passes(*block, 63, passes, 0U) == Status::kOk);
}

TEST_CASE("merge_passes: more than the cap's passes are invalid and change nothing") {
  SmallMap small(config_of_pages(16));
  const Result<SlabHandle> block = small.map.open_block({0, 0, 0});
  REQUIRE(block.ok());
  std::vector<std::byte> passes(kOctetVoxels, std::byte{3});
  passes[5] = static_cast<std::byte>(small.map.max_passes() + 1);
  CHECK(small.map.merge_passes(*block, 0, passes, 0xffU) == Status::kInvalidArgument);
  CHECK(small.map.count_free_voxels() == 0);
  CHECK(small.map.merge_passes(*block, 0, passes, 0xdfU) == Status::kOk);
  CHECK(small.map.count_free_voxels() == 7);
}

TEST_CASE("remove: all that a block took can be used again") {
  SmallMap small(config_of_pages(8));
  for (int round = 0; round < 200; ++round) {
    const VoxelCoord v{8 * round, 0, 0};
    for (int i = 0; i < 8; ++i) {
      REQUIRE(hit(small.map, {v.x + i, i, i}, 1 + i % 3, 1.0F) == Status::kOk);
      REQUIRE(carve(small.map, {v.x + i, 0, 0}) == Status::kOk);
    }
    REQUIRE(small.map.block_count() == 1);
    small.map.remove_block(*small.map.open_block(block_of(v)));
    REQUIRE(small.map.block_count() == 0);
    REQUIRE(small.map.usage().label_voxels == 0);
  }
  CHECK(content_of(small.map) == Content{});
  CHECK(small.map.usage().storage_refused == 0);
}

TEST_CASE("visit_blocks: rounds meet every block once, also while blocks go") {
  SmallMap small(config_of_pages(64));
  for (int i = 0; i < 100; ++i) REQUIRE(carve(small.map, {8 * i, 0, 0}) == Status::kOk);
  std::vector<std::uint64_t> met;
  SweepCursor cursor;
  // More entries than there are: once around, and no further.
  small.map.visit_blocks(cursor, 1U << 20U, [&](BlockKey key, SlabHandle) {
    met.push_back(key.bits);
    return true;
  });
  std::ranges::sort(met);
  CHECK(met.size() == 100);
  CHECK(std::ranges::adjacent_find(met) == met.end());
  std::size_t removed = 0;
  for (int call = 0; call < 400 && small.map.block_count() > 0; ++call) {
    const std::size_t seen =
        small.map.visit_blocks(cursor, 10, [&](BlockKey key, SlabHandle handle) {
          CHECK(small.map.block_at(handle).key == key.bits);
          small.map.remove_block(handle);
          ++removed;
          return true;
        });
    CHECK(seen <= 17);
  }
  CHECK(removed == 100);
}

TEST_CASE("visit_blocks: what false stopped at comes first the next time") {
  SmallMap small(config_of_pages(64));
  for (int i = 0; i < 20; ++i) REQUIRE(carve(small.map, {8 * i, 0, 0}) == Status::kOk);
  SweepCursor cursor;
  std::size_t refused = 0;
  std::size_t removed = 0;
  for (int call = 0; call < 100; ++call) {
    std::size_t left = 1;
    small.map.visit_blocks(cursor, 1U << 20U, [&](BlockKey, SlabHandle handle) {
      if (left == 0) {
        ++refused;
        return false;
      }
      --left;
      small.map.remove_block(handle);
      ++removed;
      return true;
    });
  }
  CHECK(removed == 20);
  CHECK(refused > 0);
}

}  // namespace tessera
