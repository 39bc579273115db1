// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The compact tuple: against its rule written plainly, and its error against the dense tuple.
#include "tessera/semantics/internal/compact_tuple.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "support/random.hpp"
#include "tessera/semantics/internal/dense_tuple.hpp"

namespace tessera {
namespace {

constexpr int kComponents = 21;
constexpr float kCap = 100.0F;
constexpr float kQuanta = CompactTuple::quanta_per_unit(kCap);
constexpr std::uint32_t kMost = (1U << 24U) - 1U;

static_assert(CompactTuple::kOctetBytes == 128, "16 bytes a voxel");
static_assert(CompactTuple::quanta_per_unit(100.0F) == 131072.0F);
static_assert(CompactTuple::quanta_per_unit(250.0F) == 65536.0F);
static_assert(CompactTuple::quanta_per_unit(1e6F) == 16.0F);
static_assert(CompactTuple::quanta_per_unit(0.0F) == 4096.0F, "2^-12 is the least contribution");

/// One voxel, as the rule says it in words.
struct PlainVoxel {
  std::map<int, std::uint32_t> slots;
  std::uint32_t rest = 0;

  static std::uint32_t sum(std::uint32_t a, std::uint32_t b) { return std::min(a + b, kMost); }

  void add(int component, float count) {
    const float exact = count * kQuanta + 0.5F;
    const bool fits = exact < static_cast<float>(kMost);
    const std::uint32_t quanta = fits ? static_cast<std::uint32_t>(exact) : kMost;
    if (quanta == 0) return;
    if (slots.count(component) != 0 || slots.size() < CompactTuple::kSlots) {
      slots[component] = sum(slots[component], quanta);
      return;
    }
    auto least = slots.begin();
    for (auto slot = slots.begin(); slot != slots.end(); ++slot) {
      if (slot->second <= least->second) least = slot;  // among equals the highest class
    }
    if (quanta > least->second) {
      rest = sum(rest, least->second);
      slots.erase(least);
      slots[component] = quanta;
    } else {
      rest = sum(rest, quanta);
    }
  }
  void scale(float factor) {
    const auto scaled = [factor](std::uint32_t count) {
      return static_cast<std::uint32_t>(static_cast<float>(count) * factor);
    };
    rest = scaled(rest);
    for (auto slot = slots.begin(); slot != slots.end();) {
      slot->second = scaled(slot->second);
      slot = slot->second == 0 ? slots.erase(slot) : std::next(slot);
    }
  }
};

class Octet {
 public:
  std::byte* data() { return memory_.data(); }
  [[nodiscard]] VoxelEvidence read(int voxel) const {
    VoxelEvidence evidence;
    evidence.num_components = kComponents;
    tuple.read(memory_.data(), voxel, evidence);
    return evidence;
  }
  CompactTuple tuple{kQuanta};

 private:
  alignas(64) std::array<std::byte, CompactTuple::kOctetBytes> memory_{};
};

OctetEvidence one(int component, int voxel, float count) {
  OctetEvidence added;
  added.plane(component)[static_cast<std::size_t>(voxel)] = count;
  return added;
}

bool agrees(const VoxelEvidence& evidence, const PlainVoxel& plain) {
  for (int l = 0; l < kComponents; ++l) {
    const auto slot = plain.slots.find(l);
    const std::uint32_t quanta = slot == plain.slots.end() ? 0 : slot->second;
    if (evidence.sigma[static_cast<std::size_t>(l)] != static_cast<float>(quanta) / kQuanta)
      return false;
  }
  return evidence.rest == static_cast<float>(plain.rest) / kQuanta;
}

TEST_CASE("CompactTuple: is its rule, through random adds and scales of many classes") {
  oracle::Random random(7);
  Octet octet;
  std::array<PlainVoxel, kOctetVoxels> plain;
  for (int step = 0; step < 4000; ++step) {
    if (random.below(10) == 0) {
      const auto voxel = random.below(kOctetVoxels);
      const float factor = random.below(8) == 0 ? 0.0F : static_cast<float>(random.uniform(0, 1));
      CompactTuple::scale(octet.data(), voxel, factor);
      plain[static_cast<std::size_t>(voxel)].scale(factor);
    } else {
      OctetEvidence added;
      const int classes = 1 + random.below(4);
      for (int i = 0; i < classes; ++i) {
        const int component = 1 + random.below(kComponents - 1);
        // Coarse, so that counts are often equal; sometimes less than half a quantum.
        for (float& count : added.plane(component))
          count = random.below(3) == 0
                      ? static_cast<float>(random.below(5)) * (random.below(2) == 0 ? 0.25F : 1e-6F)
                      : 0.0F;
      }
      octet.tuple.add(octet.data(), added);
      for (int l = 1; l < kComponents; ++l) {
        if (((added.components() >> static_cast<unsigned>(l)) & 1U) == 0) continue;
        for (std::size_t v = 0; v < kOctetVoxels; ++v) plain[v].add(l, added.read(l)[v]);
      }
    }
    const CompactTuple::Plane sums = octet.tuple.label_sums(octet.data());
    for (int v = 0; v < kOctetVoxels; ++v) {
      const VoxelEvidence evidence = octet.read(v);
      REQUIRE(agrees(evidence, plain[static_cast<std::size_t>(v)]));
      REQUIRE(static_cast<double>(sums[static_cast<std::size_t>(v)]) ==
              Approx(evidence.total()).epsilon(1e-6));
    }
  }
}

TEST_CASE("CompactTuple: the error against the dense tuple is within its bound") {
  oracle::Random random(11);
  const double quantum = 1.0 / static_cast<double>(kQuanta);
  for (int run = 0; run < 200; ++run) {
    Octet octet;
    std::array<double, kComponents> exact{};
    const int n = 1 + random.below(60);
    const int classes = 1 + random.below(6);
    for (int i = 0; i < n; ++i) {
      const int component = 1 + random.below(classes);
      const auto count = static_cast<float>(random.uniform(0, 1.5));
      octet.tuple.add(octet.data(), one(component, 3, count));
      exact[static_cast<std::size_t>(component)] += static_cast<double>(count);
    }
    const VoxelEvidence evidence = octet.read(3);
    const double rounding = 0.5 * n * quantum + 1e-9;
    double total = 0.0;
    for (std::size_t l = 1; l < kComponents; ++l) {
      const auto held = static_cast<double>(evidence.sigma[l]);
      REQUIRE(held <= exact[l] + rounding);
      REQUIRE(held >= exact[l] - static_cast<double>(evidence.rest) - rounding);
      total += exact[l];
    }
    REQUIRE(std::abs(evidence.total() - total) <= rounding);
    if (classes <= CompactTuple::kSlots) REQUIRE(evidence.rest == 0.0F);
  }
}

TEST_CASE("CompactTuple: among equal counts the highest class gives way") {
  Octet octet;
  for (const int component : {9, 2, 5}) octet.tuple.add(octet.data(), one(component, 0, 1.0F));
  octet.tuple.add(octet.data(), one(7, 0, 1.0F));  // no more than they have: to the rest
  CHECK(octet.read(0).sigma[7] == 0.0F);
  CHECK(octet.read(0).rest == 1.0F);
  octet.tuple.add(octet.data(), one(7, 0, 2.0F));
  const VoxelEvidence evidence = octet.read(0);
  CHECK(evidence.sigma[9] == 0.0F);
  CHECK(evidence.sigma[7] == 2.0F);
  CHECK(evidence.sigma[2] == 1.0F);
  CHECK(evidence.sigma[5] == 1.0F);
  CHECK(evidence.rest == 2.0F);
}

TEST_CASE("CompactTuple: counts and rest saturate") {
  Octet octet;
  const float most = static_cast<float>(kMost) / kQuanta;
  for (int i = 0; i < 3; ++i) octet.tuple.add(octet.data(), one(4, 1, 90.0F));
  CHECK(octet.read(1).sigma[4] == most);
  octet.tuple.add(octet.data(), one(4, 2, 1e9F));
  CHECK(octet.read(2).sigma[4] == most);
  for (int component = 5; component < 20; ++component)
    octet.tuple.add(octet.data(), one(component, 1, 90.0F));
  CHECK(octet.read(1).rest == most);
}

TEST_CASE("CompactTuple: what was read can be restored, bit by bit") {
  oracle::Random random(5);
  for (int run = 0; run < 100; ++run) {
    Octet octet;
    Octet copy;
    for (int i = 0; i < 12; ++i)
      octet.tuple.add(octet.data(), one(1 + random.below(6), random.below(8),
                                        static_cast<float>(random.uniform(0, 40))));
    for (int v = 0; v < kOctetVoxels; ++v) {
      const VoxelEvidence evidence = octet.read(v);
      REQUIRE(copy.tuple.holds(evidence));
      copy.tuple.restore(copy.data(), v, evidence);
      REQUIRE(copy.read(v).sigma == evidence.sigma);
      REQUIRE(copy.read(v).rest == evidence.rest);
    }
    REQUIRE(copy.tuple.label_sums(copy.data()) == octet.tuple.label_sums(octet.data()));
  }
}

TEST_CASE("CompactTuple: counts that it cannot have are told") {
  const CompactTuple tuple(kQuanta);
  VoxelEvidence evidence;
  evidence.num_components = kComponents;
  CHECK(tuple.holds(evidence));
  for (const std::size_t l : {1U, 2U, 3U}) evidence.sigma[l] = 1.0F;
  CHECK(tuple.holds(evidence));
  evidence.sigma[4] = 1.0F;
  CHECK_FALSE(tuple.holds(evidence));
  evidence.sigma[4] = 0.0F;
  for (const float bad : {1e-7F, 129.0F, -1.0F, std::nanf("")}) {
    VoxelEvidence wrong = evidence;
    wrong.sigma[2] = bad;
    CHECK_FALSE(tuple.holds(wrong));
    wrong = evidence;
    wrong.rest = bad;
    CHECK_FALSE(tuple.holds(wrong));
  }
}

}  // namespace
TEST_CASE("compact tuple: plane 0 of what is added goes to the rests, up to what they hold") {
  alignas(64) std::array<std::byte, CompactTuple::kOctetBytes> octet{};
  const CompactTuple tuple(kQuanta);
  OctetEvidence added;
  added.plane(3)[2] = 5.0F;
  added.plane(0)[2] = 1.5F;
  added.plane(0)[7] = 200.0F;  // More than a count holds.
  REQUIRE(added.has_rest());
  for (int times = 1; times <= 2; ++times) {
    const CompactTuple::Plane sums = tuple.add(octet.data(), added);
    CHECK(sums[2] == 6.5F * static_cast<float>(times));
    VoxelEvidence evidence{.num_components = kComponents};
    tuple.read(octet.data(), 2, evidence);
    CHECK(evidence.sigma[3] == 5.0F * static_cast<float>(times));
    CHECK(evidence.sigma[0] == 0.0F);
    CHECK(evidence.rest == 1.5F * static_cast<float>(times));
    VoxelEvidence full{.num_components = kComponents};
    tuple.read(octet.data(), 7, full);
    CHECK(full.rest == static_cast<float>(kMost) / kQuanta);
  }
}

}  // namespace tessera
