// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Boxes and the whole map, against a look at every voxel.
#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <tuple>

#include "support/sample_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

using Visits = std::vector<std::pair<std::tuple<int, int, int>, double>>;

Visits in_box(const LocalMap& map, VoxelCoord low, VoxelCoord high) {
  Visits visits;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for_each_in_box(map, low, high, workspace,
                  [&](const VoxelCoord& v, const VoxelEvidence& evidence) {
                    visits.push_back({{v.z, v.y, v.x}, evidence.total()});
                  });
  std::sort(visits.begin(), visits.end());
  return visits;
}

Visits by_looking(const LocalMap& map, VoxelCoord low, VoxelCoord high) {
  Visits visits;
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) {
        const double total = map.evidence(VoxelCoord{x, y, z}).total();
        if (total > 0.0) visits.push_back({{z, y, x}, total});
      }
    }
  }
  return visits;
}

}  // namespace

TEST_CASE("a box visits each observed voxel in it once") {
  const SmallMap sample = sample_map(1, 400, 15, 200);
  SampleRandom random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const VoxelCoord low{random.integer(-20, 15), random.integer(-20, 15), random.integer(-20, 15)};
    const VoxelCoord high{low.x + random.integer(0, 20), low.y + random.integer(0, 20),
                          low.z + random.integer(0, 20)};
    CHECK(in_box(sample.map, low, high) == by_looking(sample.map, low, high));
  }
}

TEST_CASE("a box as large as the grid visits what the whole map has, in the same order") {
  const SmallMap sample = sample_map(4, 400, 300, 200);
  std::vector<KeyedIndex> workspace(2 * sample.map.block_count());
  std::vector<VoxelCoord> all;
  std::vector<VoxelCoord> boxed;
  for_each_observed(sample.map, workspace,
                    [&](const VoxelCoord& v, const VoxelEvidence&) { all.push_back(v); });
  constexpr int kMost = std::numeric_limits<std::int32_t>::max();
  for_each_in_box(sample.map, {-kMost, -kMost, -kMost}, {kMost, kMost, kMost}, workspace,
                  [&](const VoxelCoord& v, const VoxelEvidence&) { boxed.push_back(v); });
  CHECK(boxed == all);
}

TEST_CASE("a box out of the grid visits nothing, not the grid's rim") {
  SmallMap sample(config_of_pages(8), kSampleClasses);
  constexpr int kHigh = kVoxelLimit - 1;
  constexpr int kLow = -kVoxelLimit;
  observe(sample.map, {{{kHigh, kHigh, kHigh}, 1, 1.0F}, {{kLow, kLow, kLow}, 1, 1.0F}});
  CHECK(in_box(sample.map, {kHigh + 1, 0, 0}, {kHigh + 9, kHigh, kHigh}).empty());
  CHECK(in_box(sample.map, {kLow, kLow, kLow - 9}, {0, 0, kLow - 1}).empty());
}

TEST_CASE("a box with a workspace that is too short visits nothing, however small the box") {
  SmallMap sample(config_of_pages(8), kSampleClasses);
  observe(sample.map, {{{0, 0, 0}, 1, 1.0F}});
  int visits = 0;
  for_each_in_box(sample.map, {0, 0, 0}, {0, 0, 0}, {},
                  [&](const VoxelCoord&, const VoxelEvidence&) { ++visits; });
  CHECK(visits == 0);
}

TEST_CASE("blocks in order: a workspace that is too short gives nothing") {
  const SmallMap sample = sample_map(4);
  std::vector<KeyedIndex> workspace(2 * sample.map.block_count() - 1);
  CHECK(sample.map.blocks_in_order(workspace).empty());
}

TEST_CASE("a box of one voxel visits that voxel") {
  SmallMap sample(config_of_pages(8), kSampleClasses);
  observe(sample.map, {{{-8, 7, 0}, 1, 1.0F}, {{-9, 7, 0}, 1, 1.0F}, {{-7, 7, 0}, 0}});
  CHECK(in_box(sample.map, {-8, 7, 0}, {-8, 7, 0}).size() == 1);
}

TEST_CASE("a box whose low is above its high visits nothing") {
  const SmallMap sample = sample_map(3, 400, 15, 200);
  CHECK(in_box(sample.map, {5, -15, -15}, {4, 15, 15}).empty());
}

TEST_CASE("a box that reaches out of the grid is clipped") {
  SmallMap sample(config_of_pages(8), kSampleClasses);
  constexpr int kHigh = kVoxelLimit - 1;
  observe(sample.map, {{{kHigh, kHigh, kHigh}, 1, 1.0F}});
  constexpr int kFar = std::numeric_limits<std::int32_t>::max();
  CHECK(in_box(sample.map, {kHigh - 20, kHigh - 20, kHigh - 20}, {kFar, kFar, kFar}).size() == 1);
}

TEST_CASE("the whole map is every observed voxel, blocks in (z, y, x) order") {
  const SmallMap sample = sample_map(4, 400, 15, 200);
  std::vector<KeyedIndex> workspace(2 * sample.map.block_count());
  Visits visits;
  std::vector<BlockKey> blocks;
  for_each_observed(sample.map, workspace, [&](const VoxelCoord& v, const VoxelEvidence& e) {
    visits.push_back({{v.z, v.y, v.x}, e.total()});
    blocks.push_back(pack_in_grid(block_of(v)));
  });
  CHECK(std::is_sorted(blocks.begin(), blocks.end()));
  std::sort(visits.begin(), visits.end());
  CHECK(visits == by_looking(sample.map, {-15, -15, -15}, {15, 15, 15}));
}

}  // namespace tessera
