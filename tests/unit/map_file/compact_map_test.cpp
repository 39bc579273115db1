// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map of compact tuples beside a dense one with the same evidence: what it answers, its cap, its
// digest and its file.
#include <bit>
#include <catch2/catch.hpp>
#include <cstring>

#include "stored_bytes.hpp"
#include "support/sample_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {
namespace {

constexpr int kClasses = 8;
constexpr float kCap = 20.0F;

SmallMap map_of(TuplePolicy policy) {
  MapConfig config = config_of_pages(256);
  config.tuple = policy;
  config.max_evidence = kCap;
  return SmallMap(config, kClasses);
}

/// Hits and passes in few voxels, so that tuples overflow and the cap is reached. One class in four
/// of a voxel is the voxel's own, so that there is a winner.
void observe_much(LocalMap& map, std::uint64_t seed, int count) {
  SampleRandom random(seed);
  map.begin_revision();
  for (int i = 0; i < count; ++i) {
    const VoxelCoord v{random.integer(-6, 6), random.integer(-1, 0), random.integer(0, 1)};
    const int own = 1 + ((v.x + 6) % kClasses);
    const int component = random.integer(0, 2) == 0 ? random.integer(1, kClasses + 1) : own;
    const auto weight = static_cast<float>(random.uniform(0.0, 1.0));
    const bool free = random.integer(0, 5) == 0;
    REQUIRE((free ? carve(map, v) : hit(map, v, component, weight)) == Status::kOk);
  }
}

TEST_CASE("compact map: nearly always the dense map's label and state, its evidence to rounding") {
  for (const int count : {50, 500, 5000}) {
    SmallMap dense = map_of(TuplePolicy::kDense);
    SmallMap compact = map_of(TuplePolicy::kCompact);
    observe_much(dense.map, 3, count);
    observe_much(compact.map, 3, count);
    int voxels = 0;
    int other_label = 0;
    for (int x = -6; x <= 6; ++x) {
      for (int y = -1; y <= 0; ++y) {
        for (int z = 0; z <= 1; ++z) {
          const Estimate a = dense.map.query(VoxelCoord{x, y, z});
          const Estimate b = compact.map.query(VoxelCoord{x, y, z});
          CHECK(a.state == b.state);
          CHECK(b.evidence == Approx(a.evidence).epsilon(1e-3).margin(1e-4));
          CHECK(b.evidence <= static_cast<double>(kCap) * 1.0001);
          ++voxels;
          other_label += a.label == b.label ? 0 : 1;
        }
      }
    }
    CHECK(voxels == 52);
    CHECK(other_label <= 2);
  }
}

TEST_CASE("compact map: the rest is part of the evidence, of no class") {
  SmallMap sample = map_of(TuplePolicy::kCompact);
  for (const int component : {1, 2, 3, 4, 5})
    REQUIRE(hit(sample.map, {0, 0, 0}, component, component == 1 ? 2.0F : 1.0F) == Status::kOk);
  const VoxelEvidence evidence = sample.map.evidence(VoxelCoord{0, 0, 0});
  CHECK(evidence.rest == 2.0F);
  CHECK(evidence.total() == 6.0);
  const Estimate e = sample.map.query(VoxelCoord{0, 0, 0});
  CHECK(e.label == 1);
  CHECK(e.evidence == 6.0);
  const double prior = sample.map.config().prior;
  CHECK(estimate(evidence, prior).probability ==
        Approx((prior + 2.0) / ((kClasses + 2) * prior + 6.0)));
}

TEST_CASE("compact map: saving, loading and saving again gives the same bytes and digest") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    SmallMap sample = map_of(TuplePolicy::kCompact);
    observe_much(sample.map, seed, 3000);
    const StoredBytes first = stored(sample.map);
    const std::unique_ptr<LoadedMap> copy = loaded(first);
    CHECK(copy->map.config().tuple == TuplePolicy::kCompact);
    CHECK(content_of(copy->map) == content_of(sample.map));
    CHECK(digest_of(copy->map) == digest_of(sample.map));
    CHECK(stored(copy->map) == first);
    // And goes on as the map itself would have.
    observe_much(sample.map, seed + 10, 500);
    observe_much(copy->map, seed + 10, 500);
    CHECK(digest_of(copy->map) == digest_of(sample.map));
  }
}

TEST_CASE("compact map: takes a fraction of the memory, and tells it") {
  SmallMap dense = map_of(TuplePolicy::kDense);
  SmallMap compact = map_of(TuplePolicy::kCompact);
  observe_much(dense.map, 1, 3000);
  observe_much(compact.map, 1, 3000);
  CHECK(compact.map.usage().label_voxels == dense.map.usage().label_voxels);
  CHECK(digest_of(compact.map) != digest_of(dense.map));
  CHECK(TupleStore::octet_bytes(TuplePolicy::kCompact, 64) == 128);
  CHECK(TupleStore::octet_bytes(TuplePolicy::kCompact, 3) == 128);
}

TEST_CASE("compact map: counts that no compact tuple can have are not restored") {
  SmallMap sample = map_of(TuplePolicy::kCompact);
  const Result<SlabHandle> block = sample.map.open_block({0, 0, 0});
  REQUIRE(block.ok());
  VoxelEvidence evidence;
  evidence.num_components = sample.map.num_components();
  for (const std::size_t l : {1U, 2U, 3U, 4U}) evidence.sigma[l] = 1.0F;
  CHECK(sample.map.restore(*block, 0, 0, evidence, 0) == Status::kInvalidArgument);
  evidence.sigma[4] = 0.0F;
  evidence.rest = 1.0F;
  CHECK(sample.map.restore(*block, 0, 0, evidence, 0) == Status::kOk);
  SmallMap dense = map_of(TuplePolicy::kDense);
  const Result<SlabHandle> other = dense.map.open_block({0, 0, 0});
  REQUIRE(other.ok());
  CHECK(dense.map.restore(*other, 0, 0, evidence, 0) == Status::kInvalidArgument);
}

}  // namespace
}  // namespace tessera
