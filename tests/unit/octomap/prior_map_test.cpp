// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An OctoMap as the beginning of a map.
#include "maps/prior_map.hpp"

#include <catch2/catch.hpp>

#include "support/small_map.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;

/// A .bt file with one leaf of 2^level voxels at the origin, and one of a voxel beside it along -x.
std::string two_leaves(int level, bool occupied, const std::string& resolution) {
  const int leaf = occupied ? 2 : 1;
  // Octant 6 has x < 0, y and z from 0 on; octant 7 begins at the origin.
  std::string tree{'\0', static_cast<char>(3 << 4 | (level == 15 ? leaf : 3) << 6)};
  int nodes = 3;
  for (int at = 15; at > 0; --at, ++nodes)
    tree += {static_cast<char>((at == 1 ? 2 : 3) << 2), '\0'};
  for (int at = 15; at > level; --at, ++nodes)
    tree += {static_cast<char>(at == level + 1 ? leaf : 3), '\0'};
  return "# Octomap OcTree binary file\nid OcTree\nsize " + std::to_string(nodes) + "\nres " +
         resolution + "\ndata\n" + tree;
}

MapConfig config() {
  MapConfig config = config_of_pages(400);
  config.resolution_m = 0.1;
  return config;
}

Octree octree_of(const test::TemporaryFolder& folder, const std::string& file) {
  folder.write("prior.bt", file);
  Outcome<Octree> octree = read_prior_map(folder.file("prior.bt"), 0.1);
  INFO(octree.failure().text());
  REQUIRE(octree.ok());
  return *octree;
}

TEST_CASE("prior map: pruned leaves become all of their voxels") {
  const test::TemporaryFolder folder;
  for (const TuplePolicy tuple : {TuplePolicy::kCompact, TuplePolicy::kDense}) {
    MapConfig chosen = config();
    chosen.tuple = tuple;
    SmallMap small(chosen);
    const PriorMapReport report =
        add_prior_map(octree_of(folder, two_leaves(4, false, "0.1")), 1.0F, small.map);
    CHECK(report.free == 16 * 16 * 16);
    CHECK(report.occupied == 1);
    CHECK(report.refused == 0);
    const auto expected = static_cast<float>(report.passes) * chosen.free_weight;
    for (const int at : {0, 7, 8, 15}) {
      CHECK(small.map.query(VoxelCoord{at, 15 - at, at}).state == VoxelState::kFree);
      CHECK(small.map.evidence(VoxelCoord{at, 15 - at, at}).sigma[0] == Approx(expected));
    }
    CHECK(small.map.query(VoxelCoord{16, 0, 0}).state == VoxelState::kUnknown);
    const Estimate beside = small.map.query(VoxelCoord{-1, 0, 0});
    CHECK(beside.state == VoxelState::kOccupied);
    CHECK(beside.label == 0);
    CHECK(beside.evidence == Approx(1.0));
    CHECK(small.map.query(VoxelCoord{-2, 0, 0}).state == VoxelState::kUnknown);
  }
}

TEST_CASE("prior map: a coarser file fills the voxels that its own cover") {
  const test::TemporaryFolder folder;
  SmallMap small(config());
  const PriorMapReport report =
      add_prior_map(octree_of(folder, two_leaves(1, true, "0.4")), 0.3F, small.map);
  CHECK(report.occupied == 8 * 8 * 8 + 4 * 4 * 4);
  CHECK(report.resolution_m == Approx(0.4));
  CHECK(small.map.query(VoxelCoord{7, 7, 7}).evidence == Approx(0.3).margin(1e-4));
  CHECK(small.map.query(VoxelCoord{8, 7, 7}).state == VoxelState::kUnknown);
  CHECK(small.map.query(VoxelCoord{-4, 3, 3}).state == VoxelState::kOccupied);
  CHECK(small.map.query(VoxelCoord{-5, 3, 3}).state == VoxelState::kUnknown);
}

TEST_CASE("prior map: what has no room is counted, and the map stays whole") {
  const test::TemporaryFolder folder;
  MapConfig tiny = config_of_pages(8);
  tiny.resolution_m = 0.1;
  SmallMap small(tiny);
  const PriorMapReport report =
      add_prior_map(octree_of(folder, two_leaves(6, true, "0.1")), 1.0F, small.map);
  CHECK(report.refused > 0);
  CHECK(report.occupied > 0);
  CHECK(report.occupied + report.refused == 64 * 64 * 64 + 1);
  CHECK(recount_label_voxels(content_of(small.map)) == report.occupied);
}

TEST_CASE("prior map: other resolutions and whole continents are refused") {
  const test::TemporaryFolder folder;
  for (const char* const resolution : {"0.05", "0.15", "12.8", "0.1001"}) {
    folder.write("prior.bt", two_leaves(0, true, resolution));
    const Outcome<Octree> octree = read_prior_map(folder.file("prior.bt"), 0.1);
    REQUIRE_FALSE(octree.ok());
    CHECK_THAT(octree.failure().text(), Contains("times as wide"));
  }
  folder.write("prior.bt", two_leaves(15, true, "0.1"));
  const Outcome<Octree> octree = read_prior_map(folder.file("prior.bt"), 0.1);
  REQUIRE_FALSE(octree.ok());
  CHECK_THAT(octree.failure().text(), Contains("cover more than"));
}

}  // namespace
}  // namespace tessera
