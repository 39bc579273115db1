// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/nearest.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "oracle/random.hpp"
#include "small_map.hpp"

namespace tessera {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST_CASE("nearest_occupied: the nearest of all voxels, as looking at each of them finds it") {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    oracle::Random random(seed);
    // A large prior makes voxels with few passes occupied, too: they have no labels.
    MapConfig config = config_of_pages(2000);
    if (seed % 4 == 3) config.prior = 0.5;
    SmallMap small(config);
    std::vector<VoxelCoord> voxels;
    const int extent = seed % 2 == 0 ? 30 : 120;
    for (int i = 0; i < 40; ++i) {
      VoxelCoord voxel;
      voxel.x = random.below(2 * extent) - extent;
      voxel.y = random.below(2 * extent) - extent;
      voxel.z = random.below(2 * extent) - extent;
      if (i % 3 == 0) {
        REQUIRE(carve(small.map, voxel) == Status::kOk);
      } else {
        REQUIRE(hit(small.map, voxel, 1 + i % 3, 2.0F) == Status::kOk);
      }
      voxels.push_back(voxel);
    }
    for (int i = 0; i < 20; ++i) {
      Point3f p;
      for (int axis = 0; axis < 3; ++axis)
        p[axis] = static_cast<float>(random.uniform(-0.12 * extent, 0.12 * extent));
      const double radius_m = random.uniform(0.1, 0.2 * extent);
      double nearest_m = radius_m;
      bool any = false;
      for (const VoxelCoord& voxel : voxels) {
        if (small.map.query(voxel).state != VoxelState::kOccupied) continue;
        const double distance_m = norm(small.map.lattice().center_of(voxel) - p.cast<double>());
        if (distance_m > nearest_m) continue;
        nearest_m = distance_m;
        any = true;
      }
      const Result<NearestVoxel> found = nearest_occupied(small.map, p, radius_m);
      REQUIRE(found.ok());
      INFO("seed " << seed << ", point " << i);
      REQUIRE(found->found == any);
      if (!any) continue;
      CHECK(found->distance_m == nearest_m);
      CHECK(found->estimate.state == VoxelState::kOccupied);
      CHECK(norm(small.map.lattice().center_of(found->voxel) - p.cast<double>()) == nearest_m);
    }
  }
}

TEST_CASE("nearest_occupied: an obstacle is found at any place of its block and of the point's") {
  for (const int x : {-9, -8, -1, 0, 7, 8, 15, 16}) {
    SmallMap small(config_of_pages(16));
    REQUIRE(hit(small.map, {x, 0, 0}, 1, 2.0F) == Status::kOk);
    for (int from = -20; from <= 20; ++from) {
      const Point3f p = small.map.lattice().center_of({from, 0, 0}).cast<float>();
      const double distance_m = 0.1 * std::abs(x - from);
      const Result<NearestVoxel> found = nearest_occupied(small.map, p, distance_m + 0.01);
      REQUIRE(found.ok());
      CHECK(found->found);
      CHECK(found->voxel == VoxelCoord{x, 0, 0});
      if (distance_m > 0.02) {
        const Result<NearestVoxel> none = nearest_occupied(small.map, p, distance_m - 0.01);
        REQUIRE(none.ok());
        CHECK_FALSE(none->found);
      }
    }
  }
}

TEST_CASE("nearest_occupied: what it cannot work with") {
  SmallMap small(config_of_pages(16));
  const Point3f p(0.0F, 0.0F, 0.0F);
  for (const double radius_m : {0.0, -1.0, static_cast<double>(kNan), 1e9})
    CHECK(nearest_occupied(small.map, p, radius_m).status() == Status::kInvalidArgument);
  CHECK(nearest_occupied(small.map, {kNan, 0.0F, 0.0F}, 1.0).status() == Status::kOutOfRange);
  CHECK(nearest_occupied(small.map, {1e9F, 0.0F, 0.0F}, 1.0).status() == Status::kOutOfRange);
  const Result<NearestVoxel> nothing = nearest_occupied(small.map, p, 25.6);
  REQUIRE(nothing.ok());
  CHECK_FALSE(nothing->found);
  // At the end of the grid there is nothing beyond.
  const Point3f corner =
      small.map.lattice().center_of({-kVoxelLimit, -kVoxelLimit, 0}).cast<float>();
  CHECK(nearest_occupied(small.map, corner, 25.0).ok());
}

}  // namespace
}  // namespace tessera
