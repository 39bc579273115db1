// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is saved comes back: the content, the identity, and the very bytes.
#include <algorithm>
#include <catch2/catch.hpp>
#include <string_view>

#include "stored_bytes.hpp"
#include "support/sample_map.hpp"

namespace tessera {

TEST_CASE("saving, loading and saving again gives the same bytes") {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const SmallMap sample = sample_map(seed, 200, 40);
    const StoredBytes first = stored(sample.map);
    CHECK(stored(loaded(first)->map) == first);
  }
}

TEST_CASE("a loaded map has the saved map's content and digest") {
  const SmallMap sample = sample_map(5, 200, 40);
  const std::unique_ptr<LoadedMap> copy = loaded(stored(sample.map));
  CHECK(content_of(copy->map) == content_of(sample.map));
  CHECK(digest_of(copy->map) == digest_of(sample.map));
}

TEST_CASE("an empty map can be saved and loaded") {
  const SmallMap empty(config_of_pages(4), kSampleClasses);
  const StoredBytes first = stored(empty.map);
  const std::unique_ptr<LoadedMap> copy = loaded(first);
  CHECK(copy->map.block_count() == 0);
  CHECK(stored(copy->map) == first);
}

TEST_CASE("a block without evidence is not saved") {
  SmallMap sample = sample_map(6);
  const StoredBytes without = stored(sample.map);
  REQUIRE(sample.map.open_block({100, 0, 0}).ok());
  CHECK(stored(sample.map) == without);
}

TEST_CASE("the bytes do not depend on the storage's size or the order of insertion") {
  std::vector<Observation> observations = sample_observations(7, 150, 20);
  SmallMap forwards(config_of_pages(64), kSampleClasses);
  observe(forwards.map, observations);
  std::reverse(observations.begin(), observations.end());
  SmallMap backwards(config_of_pages(200), kSampleClasses);
  observe(backwards.map, observations);
  CHECK(stored(forwards.map) == stored(backwards.map));
}

TEST_CASE("blocks at the grid's corners survive") {
  SmallMap sample(config_of_pages(8), kSampleClasses);
  constexpr int kLow = -kVoxelLimit;
  constexpr int kHigh = kVoxelLimit - 1;
  observe(sample.map, {{{kLow, kLow, kLow}, 1, 1.0F}, {{kHigh, kHigh, kHigh}, 2, 1.0F}});
  CHECK(content_of(loaded(stored(sample.map))->map) == content_of(sample.map));
}

TEST_CASE("settings of the map come back bit by bit") {
  MapConfig config = config_of_pages(8);
  config.resolution_m = 0.3;
  config.prior = 1.0 / 3.0;
  config.max_evidence = 70.0F;
  config.free_weight = 0.7F;
  const SmallMap sample(config, 2);
  MapFileHeader header;
  REQUIRE(read_header(stored(sample.map), header).ok());
  CHECK(header.config.resolution_m == config.resolution_m);
  CHECK(header.config.prior == config.prior);
  CHECK(header.config.max_evidence == config.max_evidence);
  CHECK(header.config.free_weight == config.free_weight);
  CHECK(header.config.tuple == config.tuple);
}

TEST_CASE("what probabilities are of comes back, and is no part of the digest") {
  for (const TuplePolicy tuple : {TuplePolicy::kDense, TuplePolicy::kCompact}) {
    MapConfig config = config_of_pages(8);
    config.tuple = tuple;
    std::vector<std::uint64_t> digests;
    for (const Probabilities of : {Probabilities::kEffective, Probabilities::kShares}) {
      config.probabilities = of;
      SmallMap sample(config, 2);
      REQUIRE(hit(sample.map, {0, 0, 0}, 1, 2.0F) == Status::kOk);
      CHECK(sample.map.reading().is_effective() == (of == Probabilities::kEffective));
      MapFileHeader header;
      REQUIRE(read_header(stored(sample.map), header).ok());
      CHECK(header.config.probabilities == of);
      CHECK(header.config.tuple == tuple);
      digests.push_back(digest_of(sample.map));
    }
    CHECK(digests[0] == digests[1]);
  }
}

TEST_CASE("classes keep their order, names and colours") {
  ClassTable classes;
  REQUIRE(classes.add("road", {255, 0, 1}) == Status::kOk);
  REQUIRE(classes.add("a name that is longer than thirty-one bytes", {2, 254, 3}) == Status::kOk);
  REQUIRE(classes.add("", {}) == Status::kOk);
  const LoadedMap sample(config_of_pages(4), classes);
  MapFileHeader header;
  REQUIRE(read_header(stored(sample.map), header).ok());
  CHECK(header.classes == classes);
}

TEST_CASE("the largest table and the longest settings fit the header") {
  ClassTable classes;
  for (int i = 0; i < kMaxClasses; ++i) REQUIRE(classes.add("class", {}) == Status::kOk);
  const LoadedMap sample(config_of_pages(4), classes);
  MapIdentity identity;
  identity.settings.fill('s');
  identity.settings_bytes = MapIdentity::kMaxSettings;
  MapFileHeader header;
  REQUIRE(read_header(stored(sample.map, identity), header).ok());
  CHECK(header.classes == classes);
  CHECK(header.identity.settings == identity.settings);
}

TEST_CASE("the identity comes back whole") {
  MapIdentity identity{.kind = MapKind::kGlobal, .robot = 4000000000U, .epoch = 17};
  identity.has_T_global_map = true;
  identity.T_global_map << 0, -1, 0, 1.5, 1, 0, 0, -2.25, 0, 0, 1, 1e-3;
  constexpr std::string_view kSettings = R"({"resolution": 0.1})";
  std::copy(kSettings.begin(), kSettings.end(), identity.settings.begin());
  identity.settings_bytes = kSettings.size();
  const SmallMap sample = sample_map(8);
  MapFileHeader header;
  REQUIRE(read_header(stored(sample.map, identity), header).ok());
  CHECK(header.identity.kind == MapKind::kGlobal);
  CHECK(header.identity.robot == identity.robot);
  CHECK(header.identity.epoch == identity.epoch);
  CHECK(header.identity.has_T_global_map);
  CHECK(header.identity.T_global_map == identity.T_global_map);
  CHECK(std::string_view(header.identity.settings.data(), header.identity.settings_bytes) ==
        kSettings);
  CHECK(header.revision == sample.map.revision());
}

TEST_CASE("an identity without a frame stays without one") {
  const SmallMap sample = sample_map(8);
  MapFileHeader header;
  REQUIRE(read_header(stored(sample.map), header).ok());
  CHECK_FALSE(header.identity.has_T_global_map);
  CHECK(header.identity.settings_bytes == 0);
}

}  // namespace tessera
