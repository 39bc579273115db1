// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compact tuples in the widest lanes that this machine has and in lanes of four: the same bits.
#include <catch2/catch.hpp>
#include <cstring>

#include "support/cloud.hpp"
#include "tessera/semantics/internal/compact_tuple.hpp"
#include "tessera/semantics/internal/label_shares.hpp"

namespace tessera {
namespace {

using oracle::announce_seed;
using oracle::Random;

constexpr float kWidthQuanta = 4096.0F;
constexpr int kNotLabelled = 9;

using OctetBytes = std::array<std::byte, CompactTuple::kOctetBytes>;

OctetEvidence random_evidence(Random& random, std::uint64_t components) {
  OctetEvidence evidence;
  for (int l = 0; l <= kNotLabelled; ++l) {
    if (((components >> static_cast<unsigned>(l)) & 1U) == 0) continue;
    OctetEvidence::Plane& plane = evidence.plane(l);
    for (float& count : plane) {
      const double kind = random.uniform(0.0, 1.0);
      // Nothing, under half a quantum, usual, more than a slot holds.
      count = kind < 0.3    ? 0.0F
              : kind < 0.4  ? 1e-5F
              : kind < 0.97 ? static_cast<float>(random.uniform(0.0, 3.0))
                            : 5000.0F;
    }
  }
  return evidence;
}

LabelShares random_shares(Random& random) {
  LabelShares shares;
  const int count = 1 + static_cast<int>(random.uniform(0.0, 3.0));
  for (int l = 1; l <= count; ++l)
    shares.offer(static_cast<std::uint8_t>(2 * l), static_cast<float>(random.uniform(0.1, 1.0)));
  shares.divide(1.0F / 16.0F);
  return shares;
}

TEST_CASE("CompactTuple: the widest lanes and lanes of four give the same bits") {
  Random random(announce_seed(77));
  const CompactTuple widest(kWidthQuanta, LaneWidth::kWidest);
  const CompactTuple four(kWidthQuanta, LaneWidth::kFour);
  for (int round = 0; round < 300; ++round) {
    OctetBytes a{};
    OctetBytes b{};
    for (int step = 0; step < 6; ++step) {
      // Unlabelled evidence in some, which is shared out voxel by voxel.
      const auto components = static_cast<std::uint64_t>(random.uniform(0.0, 1024.0));
      const std::uint64_t kept = round % 2 == 0 ? components & 0x1ffU : components;
      const OctetEvidence evidence = random_evidence(random, kept);
      const auto voxels = static_cast<unsigned>(random.uniform(0.0, 256.0));
      CompactTuple::Plane sums_a{};
      CompactTuple::Plane sums_b{};
      if (step % 2 == 0) {
        sums_a = widest.add(a.data(), evidence);
        sums_b = four.add(b.data(), evidence);
      } else {
        const LabelShares shares = random_shares(random);
        OctetEvidence gathered = random_evidence(random, (kept & 0x201U) | 1U << shares.labels[0]);
        sums_a = widest.add_shared(a.data(), gathered, voxels, shares, kNotLabelled);
        sums_b = four.add_shared(b.data(), gathered, voxels, shares, kNotLabelled);
      }
      REQUIRE(sums_a == sums_b);
      REQUIRE(sums_a == widest.label_sums(a.data()));
      REQUIRE(std::memcmp(a.data(), b.data(), a.size()) == 0);
    }
  }
}

TEST_CASE("CompactTuple: adding with shares is sharing, adding and sharing in one pass") {
  Random random(announce_seed(78));
  const CompactTuple tuple(kWidthQuanta);
  for (int round = 0; round < 300; ++round) {
    OctetBytes one{};
    static_cast<void>(tuple.add(one.data(), random_evidence(random, 0x1d5U)));
    OctetBytes three = one;
    const LabelShares shares = random_shares(random);
    const bool unlabelled = round % 2 == 0;
    const OctetEvidence added =
        random_evidence(random, (unlabelled ? 0x200U : 0U) | 1U | 1U << shares.labels[0]);
    const unsigned voxels = labelled_voxels(added);
    static_cast<void>(tuple.add_shared(one.data(), added, voxels, shares, kNotLabelled));
    tuple.share(three.data(), voxels, shares.first(), kNotLabelled);
    static_cast<void>(tuple.add(three.data(), added));
    if (shares.count > 1) tuple.share(three.data(), voxels, shares, kNotLabelled);
    REQUIRE(std::memcmp(one.data(), three.data(), one.size()) == 0);
  }
}

}  // namespace
}  // namespace tessera
