// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Many voxels asked at once: the same estimates, bit for bit, as one by one.
#include <bit>
#include <catch2/catch.hpp>
#include <limits>
#include <vector>

#include "support/small_map.hpp"

namespace tessera {
namespace {

class BatchRandom {
 public:
  int below(std::uint64_t n) { return static_cast<int>(mix64(state_ += 0x9e3779b97f4a7c15U) % n); }

 private:
  std::uint64_t state_ = 3;
};

void check_same(const Estimate& given, const Estimate& expected) {
  const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
  REQUIRE(given.state == expected.state);
  REQUIRE(given.label == expected.label);
  REQUIRE(bits(given.probability) == bits(expected.probability));
  REQUIRE(bits(given.variance) == bits(expected.variance));
  REQUIRE(bits(given.evidence) == bits(expected.evidence));
  REQUIRE(bits(given.occupancy) == bits(expected.occupancy));
}

SmallMap map_of(TuplePolicy tuple) {
  MapConfig config = config_of_pages(60);
  config.tuple = tuple;
  SmallMap small(config, 7);
  BatchRandom random;
  for (int i = 0; i < 3000; ++i) {
    const VoxelCoord voxel{random.below(40) - 20, random.below(16) - 8, random.below(6) - 3};
    const Status status = i % 3 == 0 ? carve(small.map, voxel)
                                     : hit(small.map, voxel, 1 + random.below(8),
                                           0.25F * static_cast<float>(i % 9 + 1));
    REQUIRE(status == Status::kOk);
  }
  return small;
}

/// Runs in one block, jumps, blocks that are not there, and places that are not in the grid.
std::vector<VoxelCoord> wanderer(std::size_t size) {
  BatchRandom random;
  std::vector<VoxelCoord> voxels;
  VoxelCoord at{};
  while (voxels.size() < size) {
    const int kind = random.below(12);
    if (kind == 0) at = {kVoxelLimit, random.below(8), 0};
    if (kind == 1) at = {0, -kVoxelLimit - 1, random.below(8)};
    if (kind == 2) at = {1000 + random.below(4), 0, 0};
    if (kind >= 3 && kind < 7)
      at = {random.below(44) - 22, random.below(20) - 10, random.below(8) - 4};
    if (kind >= 7) at.x ^= random.below(8);
    voxels.push_back(at);
  }
  return voxels;
}

}  // namespace

TEST_CASE("LocalMap: voxels asked at once have the estimates that they have one by one") {
  for (const TuplePolicy tuple : {TuplePolicy::kDense, TuplePolicy::kCompact}) {
    const SmallMap small = map_of(tuple);
    for (const std::size_t size : {0U, 1U, 2U, 15U, 16U, 17U, 33U, 1000U}) {
      const std::vector<VoxelCoord> voxels = wanderer(size);
      std::vector<Estimate> into(size, Estimate{.label = 99});
      REQUIRE(small.map.query(voxels, into) == Status::kOk);
      int labelled = 0;
      for (std::size_t i = 0; i < size; ++i) {
        check_same(into[i], small.map.query(voxels[i]));
        labelled += into[i].label != 0 ? 1 : 0;
      }
      if (size == 1000) CHECK(labelled > 100);
    }
  }
}

TEST_CASE("LocalMap: points asked at once, finite, far or not a number") {
  const SmallMap small = map_of(TuplePolicy::kCompact);
  BatchRandom random;
  std::vector<Point3f> points;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (int i = 0; i < 500; ++i) {
    const auto coordinate = [&] { return 0.01F * static_cast<float>(random.below(400) - 200); };
    points.emplace_back(coordinate(), coordinate(), coordinate());
    if (i % 17 == 0) points.back().y() = std::numeric_limits<float>::quiet_NaN();
    if (i % 23 == 0) points.back().z() = -kInfinity;
    if (i % 29 == 0) points.back().x() = 1e9F;
  }
  std::vector<Estimate> into(points.size());
  REQUIRE(small.map.query(points, into) == Status::kOk);
  for (std::size_t i = 0; i < points.size(); ++i) check_same(into[i], small.map.query(points[i]));
}

TEST_CASE("LocalMap: asking at once with room for more or fewer answers writes none") {
  SmallMap small(config_of_pages(8));
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) == Status::kOk);
  const std::vector<VoxelCoord> voxels(3);
  const std::vector<Point3f> points(3, Point3f::Zero());
  for (const std::size_t room : {0U, 2U, 4U}) {
    std::vector<Estimate> into(room, Estimate{.label = 99});
    CHECK(small.map.query(voxels, into) == Status::kInvalidArgument);
    CHECK(small.map.query(points, into) == Status::kInvalidArgument);
    for (const Estimate& estimate : into) CHECK(estimate.label == 99);
  }
}

TEST_CASE("LocalMap: a map that was never made answers many voxels with unknown") {
  const LocalMap map;
  const std::vector<VoxelCoord> voxels = wanderer(40);
  std::vector<Estimate> into(voxels.size(), Estimate{.label = 99});
  REQUIRE(map.query(voxels, into) == Status::kOk);
  for (const Estimate& estimate : into) check_same(estimate, map.query(VoxelCoord{}));
}

TEST_CASE("LocalMap: a block whose hash is another's has its own voxels, alone and at once") {
  // What the index keeps of a key, found again by trying: two blocks that agree in all 32 bits.
  const auto hash_of = [](BlockCoord block) {
    return mix64(pack_in_grid(block).bits + 0x9e3779b97f4a7c15U) >> 32U;
  };
  constexpr std::int32_t kRow = 512;
  std::vector<KeyedIndex> hashes;
  for (std::int32_t i = 0; i < kRow * kRow; ++i)
    hashes.push_back({hash_of({i % kRow, i / kRow, 0}), static_cast<std::uint32_t>(i)});
  std::vector<KeyedIndex> workspace(hashes.size());
  radix_sort(std::span<KeyedIndex>(hashes), std::span<KeyedIndex>(workspace));
  int pairs = 0;
  for (std::size_t i = 1; i < hashes.size(); ++i) {
    if (hashes[i].key != hashes[i - 1].key) continue;
    ++pairs;
    const auto voxel_of = [&](const KeyedIndex& item) {
      const auto n = static_cast<std::int32_t>(item.index);
      return VoxelCoord{n % kRow * kBlockEdge, n / kRow * kBlockEdge, 0};
    };
    const std::vector<VoxelCoord> voxels{voxel_of(hashes[i - 1]), voxel_of(hashes[i])};
    SmallMap small(config_of_pages(8));
    std::vector<Estimate> into(2);
    REQUIRE(hit(small.map, voxels[0], 1, 1.0F) == Status::kOk);
    REQUIRE(small.map.query(voxels, into) == Status::kOk);
    CHECK(into[0].label == 1);
    CHECK(into[1].state == VoxelState::kUnknown);
    CHECK(small.map.query(voxels[1]).state == VoxelState::kUnknown);
    REQUIRE(hit(small.map, voxels[1], 2, 1.0F) == Status::kOk);
    REQUIRE(small.map.query(voxels, into) == Status::kOk);
    CHECK(into[0].label == 1);
    CHECK(into[1].label == 2);
    CHECK(small.map.query(voxels[1]).label == 2);
  }
  CHECK(pairs > 2);
}

}  // namespace tessera
