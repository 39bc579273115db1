// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Both tuple policies keep where returns were, as long as there is label evidence, and no count
// depends on it.
#include <array>
#include <catch2/catch.hpp>

#include "tessera/semantics/internal/tuple_store.hpp"

namespace tessera {
namespace {

constexpr int kOwnComponents = 8;
constexpr std::size_t kMostBytes = 512;

struct OwnOctet {
  explicit OwnOctet(TuplePolicy policy) : store(policy, 100.0F) {}

  TupleStore::Plane add(int component, const TupleStore::Plane& counts,
                        const OctetCentroids& centroids) {
    OctetEvidence evidence;
    evidence.assign(component, counts);
    evidence.set_centroids(centroids);
    return store.add(bytes.data(), evidence);
  }
  [[nodiscard]] VoxelEvidence read(int voxel) const {
    VoxelEvidence found{.num_components = kOwnComponents};
    store.read(bytes.data(), voxel, found);
    return found;
  }
  TupleStore store;
  alignas(32) std::array<std::byte, kMostBytes> bytes{};
};

constexpr Centroid kLow = Centroid::of_levels({0, 1, 2});
constexpr Centroid kHigh = Centroid::of_levels({5, 4, 3});
constexpr Centroid kMiddle = Centroid::of_levels({2, 3, 2});

TEST_CASE("tuples: of the centroids of what is added to a voxel the nearest to the middle stays") {
  const auto policy = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  OwnOctet octet(policy);
  octet.add(3, {1, 0, 0, 2}, {kLow, kLow, {}, {}});
  CHECK(octet.store.centroids(octet.bytes.data()) == OctetCentroids{kLow});
  octet.add(4, {1, 1, 1, 1}, {kHigh, kHigh, {}, kHigh});
  CHECK(octet.store.centroids(octet.bytes.data()) ==
        OctetCentroids{kLow.nearer(kHigh), kHigh, {}, kHigh});
  CHECK(octet.read(0).centroid == kLow.nearer(kHigh));
  octet.add(5, {0, 1}, {kMiddle, {}});
  CHECK(octet.read(0).centroid == kLow.nearer(kHigh));  // nothing was added to it
  octet.add(5, {1, 1}, {kMiddle, {}});
  CHECK(octet.read(0).centroid == kMiddle);
  CHECK(octet.read(1).centroid == kHigh);
  CHECK(octet.read(0).sigma[3] == 1.0F);
  CHECK(octet.read(0).sigma[4] == 1.0F);
  CHECK(octet.read(0).sigma[5] == 1.0F);
  CHECK(octet.read(0).rest == 0.0F);
  CHECK(octet.store.label_sums(octet.bytes.data()) == TupleStore::Plane{3, 3, 1, 3});
}

TEST_CASE(
    "tuples: a centroid stays while a voxel's evidence is scaled, and goes with the last of it") {
  const auto policy = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  OwnOctet octet(policy);
  octet.add(3, {8, 8}, {kLow, kHigh});
  octet.store.scale(octet.bytes.data(), 0, 0.5F);
  CHECK(octet.read(0).centroid == kLow);
  CHECK(octet.read(0).sigma[3] == 4.0F);
  octet.store.scale(octet.bytes.data(), 0, 0.0F);
  CHECK_FALSE(octet.read(0).centroid.known());
  CHECK(octet.read(0).total() == 0.0);
  CHECK(octet.read(1).centroid == kHigh);
}

TEST_CASE("tuples: evidence of no class has a centroid beside it, and neither changes the other") {
  OwnOctet octet(TuplePolicy::kCompact);
  octet.store.add_rest(octet.bytes.data(), {0.5F}, {kHigh, kLow}, kOwnComponents);
  CHECK_FALSE(octet.read(1).centroid.known());
  CHECK(octet.read(0).centroid == kHigh);
  octet.store.add_rest(octet.bytes.data(), {200.0F}, {}, kOwnComponents);
  CHECK(octet.read(0).centroid == kHigh);
  CHECK(octet.read(0).rest == Approx(128.0F).epsilon(1e-6));  // all that a count can be
  int rests = 0;
  octet.store.visit(
      octet.bytes.data(), 1, [](int, float) { FAIL("nothing is there"); }, [&](float) { ++rests; });
  CHECK(rests == 0);
  CountSummary summary(kOwnComponents, 0.0F);
  octet.store.summarize(octet.bytes.data(), 0, summary);
  CHECK(summary.estimate(0.001).evidence == Approx(128.0).epsilon(1e-6));
}

TEST_CASE("tuples: what was read can be restored") {
  const auto policy = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  OwnOctet octet(policy);
  octet.add(3, {0, 2}, {Centroid(), kLow});
  const VoxelEvidence evidence = octet.read(1);
  OwnOctet other(policy);
  REQUIRE(other.store.holds(evidence));
  other.store.restore(other.bytes.data(), 6, evidence);
  CHECK(other.read(6).centroid == kLow);
  CHECK(other.read(6).sigma[3] == 2.0F);
  CHECK_FALSE(other.read(5).centroid.known());
}

}  // namespace
}  // namespace tessera
