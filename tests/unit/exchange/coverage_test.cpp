// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/coverage.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/cloud.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

/// Parts for coverages.
struct CoverageParts {
  explicit CoverageParts(std::uint32_t parts)
      : memory(PartPool<Coverage::Part>::required_bytes(parts)) {
    Arena arena(memory.span());
    pool = *PartPool<Coverage::Part>::make(arena, parts);
  }
  AlignedMemory memory;
  PartPool<Coverage::Part>* pool;
};

std::set<std::uint32_t> versions_of(const Coverage& coverage) {
  std::set<std::uint32_t> versions;
  for (const VersionRange& range : coverage.ranges()) {
    for (std::uint32_t version = range.first; version <= range.last; ++version)
      versions.insert(version);
  }
  return versions;
}

TEST_CASE("coverage: is the union of what was added, in whatever order") {
  oracle::Random random(oracle::announce_seed(601));
  for (int round = 0; round < 300; ++round) {
    Coverage coverage;
    std::set<std::uint32_t> wanted;
    // Few numbers, so that there are never more ranges than fit.
    for (int i = 0; i < 30; ++i) {
      const auto first = static_cast<std::uint32_t>(1 + random.below(60));
      const auto last = first + static_cast<std::uint32_t>(random.below(6));
      bool news = false;
      for (std::uint32_t version = first; version <= last; ++version)
        news = wanted.insert(version).second || news;
      REQUIRE(coverage.contains({first, last}) == !news);
      REQUIRE(coverage.add({first, last}) == news);
      REQUIRE(coverage.contains({first, last}));
      REQUIRE(versions_of(coverage) == wanted);
    }
    std::uint32_t complete = 0;
    while (wanted.count(complete + 1) != 0) ++complete;
    REQUIRE(coverage.complete_to() == complete);
    std::vector<VersionRange> gaps(64);
    gaps.resize(coverage.gaps(70, gaps));
    std::set<std::uint32_t> lacking;
    for (const VersionRange& gap : gaps) {
      for (std::uint32_t version = gap.first; version <= gap.last; ++version)
        lacking.insert(version);
    }
    for (std::uint32_t version = 1; version <= 70; ++version)
      REQUIRE(lacking.count(version) + wanted.count(version) == 1);
  }
}

TEST_CASE("coverage: what does not fit is forgotten, the shortest first, and never claimed") {
  CoverageParts parts(1);
  Coverage coverage;
  coverage.use(*parts.pool);
  for (std::uint32_t i = 0; i < Coverage::kMostRanges; ++i)
    CHECK(coverage.add({10 * i + 1, 10 * i + 5}));
  CHECK(coverage.ranges().size() == Coverage::kMostRanges);
  constexpr std::uint32_t kBeyond = 20 * Coverage::kMostRanges;
  CHECK_FALSE(coverage.add({kBeyond, kBeyond}));
  CHECK_FALSE(coverage.contains({kBeyond, kBeyond}));
  CHECK(coverage.add({kBeyond, kBeyond + 9}));
  CHECK(coverage.contains({kBeyond, kBeyond + 9}));
  CHECK(coverage.ranges().size() == Coverage::kMostRanges);
  // One of the others went; of the rest nothing changed.
  std::size_t whole = 0;
  for (std::uint32_t i = 0; i < Coverage::kMostRanges; ++i)
    whole += coverage.contains({10 * i + 1, 10 * i + 5}) ? 1U : 0U;
  CHECK(whole == Coverage::kMostRanges - 1);
}

TEST_CASE(
    "coverage: has a part of the pool while it has many ranges, and few where there is none") {
  CoverageParts parts(1);
  Coverage first;
  Coverage second;
  first.use(*parts.pool);
  second.use(*parts.pool);
  const auto range = [](std::uint32_t i) { return VersionRange{10 * i + 1, 10 * i + 5}; };
  constexpr std::uint32_t kFew = Coverage::kFewRanges;
  for (std::uint32_t i = 0; i < kFew; ++i) CHECK(first.add(range(i)));
  CHECK(parts.pool->free() == 1);
  for (std::uint32_t i = kFew; i < 2 * kFew; ++i) CHECK(first.add(range(i)));
  CHECK(parts.pool->free() == 0);
  CHECK(first.ranges().size() == 2 * kFew);
  for (std::uint32_t i = 0; i < 2 * kFew; ++i) second.add(range(i));
  CHECK(second.ranges().size() == kFew);
  // Few are left, and then the part is another's.
  first.trim(10 * (kFew / 2));
  CHECK(parts.pool->free() == 1);
  CHECK(first.ranges().size() == kFew / 2);
  for (std::uint32_t i = 0; i < kFew / 2; ++i) CHECK(first.contains(range(i)));
  CHECK(second.add({10'001, 10'020}));
  CHECK(second.ranges().size() == kFew + 1);
  CHECK(parts.pool->free() == 0);
  // One range in place of many.
  CHECK(second.add({1, 10'000}));
  CHECK(second.ranges().size() == 1);
  CHECK(second.complete_to() == 10'020);
  CHECK(parts.pool->free() == 1);
}

TEST_CASE("coverage: what a range lacks is its versions that no range has") {
  Coverage coverage;
  CHECK(coverage.lacking({3, 12}) == 10);
  CHECK(coverage.lacking({4, 3}) == 0);
  for (const VersionRange range : {VersionRange{1, 4}, VersionRange{8, 9}, VersionRange{12, 20}})
    coverage.add(range);
  for (std::uint32_t first = 1; first < 24; ++first) {
    std::uint32_t lacking = 0;
    for (std::uint32_t last = first; last < 24; ++last) {
      lacking += coverage.contains({last, last}) ? 0U : 1U;
      CHECK(coverage.lacking({first, last}) == lacking);
    }
  }
}

TEST_CASE("coverage: the highest versions are versions as others are") {
  Coverage coverage;
  constexpr std::uint32_t kLast = ~std::uint32_t{0};
  CHECK(coverage.add({kLast - 1, kLast}));
  CHECK(coverage.add({1, kLast - 2}));
  CHECK(coverage.complete_to() == kLast);
  CHECK(coverage.ranges().size() == 1);
  std::vector<VersionRange> gaps(4);
  CHECK(coverage.gaps(kLast, gaps) == 0);
  coverage.clear();
  CHECK(coverage.gaps(kLast, gaps) == 1);
  CHECK(gaps[0] == VersionRange{1, kLast});
  CHECK(coverage.gaps(0, gaps) == 0);
}

}  // namespace
}  // namespace tessera
