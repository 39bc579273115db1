// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The cap: no voxel's total evidence exceeds max_evidence, whatever was added in whatever order,
// and what gives way is what should.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "support/random.hpp"
#include "support/small_map.hpp"

namespace tessera {
namespace {

constexpr double kTolerance = 1e-4;

struct Caps {
  float max_evidence;
  float free_weight;
};
constexpr std::array<Caps, 6> kCaps{
    {{100.0F, 0.4F}, {25.0F, 0.1F}, {15.0F, 0.3F}, {10.0F, 3.0F}, {5.0F, 0.7F}, {1.0F, 1.0F}}};

SmallMap capped(const Caps& caps) {
  MapConfig config = config_of_pages(16);
  config.max_evidence = caps.max_evidence;
  config.free_weight = caps.free_weight;
  return SmallMap(config);
}

constexpr VoxelCoord kVoxel{-1, 8, -9};
/// In the same octet as kVoxel.
constexpr VoxelCoord kNeighbour{-2, 8, -9};

void carve_times(LocalMap& map, int times) {
  for (int i = 0; i < times; ++i) REQUIRE(carve(map, kVoxel) == Status::kOk);
}

TEST_CASE("cap: label evidence below the cap adds up, at the cap it stays there") {
  SmallMap small(config_of_pages(16));
  REQUIRE(hit(small.map, kVoxel, 1, 99.0F) == Status::kOk);
  CHECK(label_evidence(small.map, kVoxel) == 99.0);
  REQUIRE(hit(small.map, kVoxel, 1, 1.0F) == Status::kOk);
  CHECK(label_evidence(small.map, kVoxel) == 100.0);
  REQUIRE(hit(small.map, kVoxel, 1, 1.0F) == Status::kOk);
  CHECK(label_evidence(small.map, kVoxel) == Approx(100.0).margin(kTolerance));
}

TEST_CASE("cap: without one, evidence adds up without end") {
  SmallMap small = capped({0.0F, 0.4F});
  for (int i = 0; i < 1000; ++i) REQUIRE(hit(small.map, kVoxel, 2, 50.0F) == Status::kOk);
  CHECK(label_evidence(small.map, kVoxel) == 50000.0);
  carve_times(small.map, 300);
  CHECK(label_evidence(small.map, kVoxel) == 50000.0);
  CHECK(small.map.evidence(kVoxel).sigma[0] == 255.0F * 0.4F);
}

TEST_CASE("cap: what is over is taken from all classes in proportion") {
  SmallMap small(config_of_pages(16));
  REQUIRE(hit(small.map, kVoxel, 1, 60.0F) == Status::kOk);
  REQUIRE(hit(small.map, kVoxel, 3, 30.0F) == Status::kOk);
  REQUIRE(hit(small.map, kVoxel, 4, 30.0F) == Status::kOk);
  const VoxelEvidence evidence = small.map.evidence(kVoxel);
  CHECK(static_cast<double>(evidence.sigma[1]) == Approx(50.0).margin(kTolerance));
  CHECK(static_cast<double>(evidence.sigma[3]) == Approx(25.0).margin(kTolerance));
  CHECK(static_cast<double>(evidence.sigma[4]) == Approx(25.0).margin(kTolerance));
}

TEST_CASE(
    "cap: free evidence gives way to new labels at least in proportion, never the labels more") {
  constexpr std::uint64_t kSeed = 91;
  oracle::Random random(kSeed);
  for (int round = 0; round < 3000; ++round) {
    const Caps caps = kCaps[static_cast<std::size_t>(random.below(4))];
    INFO("seed " << kSeed << ", round " << round << ", cap " << caps.max_evidence);
    SmallMap small = capped(caps);
    carve_times(small.map, random.below(small.map.max_passes() + 1));
    const double free = static_cast<double>(small.map.evidence(kVoxel).sigma[0]);
    const auto added =
        static_cast<float>(random.uniform(0.0, 2.0) * static_cast<double>(caps.max_evidence));
    REQUIRE(hit(small.map, kVoxel, 1, added) == Status::kOk);
    const double total = free + static_cast<double>(added);
    const double share = std::min(1.0, static_cast<double>(caps.max_evidence) / total);
    REQUIRE(label_evidence(small.map, kVoxel) >= static_cast<double>(added) * share - kTolerance);
    REQUIRE(static_cast<double>(small.map.evidence(kVoxel).sigma[0]) <= free * share + kTolerance);
  }
}

TEST_CASE("cap: free evidence gives way by less than a pass more than its share") {
  SmallMap small(config_of_pages(16));
  carve_times(small.map, 250);
  REQUIRE(hit(small.map, kVoxel, 1, 25.0F) == Status::kOk);
  const double free = static_cast<double>(small.map.evidence(kVoxel).sigma[0]);
  CHECK(free <= 80.0 + kTolerance);
  CHECK(free > 80.0 - 0.4 - kTolerance);
}

/// Labels or free passes for one of a few voxels on both sides of block borders; the voxel that got
/// them.
VoxelCoord random_write(LocalMap& map, oracle::Random& random) {
  const VoxelCoord v{random.below(4) - 2, random.below(2) + 7, -random.below(2)};
  const double cap = static_cast<double>(map.config().max_evidence);
  if (random.below(3) == 0) {
    const double largest = random.below(4) == 0 ? 1.5 * cap : 0.1 * cap;
    const auto weight = static_cast<float>(random.uniform(0.0, largest));
    REQUIRE(hit(map, v, 1 + random.below(4), weight) == Status::kOk);
  } else {
    for (int n = random.below(40); n >= 0; --n) REQUIRE(carve(map, v) == Status::kOk);
  }
  return v;
}

TEST_CASE("cap: holds in every voxel through random labels and free passes") {
  for (std::size_t which = 0; which < kCaps.size(); ++which) {
    const std::uint64_t seed = 100 + which;
    oracle::Random random(seed);
    SmallMap small = capped(kCaps[which]);
    const double limit = static_cast<double>(kCaps[which].max_evidence) + kTolerance;
    for (int step = 0; step < 2000; ++step) {
      INFO("seed " << seed << ", step " << step << ", cap " << kCaps[which].max_evidence);
      const VoxelCoord v = random_write(small.map, random);
      for (int i = 0; i < kOctetVoxels; ++i) {
        const VoxelCoord in_octet{(v.x & ~1) + (i & 1), (v.y & ~1) + (i >> 1 & 1),
                                  (v.z & ~1) + (i >> 2)};
        REQUIRE(small.map.evidence(in_octet).total() <= limit);
      }
    }
  }
}

TEST_CASE("cap: the counters of voxels equal a recount after every random write") {
  for (std::size_t which = 0; which < kCaps.size(); ++which) {
    const std::uint64_t seed = 200 + which;
    oracle::Random random(seed);
    SmallMap small = capped(kCaps[which]);
    for (int step = 0; step < 400; ++step) {
      INFO("seed " << seed << ", step " << step << ", cap " << kCaps[which].max_evidence);
      random_write(small.map, random);
      const Content content = content_of(small.map);
      REQUIRE(content.label_voxels == recount_label_voxels(content));
      REQUIRE(content.free_voxels == recount_free_voxels(content));
    }
  }
}

TEST_CASE("cap: a write changes the voxels it is for and no others") {
  for (std::size_t which = 0; which < kCaps.size(); ++which) {
    const std::uint64_t seed = 300 + which;
    oracle::Random random(seed);
    SmallMap small = capped(kCaps[which]);
    for (int step = 0; step < 400; ++step) {
      INFO("seed " << seed << ", step " << step << ", cap " << kCaps[which].max_evidence);
      Content before = content_of(small.map);
      const VoxelCoord v = random_write(small.map, random);
      Content after = content_of(small.map);
      before.evidence.erase({v.z, v.y, v.x});
      after.evidence.erase({v.z, v.y, v.x});
      REQUIRE(after.evidence == before.evidence);
    }
  }
}

TEST_CASE("cap: labels for one voxel leave a saturated free voxel of the same octet alone") {
  SmallMap small = capped({15.0F, 0.3F});  // in floats 50 passes are a little more than the cap
  carve_times(small.map, 60);
  REQUIRE(hit(small.map, kNeighbour, 1, 1.0F) == Status::kOk);
  CHECK(small.map.evidence(kVoxel).sigma[0] == 50.0F * 0.3F);
}

TEST_CASE(
    "cap: a hit reoccupies a voxel that was carved for ever, within a bounded number of hits") {
  for (const Caps& caps : kCaps) {
    for (const float weight : {0.1F, 0.5F, 1.0F}) {
      INFO("cap " << caps.max_evidence << ", weight " << weight);
      SmallMap small = capped(caps);
      carve_times(small.map, 600);
      REQUIRE(small.map.query(kVoxel).state == VoxelState::kFree);
      // With every hit labels go from s to (s + h) S / (S + h) at least: half the cap after ln 2 (S
      // / h + 1) hits.
      const double ratio = static_cast<double>(caps.max_evidence) / static_cast<double>(weight);
      const int bound = static_cast<int>(std::log(2.0) * (ratio + 1.0)) + 2;
      int hits = 0;
      while (small.map.query(kVoxel).state != VoxelState::kOccupied && hits <= bound) {
        REQUIRE(hit(small.map, kVoxel, 1, weight) == Status::kOk);
        ++hits;
      }
      CHECK(hits <= bound);
    }
  }
}

TEST_CASE("cap: the smallest label is not swallowed by saturated free evidence") {
  SmallMap small(config_of_pages(16));
  carve_times(small.map, 250);
  REQUIRE(hit(small.map, kVoxel, 2, 1e-6F) == Status::kOk);
  CHECK(label_evidence(small.map, kVoxel) == Approx(1e-6));
  CHECK(small.map.usage().label_voxels == 1);
}

}  // namespace
}  // namespace tessera
