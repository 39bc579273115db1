// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A block's labels added at once are those of its octets added one after the other.
#include <bit>
#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"
#include "support/small_map.hpp"

namespace tessera {
namespace {

constexpr int kClasses = 5;
constexpr std::size_t kComponents = kClasses + 2;
constexpr std::size_t kRows = 64;
constexpr std::size_t kRow = 12;  // of which eight are the block's

/// Sums of a block: few octets have any, and some rows are touched in vain.
class RandomSums {
 public:
  explicit RandomSums(oracle::Random& random)
      : sums_(kComponents * kRows * kRow), touched_(kComponents) {
    for (std::size_t c = 0; c < kComponents; ++c) {
      for (int octets = random.below(12); octets > 0; --octets) {
        const int octet = random.below(kBlockOctets);
        const std::size_t row =
            static_cast<std::size_t>(2 * ((octet >> 2) & 3) + 16 * (octet >> 4));
        const auto x = static_cast<std::size_t>(2 * (octet & 3));
        touched_[c] |= std::uint64_t{0x303} << row;
        for (const std::size_t r : {row, row + 1, row + 8, row + 9}) {
          for (std::size_t i = 0; i < 2; ++i)
            sums_[(c * kRows + r) * kRow + x + i] =
                random.below(2) == 0 ? 0.0F : static_cast<float>(random.uniform(0.001, 40.0));
        }
      }
      if (touched_[c] != 0) components_ |= std::uint64_t{1} << c;
    }
  }
  [[nodiscard]] BlockEvidence evidence() const {
    return {.sums = sums_.data(),
            .row = kRow,
            .component = kRows * kRow,
            .components = components_,
            .touched = touched_.data(),
            .touched_stride = 1,
            .has_rest = (components_ & 1U) != 0};
  }

 private:
  std::vector<float> sums_;
  std::vector<std::uint64_t> touched_;
  std::uint64_t components_ = 0;
};

OctetEvidence octet_of(const BlockEvidence& block, int octet) {
  OctetEvidence result;
  for (std::size_t c = 0; c < kComponents; ++c) {
    if (((block.components_of(octet) >> c) & 1U) != 0)
      result.assign(static_cast<int>(c), block.read(octet, static_cast<int>(c)));
  }
  return result;
}

MapConfig config_of(TuplePolicy tuple, std::size_t pages) {
  MapConfig config = config_of_pages(pages);
  config.tuple = tuple;
  return config;
}

TEST_CASE("a block's labels: at once and octet by octet are the same, cap and passes included") {
  const TuplePolicy tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  SmallMap at_once(config_of(tuple, 64), kClasses);
  SmallMap one_by_one(config_of(tuple, 64), kClasses);
  oracle::Random random(23);
  for (int round = 0; round < 60; ++round) {
    const RandomSums sums(random);
    const std::uint64_t octets = random.bits() | random.bits();
    const SlabHandle block = *at_once.map.open_block({0, 0, 0});
    const SlabHandle other = *one_by_one.map.open_block({0, 0, 0});
    int with_any = 0;
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      if (((octets >> octet) & 1U) == 0) continue;
      const OctetEvidence added = octet_of(sums.evidence(), octet);
      with_any += (added.components() & ~std::uint64_t{1}) != 0 ? 1 : 0;
      REQUIRE(one_by_one.map.add_labels(other, octet, added) == Status::kOk);
    }
    const Result<int> written = at_once.map.add_labels(block, octets, sums.evidence());
    REQUIRE(written.ok());
    REQUIRE(*written == with_any);
    VoxelMask passes{};
    for (std::uint64_t& word : passes) word = random.bits();
    REQUIRE(at_once.map.add_free_pass(block, passes) == Status::kOk);
    REQUIRE(one_by_one.map.add_free_pass(other, passes) == Status::kOk);
  }
  for (int i = 0; i < kBlockVoxels; ++i) {
    const VoxelCoord v{i % 8, i / 8 % 8, i / 64};
    REQUIRE(at_once.map.evidence(v).sigma == one_by_one.map.evidence(v).sigma);
    REQUIRE(at_once.map.evidence(v).rest == one_by_one.map.evidence(v).rest);
  }
  CHECK(at_once.map.usage().label_voxels == one_by_one.map.usage().label_voxels);
  CHECK(at_once.map.usage().label_voxels > 100);
}

TEST_CASE("a block's labels: what does not fit is refused and counted, what came before is added") {
  const TuplePolicy tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  SmallMap small(config_of(tuple, 4), kClasses);
  std::vector<float> sums(kComponents * kRows * kRow);
  std::vector<std::uint64_t> touched(kComponents);
  for (std::size_t i = 0; i < kRows * kRow; ++i) sums[kRows * kRow + i] = 1.0F;  // all of class 1
  touched[1] = ~std::uint64_t{0};
  const BlockEvidence evidence{.sums = sums.data(),
                               .row = kRow,
                               .component = kRows * kRow,
                               .components = 2,
                               .touched = touched.data(),
                               .touched_stride = 1};
  // Compact octets of one block would just fit.
  REQUIRE(small.map.add_labels(*small.map.open_block({1, 0, 0}), 0x3ff, evidence).ok());
  const std::uint64_t before = small.map.usage().label_voxels;
  CHECK(before == 80);
  const SlabHandle block = *small.map.open_block({0, 0, 0});
  const std::uint64_t refused = small.map.usage().storage_refused;
  const Result<int> written = small.map.add_labels(block, ~std::uint64_t{0}, evidence);
  REQUIRE(written.status() == Status::kResourceExhausted);
  CHECK(small.map.usage().storage_refused == refused + 1);
  const std::uint64_t octets = small.map.octets_of(small.map.block_at(block));
  // The first ones, without a gap, each with its evidence.
  CHECK(octets != 0);
  CHECK((octets & (octets + 1)) == 0);
  CHECK(small.map.usage().label_voxels ==
        before + 8 * static_cast<std::uint64_t>(std::popcount(octets)));
}

}  // namespace
}  // namespace tessera
