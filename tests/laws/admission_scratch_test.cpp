// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Scratch memory that runs out: what is reported as admitted is written, whatever order its tables
// were filled in, and a refused point leaves nothing behind that keeps a later one out.
#include <catch2/catch.hpp>
#include <cmath>

#include "support/mapper.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera::oracle {
namespace {

constexpr double kResolution_m = 0.1;
constexpr double kBlock_m = kBlockEdge * kResolution_m;

/// Blocks around the origin whose places in an index for so many keys are all among its first
/// buckets, so that more of them than fit there cannot be stored together. Follows KeyIndex.
std::vector<BlockCoord> colliding_blocks(std::uint32_t capacity, std::uint32_t first_buckets) {
  const std::uint64_t buckets = capacity / 4 + 2;
  const auto bucket_of = [&](std::uint64_t part) {
    return ((part & 0xffffffffU) * buckets) >> 32U;
  };
  std::vector<BlockCoord> found;
  constexpr int kReach = 44;
  for (int z = -kReach; z <= kReach; ++z) {
    for (int y = -kReach; y <= kReach; ++y) {
      for (int x = -kReach; x <= kReach; ++x) {
        const int square = x * x + y * y + z * z;
        if (square > kReach * kReach || square < 9) continue;
        const std::uint64_t hash = mix64((*pack(BlockCoord{x, y, z})).bits + 0x9e3779b97f4a7c15U);
        if (bucket_of(hash) < first_buckets && bucket_of(hash >> 32U) < first_buckets)
          found.push_back({x, y, z});
      }
    }
  }
  return found;
}

InferenceConfig config_of(InferenceMode mode, bool free_space) {
  InferenceConfig config;
  config.mode = mode;
  config.kernel_length_m = 0.05F;
  config.thinning_m = 0.0;
  config.free_space.enabled = free_space;
  config.free_space.carving = Carving::kRays;
  return config;
}

}  // namespace

TEST_CASE("scratch: with blocks that collide in its tables, every admitted point is in the map") {
  // In the kernel mode points lie at their block's lower face, so that the block beside it is
  // touched by each too.
  const InferenceMode mode = GENERATE(InferenceMode::kCounting, InferenceMode::kKernel);
  constexpr ScanCapacity kCapacity{.points = 4000, .tiles = 1024, .ray_blocks = 16};
  constexpr std::uint32_t kBuckets = 12;
  std::vector<BlockCoord> blocks = colliding_blocks(kCapacity.tiles, kBuckets);
  const std::size_t points = 5 * kBuckets + 20;
  REQUIRE(blocks.size() > points);
  Random random(announce_seed(7100));
  std::uint64_t refused = 0;
  for (int trial = 0; trial < 100; ++trial) {
    Cloud cloud;
    for (std::size_t i = 0; i < points; ++i) {
      std::swap(
          blocks[i],
          blocks[i + static_cast<std::size_t>(random.below(static_cast<int>(blocks.size() - i)))]);
      const BlockCoord& b = blocks[i];
      const double shift_m = mode == InferenceMode::kKernel ? kBlock_m + 0.05 : 0.45;
      cloud.add(b.x * kBlock_m + shift_m, b.y * kBlock_m + 0.45, b.z * kBlock_m + 0.45, 1);
    }
    Mapper mapper(uncapped_map(kResolution_m), config_of(mode, false), 3, kCapacity);
    const ScanReport report = mapper.integrate(cloud);
    CAPTURE(trial, report.admitted, report.refused_tiles);
    REQUIRE(report.admitted + report.refused_tiles == points);
    REQUIRE(mapper.map().usage().label_voxels == report.admitted);
    refused += report.refused_tiles;
  }
  CHECK(refused > 0);
}

TEST_CASE("scratch: with too few ray blocks, every admitted ray is carved whole") {
  constexpr ScanCapacity kCapacity{.points = 4000, .tiles = 4096, .ray_blocks = 700};
  InferenceConfig config = config_of(InferenceMode::kCounting, true);
  config.free_space = {
      .carving = Carving::kRays, .neighbour_angle_rad = 0.0F, .margin_voxels = 0.0F};
  config.min_range_m = 0.0F;
  Random random(announce_seed(7200));
  std::uint64_t refused = 0;
  for (int trial = 0; trial < 30; ++trial) {
    Cloud cloud;
    for (int i = 0; i < 60; ++i) {
      cloud.add(random.uniform(-25, 25), random.uniform(-25, 25), random.uniform(-25, 25), 1);
    }
    Mapper mapper(uncapped_map(kResolution_m), config, 3, kCapacity);
    const ScanReport report = mapper.integrate(cloud);
    CAPTURE(trial, report.admitted);
    REQUIRE(report.admitted + report.refused_ray_blocks == report.thinned);
    Mapper ample(uncapped_map(kResolution_m), config, 3);
    REQUIRE(ample.integrate(mapper.admitted_cloud()).left_out() == 0);
    REQUIRE(same_content(mapper.map(), ample.map()));
    refused += report.refused_ray_blocks;
  }
  CHECK(refused > 0);
}

TEST_CASE("scratch: refused points do not keep out a farther one that fits") {
  MapConfig map = uncapped_map(kResolution_m);
  map.storage_bytes = 4 * SlabPool::kPageBytes;
  const std::uint32_t tiles = GENERATE(9U, 64U);
  Mapper mapper(map, config_of(InferenceMode::kCounting, false), 19,
                {.points = 200, .tiles = tiles, .ray_blocks = 16});
  Cloud full;  // an octet for each point, until storage is full
  for (int i = 0; i < 16; ++i) full.add(16.1 + 0.2 * (i % 4), 0.1 + 0.2 * (i / 4), 0.1, 1);
  REQUIRE(mapper.integrate(full).refused_storage > 0);
  Cloud later;
  for (int i = 0; i < 10; ++i) later.add(2.1 + i, 4.1, 0.1, 1);
  later.add(16.1, 0.1, 0.1, 1);  // a voxel that the map has
  const ScanReport report = mapper.integrate(later);
  CHECK(report.refused_storage == 10);
  CHECK(report.refused_tiles == 0);
  CHECK(report.admitted == 1);
}

TEST_CASE("scratch: a map that is full says so in its usage too") {
  MapConfig map = uncapped_map(kResolution_m);
  map.storage_bytes = 4 * SlabPool::kPageBytes;
  Mapper mapper(map, config_of(InferenceMode::kCounting, false), 19);
  Cloud cloud;
  for (int i = 0; i < 16; ++i) cloud.add(16.1 + 0.2 * (i % 4), 0.1 + 0.2 * (i / 4), 0.1, 1);
  const ScanReport report = mapper.integrate(cloud);
  REQUIRE(report.refused_storage > 0);
  CHECK(mapper.map().usage().storage_refused == report.refused_storage);
}

TEST_CASE("scratch: exactly as many returns as there is room for are taken, from all around") {
  Mapper mapper(uncapped_map(kResolution_m), config_of(InferenceMode::kCounting, false), 3,
                {.points = 2000, .tiles = 4096, .ray_blocks = 16});
  Cloud cloud;
  for (int i = 0; i < 2001; ++i) {
    const double angle = i * 6.283185307179586 / 2001;
    cloud.add(5.0 * std::cos(angle), 5.0 * std::sin(angle), 0.0, 1);
  }
  const ScanReport report = mapper.integrate(cloud);
  CHECK(report.over_capacity == 1);
  CHECK(report.admitted == 2000);
}

TEST_CASE("scratch: an integrator that was never made leaves out all and writes nothing") {
  Mapper mapper(uncapped_map(kResolution_m), config_of(InferenceMode::kCounting, true), 3);
  Cloud cloud;
  cloud.add(1.0, 1.0, 0.0, 1);
  Integrator integrator;
  const ScanReport report = integrator.integrate(mapper.map(), cloud.view());
  CHECK(report.over_capacity == 1);
  CHECK(report.left_out() == 1);
  CHECK(mapper.map().block_count() == 0);
}

TEST_CASE("scratch: weights over the limit are refused, at the limit they keep all finite") {
  Mapper mapper(uncapped_map(kResolution_m), config_of(InferenceMode::kCounting, false), 3);
  Cloud cloud;
  cloud.add(1.0, 1.0, 0.0, 1, 3e38);
  cloud.add(1.0, 1.0, 0.0, 1, static_cast<double>(kMaxWeight));
  cloud.add(1.0, 1.0, 0.0, 2, static_cast<double>(kMaxWeight));
  const ScanReport report = mapper.integrate(cloud);
  CHECK(report.non_finite == 1);
  const VoxelEvidence evidence = mapper.map().evidence(Point3f(1.0F, 1.0F, 0.0F));
  CHECK(estimate(evidence, 0.001).probability == Approx(0.5));
}

}  // namespace tessera::oracle
