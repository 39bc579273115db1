// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/version_index.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/cloud.hpp"

namespace tessera {
namespace {

/// Parts for indices.
struct BucketParts {
  explicit BucketParts(std::uint32_t parts)
      : memory(PartPool<VersionBuckets>::required_bytes(parts)) {
    Arena arena(memory.span());
    pool = *PartPool<VersionBuckets>::make(arena, parts);
  }
  AlignedMemory memory;
  PartPool<VersionBuckets>* pool;
};

/// An index with its links, and the versions of its records beside it.
struct Indexed {
  std::unique_ptr<VersionIndex> index = std::make_unique<VersionIndex>();
  std::vector<RecordLink> links;
  std::vector<std::uint32_t> versions;
  void add(std::uint32_t version) {
    versions.push_back(version);
    links.push_back({});
    const auto record = static_cast<std::uint32_t>(versions.size());
    index->add(links, record, version, sum_of(version));
  }
  [[nodiscard]] static std::uint64_t sum_of(std::uint32_t version) { return version * 77ULL; }
  [[nodiscard]] std::uint64_t sum(const VersionSpan& span) const {
    std::uint64_t sum = 0;
    for (const std::uint32_t version : versions)
      sum += span.first() <= version && version <= span.last() ? sum_of(version) : 0;
    return sum;
  }
};

TEST_CASE(
    "VersionIndex: a span has the sum of its records, one narrower than a bucket that of it") {
  oracle::Random random(oracle::announce_seed(610));
  Indexed indexed;
  for (int i = 0; i < 500; ++i) indexed.add(1 + static_cast<std::uint32_t>(random.below(1 << 20)));
  const std::uint8_t bucket = indexed.index->width();
  CHECK(bucket > 1);
  for (int i = 0; i < 1'000; ++i) {
    const auto width = static_cast<std::uint8_t>(random.below(33));
    const std::uint64_t spans = std::uint64_t{1} << (32U - width);
    const VersionSpan span{
        width, width == 32 ? 0
                           : static_cast<std::uint32_t>(
                                 static_cast<std::uint64_t>(random.below(1 << 21)) % spans)};
    const VersionSpan whole =
        width < bucket ? VersionSpan{bucket, span.index >> (bucket - width)} : span;
    REQUIRE(indexed.index->sum(span) == indexed.sum(whole));
  }
}

TEST_CASE("VersionIndex: with few parts or many it has the same records and sums") {
  oracle::Random random(oracle::announce_seed(611));
  const std::uint32_t parts = GENERATE(0U, 1U, 3U, 31U);
  BucketParts shared(parts);
  Indexed indexed;
  indexed.index->use(*shared.pool);
  for (int round = 0; round < 6; ++round) {
    const int most = 100 << (3 * round);
    for (int i = 0; i < 200; ++i) indexed.add(1 + static_cast<std::uint32_t>(random.below(most)));
    // Some are taken out again.
    for (int i = 0; i < 50; ++i) {
      const auto record =
          static_cast<std::uint32_t>(random.below(static_cast<int>(indexed.versions.size())));
      std::uint32_t& version = indexed.versions[record];
      if (version == 0) continue;
      indexed.index->remove(indexed.links, record + 1, version, Indexed::sum_of(version));
      version = 0;
    }
    const std::uint8_t bucket = indexed.index->width();
    for (int i = 0; i < 100; ++i) {
      const auto width = static_cast<std::uint8_t>(bucket + random.below(33 - bucket));
      const VersionSpan span{width, width >= 24 ? 0U : static_cast<std::uint32_t>(random.below(8))};
      REQUIRE(indexed.index->sum(span) == indexed.sum(span));
    }
    std::size_t visited = 0;
    std::vector<bool> seen(indexed.versions.size());
    indexed.index->visit(
        indexed.links, {1, kLastVersion},
        [&](std::uint32_t record) {
          ++visited;
          REQUIRE(indexed.versions[record - 1] != 0);
          REQUIRE_FALSE(seen[record - 1]);
          seen[record - 1] = true;
        },
        [](std::uint32_t) { return true; });
    REQUIRE(visited == static_cast<std::size_t>(
                           std::count_if(indexed.versions.begin(), indexed.versions.end(),
                                         [](std::uint32_t version) { return version != 0; })));
  }
  CHECK(indexed.index->width() >= 11);
  CHECK((parts == 31) == (indexed.index->width() <= 11));
  indexed.index->clear();
  CHECK(shared.pool->free() == parts);
  CHECK(indexed.index->sum({32, 0}) == 0);
}

TEST_CASE("VersionIndex: an index that needs none leaves the parts to the others") {
  BucketParts shared(2);
  Indexed small;
  Indexed large;
  small.index->use(*shared.pool);
  large.index->use(*shared.pool);
  for (std::uint32_t version = 1; version <= VersionBuckets::kCount; ++version) small.add(version);
  CHECK(shared.pool->free() == 2);
  CHECK(small.index->width() == 0);
  for (std::uint32_t version = 1; version <= 3 * VersionBuckets::kCount; ++version)
    large.add(version);
  CHECK(shared.pool->free() == 0);
  CHECK(large.index->width() == 0);
  small.add(VersionBuckets::kCount + 1);
  CHECK(small.index->width() == 1);
  // What two parts had is in one.
  large.add(3 * VersionBuckets::kCount + 1);
  CHECK(large.index->width() == 1);
  CHECK(shared.pool->free() == 1);
}

TEST_CASE("VersionIndex: records of a range are counted, unless the walk would be long") {
  Indexed indexed;
  for (std::uint32_t version = 1; version <= 100; ++version) indexed.add(version);
  const auto within = [&](std::uint32_t first, std::uint32_t last) {
    return [&, first, last](std::uint32_t record) {
      const std::uint32_t version = indexed.versions[record - 1];
      return first <= version && version <= last;
    };
  };
  CHECK(indexed.index->count(indexed.links, {11, 30}, 1'000, within(11, 30)) == 20U);
  CHECK(indexed.index->count(indexed.links, {200, kLastVersion}, 1'000,
                             within(200, kLastVersion)) == 0U);
  CHECK(indexed.index->count(indexed.links, {1, 100}, 100, within(1, 100)) == 100U);
  CHECK_FALSE(indexed.index->count(indexed.links, {1, 100}, 99, within(1, 100)).has_value());
}

}  // namespace
}  // namespace tessera
