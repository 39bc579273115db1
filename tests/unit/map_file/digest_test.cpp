// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The digest depends on the content, on all of it, and on nothing else.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "stored_bytes.hpp"
#include "support/sample_map.hpp"

namespace tessera {

namespace {

std::uint64_t digest_with(const MapConfig& config, const std::vector<Observation>& observations,
                          int num_classes = kSampleClasses) {
  SmallMap sample(config, num_classes);
  observe(sample.map, observations);
  return digest_of(sample.map);
}

const MapConfig kConfig = config_of_pages(64);

}  // namespace

TEST_CASE("the digest does not depend on the order of insertion") {
  std::vector<Observation> observations = sample_observations(1, 200, 20);
  const std::uint64_t expected = digest_with(kConfig, observations);
  SampleRandom random(2);
  for (int trial = 0; trial < 10; ++trial) {
    for (std::size_t i = observations.size() - 1; i > 0; --i)
      std::swap(observations[i],
                observations[static_cast<std::size_t>(random.integer(0, static_cast<int>(i)))]);
    CHECK(digest_with(kConfig, observations) == expected);
  }
}

TEST_CASE("the digest does not depend on the storage's size") {
  const std::vector<Observation> observations = sample_observations(3, 200, 20);
  const std::uint64_t expected = digest_with(kConfig, observations);
  for (const std::size_t pages : {50U, 100U, 1000U}) {
    CHECK(digest_with(config_of_pages(pages), observations) == expected);
  }
}

TEST_CASE("the digest does not depend on revisions or on blocks without evidence") {
  SmallMap sample = sample_map(4);
  const std::uint64_t expected = digest_of(sample.map);
  sample.map.begin_revision();
  REQUIRE(sample.map.open_block({50, 50, 50}).ok());
  CHECK(digest_of(sample.map) == expected);
}

TEST_CASE("the digest changes with any voxel's place, component or weight") {
  const std::vector<Observation> observations = sample_observations(5, 40, 10);
  std::set<std::uint64_t> digests{digest_with(kConfig, observations)};
  std::size_t expected = 1;
  const auto differs = [&](std::vector<Observation> changed) {
    digests.insert(digest_with(kConfig, changed));
    CHECK(digests.size() == ++expected);
  };
  for (std::size_t i = 0; i < observations.size(); ++i) {
    std::vector<Observation> changed = observations;
    changed[i].voxel.x += 100;
    differs(changed);
    changed = observations;
    changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(i));
    differs(changed);
    if (observations[i].component == 0) continue;
    changed = observations;
    changed[i].weight = std::nextafter(changed[i].weight, 100.0F);
    differs(changed);
    changed[i] = observations[i];
    changed[i].component = 0;
    changed[i].voxel.y += 100;
    differs(changed);
  }
}

TEST_CASE("the digest changes with one more free pass") {
  std::vector<Observation> observations{{{1, 2, 3}, 0}};
  const std::uint64_t once = digest_with(kConfig, observations);
  observations.push_back({{1, 2, 3}, 0});
  CHECK(digest_with(kConfig, observations) != once);
}

TEST_CASE("the digest changes with the resolution and the prior") {
  const std::vector<Observation> observations = sample_observations(6, 20, 10);
  const std::uint64_t expected = digest_with(kConfig, observations);
  MapConfig other = kConfig;
  other.resolution_m = 0.2;
  CHECK(digest_with(other, observations) != expected);
  other = kConfig;
  other.prior = 0.002;
  CHECK(digest_with(other, observations) != expected);
}

TEST_CASE("the digest changes with the class table") {
  const auto digest_of_classes = [](std::initializer_list<SemanticClass> list) {
    ClassTable classes;
    for (const SemanticClass& c : list) REQUIRE(classes.add(c.name_view(), c.color) == Status::kOk);
    return digest_of(LoadedMap(config_of_pages(4), classes).map);
  };
  const SemanticClass road = SemanticClass::make("road", {1, 2, 3});
  const SemanticClass car = SemanticClass::make("car", {4, 5, 6});
  const std::set<std::uint64_t> digests{
      digest_of_classes({road, car}), digest_of_classes({car, road}), digest_of_classes({road}),
      digest_of_classes({road, SemanticClass::make("cars", {4, 5, 6})}),
      digest_of_classes({road, SemanticClass::make("car", {4, 5, 7})})};
  CHECK(digests.size() == 5);
}

}  // namespace tessera
