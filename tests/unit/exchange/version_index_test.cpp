// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/version_index.hpp"

#include <catch2/catch.hpp>
#include <memory>
#include <vector>

#include "support/cloud.hpp"

namespace tessera {
namespace {

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
