// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reading a map: every voxel of the grid has an answer, observed or not, and points ask the voxel
// that contains them.
#include <catch2/catch.hpp>
#include <limits>

#include "support/small_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST_CASE("a map that was never made: every voxel is unknown, and nothing can be written") {
  LocalMap map;
  CHECK(map.query(Point3f(1.0F, 2.0F, 3.0F)).state == VoxelState::kUnknown);
  CHECK(map.query(VoxelCoord{1, 2, 3}).state == VoxelState::kUnknown);
  CHECK(map.find({0, 0, 0}) == nullptr);
  CHECK(map.open_block({0, 0, 0}).status() == Status::kResourceExhausted);
  CHECK(map.block_count() == 0);
  CHECK(map.usage().blocks_refused == 1);
  CHECK(map.usage().capacity_bytes == 0);
  CHECK(map.usage().used_bytes == 0);
  map.clear();
}

TEST_CASE("LocalMap: a new map knows nothing anywhere") {
  const SmallMap small(config_of_pages(4));
  for (const VoxelCoord v :
       {VoxelCoord{0, 0, 0}, VoxelCoord{-1, -8, 8}, VoxelCoord{-kVoxelLimit, 0, kVoxelLimit - 1}}) {
    CHECK(small.map.evidence(v).total() == 0.0);
    CHECK(small.map.evidence(v).num_components == 5);
    CHECK(small.map.query(v).state == VoxelState::kUnknown);
  }
}

TEST_CASE("LocalMap: evidence is found in the voxel it was added to and in no neighbour") {
  for (const VoxelCoord v : {VoxelCoord{0, 0, 0}, VoxelCoord{-1, -1, -1}, VoxelCoord{7, 8, -8},
                             VoxelCoord{-9, 15, 16}}) {
    SmallMap small(config_of_pages(8));
    REQUIRE(hit(small.map, v, 2, 1.5F) == Status::kOk);
    for (int i = 0; i < 27; ++i) {
      const VoxelCoord near{v.x + i % 3 - 1, v.y + i / 3 % 3 - 1, v.z + i / 9 - 1};
      REQUIRE(small.map.evidence(near).sigma[2] == (near == v ? 1.5F : 0.0F));
    }
  }
}

TEST_CASE("LocalMap: the outermost voxels of the grid take evidence") {
  SmallMap small(config_of_pages(8));
  for (const VoxelCoord v : {VoxelCoord{-kVoxelLimit, -kVoxelLimit, -kVoxelLimit},
                             VoxelCoord{kVoxelLimit - 1, kVoxelLimit - 1, kVoxelLimit - 1}}) {
    REQUIRE(hit(small.map, v, 1, 1.0F) == Status::kOk);
    CHECK(small.map.evidence(v).sigma[1] == 1.0F);
  }
}

TEST_CASE("LocalMap: a point asks the voxel that contains it, below zero too") {
  SmallMap small(config_of_pages(8));
  REQUIRE(hit(small.map, {-1, 0, 19}, 3, 2.0F) == Status::kOk);
  const Estimate estimate = small.map.query(Point3f(-0.01F, 0.05F, 1.95F));
  CHECK(estimate.state == VoxelState::kOccupied);
  CHECK(estimate.label == 3);
  CHECK(small.map.evidence(Point3f(-0.01F, 0.05F, 1.95F)).sigma[3] == 2.0F);
  CHECK(small.map.query(Point3f(0.01F, 0.05F, 1.95F)).state == VoxelState::kUnknown);
}

TEST_CASE("LocalMap: a point that is not finite or outside the grid is unknown") {
  const SmallMap small(config_of_pages(4));
  for (const float bad : {kNaN, kInfinity, -kInfinity, 1e9F, -1e9F}) {
    CHECK(small.map.query(Point3f(bad, 0.0F, 0.0F)).state == VoxelState::kUnknown);
    CHECK(small.map.evidence(Point3f(0.0F, 0.0F, bad)).total() == 0.0);
    CHECK(small.map.evidence(Point3f(0.0F, bad, 0.0F)).num_components == 5);
  }
}

TEST_CASE(
    "LocalMap: a voxel outside the grid has no evidence, also where a neighbour at the edge has") {
  SmallMap small(config_of_pages(8));
  REQUIRE(hit(small.map, {kVoxelLimit - 1, 0, 0}, 1, 1.0F) == Status::kOk);
  REQUIRE(hit(small.map, {-kVoxelLimit, 0, 0}, 1, 1.0F) == Status::kOk);
  CHECK(small.map.evidence(VoxelCoord{kVoxelLimit, 0, 0}).total() == 0.0);
  CHECK(small.map.evidence(VoxelCoord{-kVoxelLimit - 1, 0, 0}).total() == 0.0);
}

TEST_CASE("LocalMap: observed_labels has a bit for each voxel of the octet with label evidence") {
  SmallMap small(config_of_pages(8));
  const VoxelCoord corner{-2, -2, -2};
  for (const VoxelCoord v : {corner, VoxelCoord{-1, -2, -2}, VoxelCoord{-1, -1, -1}}) {
    REQUIRE(hit(small.map, v, 1, 1.0F) == Status::kOk);
  }
  REQUIRE(carve(small.map, {-2, -1, -2}) == Status::kOk);
  const Block& block = *small.map.find({-1, -1, -1});
  CHECK(int{small.map.observed_labels(block, octet_in_block(corner))} == 0b10000011);
  CHECK(small.map.octet_handle(block, octet_in_block(corner)) != 0);
  CHECK(small.map.octet_handle(block, 0) == 0);
}

TEST_CASE("LocalMap: the prior is no evidence, it only enters the estimate") {
  MapConfig config = config_of_pages(8);
  config.prior = 2.0;
  SmallMap small(config);
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) == Status::kOk);
  CHECK(small.map.evidence(VoxelCoord{0, 0, 0}).total() == 1.0);
  CHECK(estimate(small.map.evidence(VoxelCoord{0, 0, 0}), config.prior).probability ==
        Approx(3.0 / 11.0));
}

TEST_CASE("LocalMap: query, cursor and state say what the evidence says, to the last bit") {
  for (const TuplePolicy tuple : {TuplePolicy::kDense, TuplePolicy::kCompact}) {
    for (const double prior : {0.0, 0.001, 7.0}) {
      MapConfig config = config_of_pages(60);
      config.tuple = tuple;
      config.prior = prior;
      config.free_weight = 0.3F;
      config.max_evidence = 30.0F;
      SmallMap small(config, 7);
      std::uint64_t seed = 1;
      const auto below = [&](std::uint64_t n) {
        return static_cast<int>(mix64(seed += 0x9e3779b97f4a7c15U) % n);
      };
      const auto anywhere = [&] { return VoxelCoord{below(24) - 12, below(16) - 8, below(6) - 3}; };
      for (int i = 0; i < 4000; ++i) {
        const int component = 1 + below(8);
        const Status status = i % 3 == 0 ? carve(small.map, anywhere())
                                         : hit(small.map, anywhere(), component,
                                               0.01F * static_cast<float>(1 + below(97)));
        REQUIRE(status == Status::kOk);
      }
      BlockCursor cursor(small.map);
      int free_only = 0;
      for (int i = 0; i < 3000; ++i) {
        const VoxelCoord v = i % 50 == 0 ? VoxelCoord{kVoxelLimit, i, 0} : anywhere();
        const Estimate expected = estimate(small.map.evidence(v), small.map.reading());
        for (const Estimate& given : {small.map.query(v), cursor.query(v)}) {
          REQUIRE(given.state == expected.state);
          REQUIRE(given.label == expected.label);
          REQUIRE(given.probability == expected.probability);
          REQUIRE(given.variance == expected.variance);
          REQUIRE(given.evidence == expected.evidence);
          REQUIRE(given.occupancy == expected.occupancy);
        }
        REQUIRE(cursor.state(v) == expected.state);
        free_only += expected.evidence > 0.0 && expected.label == 0 ? 1 : 0;
      }
      CHECK(free_only > 50);
    }
  }
}

TEST_CASE("MapUsage: used bytes are the index and the pages in use, and grow a page at a time") {
  SmallMap small(config_of_pages(8));
  const std::size_t index_bytes = required_bytes(small.map.config()) - 8 * SlabPool::kPageBytes;
  CHECK(small.map.usage().used_bytes == index_bytes);
  REQUIRE(small.map.open_block({0, 0, 0}).ok());
  CHECK(small.map.usage().used_bytes == index_bytes + SlabPool::kPageBytes);
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) == Status::kOk);
  CHECK(small.map.usage().used_bytes == index_bytes + 3 * SlabPool::kPageBytes);
  REQUIRE(carve(small.map, {0, 0, 0}) == Status::kOk);
  CHECK(small.map.usage().used_bytes == index_bytes + 4 * SlabPool::kPageBytes);
  CHECK(small.map.usage().peak_bytes == small.map.usage().used_bytes);
}

}  // namespace
}  // namespace tessera
