// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "sample_robot.hpp"

namespace tessera {

namespace {

constexpr int kComponents = 5;  // three classes
const Significance kSignificance(MapConfig{}, kComponents, 4.0F);

struct Pair {
  ReadContent published{kComponents};
  ReadContent current{kComponents};
  [[nodiscard]] Difference compare() const {
    return kSignificance.compare(published.content, current.content);
  }
};

}  // namespace

TEST_CASE("Significance: the same content means the same, nothing included") {
  Pair pair;
  CHECK_FALSE(pair.compare().any());
  for (ReadContent* own : {&pair.published, &pair.current}) {
    own->content.add(2, 511, 0.3F);
    own->content.add_rest(511, 0.1F);
    own->content.add_passes(0, 7);
  }
  CHECK_FALSE(pair.compare().any());
}

TEST_CASE(
    "Significance: a voxel with label evidence that is new or gone counts, whatever its state") {
  Pair pair;
  pair.current.content.add_passes(9, 200);
  pair.published.content.add_passes(9, 200);
  pair.current.content.add(1, 9, 0.01F);
  CHECK(pair.compare() == Difference{.labels = 1});
  pair.published.content.add(3, 500, 1.0F);
  CHECK(pair.compare() == Difference{.labels = 2});
}

TEST_CASE("Significance: another label counts, ties go to the lower one") {
  Pair pair;
  pair.published.content.add(2, 64, 1.0F);
  pair.current.content.add(2, 64, 1.0F);
  pair.current.content.add(3, 64, 1.0F);
  CHECK_FALSE(pair.compare().any());
  pair.current.content.set(3, 64, 1.001F);
  CHECK(pair.compare() == Difference{.labels = 1});
  pair.current.content.set(3, 64, 0.0F);
  pair.current.content.add(1, 64, 1.0F);
  CHECK(pair.compare() == Difference{.labels = 1});
}

TEST_CASE("Significance: occupied or free, by labels and passes together") {
  Pair pair;
  pair.published.content.add(1, 3, 1.0F);
  pair.current.content.add(1, 3, 1.0F);
  pair.current.content.add_passes(3, 2);  // 0.8
  CHECK_FALSE(pair.compare().any());
  pair.current.content.add_passes(3, 1);  // 1.2
  CHECK(pair.compare() == Difference{.labels = 1});
}

TEST_CASE("Significance: evidence that is more than the factor of what it was") {
  Pair pair;
  pair.published.content.add(1, 3, 1.0F);
  pair.current.content.add(1, 3, 3.0F);
  pair.current.content.add_rest(3, 1.0F);
  CHECK_FALSE(pair.compare().any());
  pair.current.content.set(1, 3, 3.01F);
  CHECK(pair.compare() == Difference{.evidence = 1});
  pair.published.content.add(1, 3, 16.0F);
  CHECK(pair.compare() == Difference{.evidence = 1});
  pair.published.content.set(1, 3, 16.0F);
  CHECK_FALSE(pair.compare().any());
}

TEST_CASE("Significance: voxels that are only free differ by state alone") {
  Pair pair;
  for (int row = 0; row < kBlockVoxels; row += 2) pair.published.content.add_passes(row, 1);
  for (int row = 0; row < kBlockVoxels; row += 2) pair.current.content.add_passes(row, 300);
  CHECK_FALSE(pair.compare().any());
  pair.current.content.add_passes(1, 1);
  pair.published.content.add_passes(511, 1);
  CHECK(pair.compare() == Difference{.free = 2});
  pair.current.content.add(1, 0, 200.0F);  // in the octet of voxel 1
  CHECK(pair.compare() == Difference{.labels = 1, .free = 2});
}

TEST_CASE("Significance: by default nothing is different") {
  Pair pair;
  pair.current.content.add_passes(1, 1);
  CHECK_FALSE(Significance().compare(pair.published.content, pair.current.content).any());
}

}  // namespace tessera
