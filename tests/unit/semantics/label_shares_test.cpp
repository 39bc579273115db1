// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Of which classes evidence is: what is kept, and how a tuple's counts are divided anew.
#include "tessera/semantics/internal/label_shares.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"
#include "tessera/semantics/internal/tuple_store.hpp"

namespace tessera {
namespace {

constexpr int kAllComponents = 8;
constexpr int kNoClass = kAllComponents - 1;

LabelShares shares_of(const std::vector<std::pair<int, float>>& offered, float least) {
  LabelShares shares;
  for (const auto& [label, share] : offered) shares.offer(static_cast<std::uint8_t>(label), share);
  if (shares.count != 0) shares.divide(least);
  return shares;
}

float of_classes(const VoxelEvidence& evidence) {
  float sum = 0.0F;
  for (int l = 1; l < kNoClass; ++l) sum += evidence.sigma[static_cast<std::size_t>(l)];
  return sum;
}

}  // namespace

TEST_CASE("label shares: the three largest, among equals the lower classes, of one in all") {
  const LabelShares shares =
      shares_of({{1, 2.0F}, {2, 6.0F}, {3, 2.0F}, {5, 2.0F}, {6, 4.0F}}, 0.0F);
  REQUIRE(shares.count == 3);
  CHECK(shares.labels == std::array<std::uint8_t, 3>{2, 6, 1});
  CHECK(shares.shares[0] == Approx(0.5));
  CHECK(shares.shares[1] == Approx(1.0 / 3.0));
  CHECK(shares.shares[2] == Approx(1.0 / 6.0));
  CHECK(shares.components() == 0b1000110U);
}

TEST_CASE("label shares: small ones are dropped, and nothing is no share") {
  CHECK(shares_of({{1, 0.0F}}, 0.1F).count == 0);
  const LabelShares shares = shares_of({{1, 1.0F}, {2, 16.1F}, {3, 1.1F}}, 1.0F / 16.0F);
  REQUIRE(shares.count == 2);
  CHECK(shares.labels[1] == 3);
  CHECK(shares.shares[0] + shares.shares[1] == Approx(1.0));
}

TEST_CASE("tuples: sharing keeps the sum, what is of no class, and voxels that it is not for") {
  const auto policy = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  const TupleStore store(policy, 100.0F);
  oracle::Random random(21);
  for (int round = 0; round < 300; ++round) {
    alignas(32) std::array<std::byte, TupleStore::octet_bytes(TuplePolicy::kDense, 64)> octet{};
    for (int scan = 0; scan < 3; ++scan) {
      OctetEvidence added;
      for (int c = 0; c < 3; ++c) {
        const int component = 1 + random.below(kAllComponents - 1);
        for (float& count : added.plane(component))
          count = random.below(3) == 0 ? 0.0F : static_cast<float>(random.uniform(0, 5));
      }
      if (policy == TuplePolicy::kCompact && random.below(2) == 0) added.plane(0)[2] = 0.75F;
      static_cast<void>(store.add(octet.data(), added));
    }
    const auto read = [&](int voxel) {
      VoxelEvidence evidence;
      evidence.num_components = kAllComponents;
      store.read(octet.data(), voxel, evidence);
      return evidence;
    };
    std::vector<VoxelEvidence> before;
    for (int v = 0; v < kOctetVoxels; ++v) before.push_back(read(v));
    LabelShares shares;
    for (int label = 1; label < kNoClass; ++label)
      if (random.below(2) == 0)
        shares.offer(static_cast<std::uint8_t>(label), static_cast<float>(random.uniform(0.1, 1)));
    if (shares.count == 0) continue;
    shares.divide(0.0F);
    const auto voxels = static_cast<unsigned>(random.below(256));
    store.share(octet.data(), voxels, shares, kAllComponents);
    for (int v = 0; v < kOctetVoxels; ++v) {
      const VoxelEvidence now = read(v);
      const VoxelEvidence& then = before[static_cast<std::size_t>(v)];
      const bool shared = ((voxels >> static_cast<unsigned>(v)) & 1U) != 0;
      const float sum = of_classes(then);
      CHECK(of_classes(now) == Approx(sum).margin(1e-5));
      CHECK(now.sigma[kNoClass] == then.sigma[kNoClass]);
      CHECK(now.rest == then.rest);
      CHECK(now.centroid == then.centroid);
      if (!shared || sum == 0.0F) {
        CHECK(now.sigma == then.sigma);
        continue;
      }
      // Beside unlabelled evidence a compact tuple has room for two classes.
      const bool room = policy == TuplePolicy::kDense || then.sigma[kNoClass] == 0.0F;
      const std::size_t kept = room ? shares.count : std::min<std::size_t>(shares.count, 2);
      float left = sum;
      for (std::size_t i = 1; i < kept; ++i) {
        CHECK(now.sigma[shares.labels[i]] == Approx(sum * shares.shares[i]).margin(1e-4));
        left -= now.sigma[shares.labels[i]];
      }
      CHECK(now.sigma[shares.labels[0]] == Approx(left).margin(1e-4));
    }
  }
}

}  // namespace tessera
