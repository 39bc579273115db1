// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Close to the body a voxel is wider than a sector, and wider than a ring.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "sectors_rig.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

constexpr int kCounts[] = {8, 16, 32};

MapConfig voxels_of(double resolution_m) {
  MapConfig config = Rig::pages();
  config.resolution_m = resolution_m;
  return config;
}

std::vector<int> occupied_sectors(const ObstacleSummary& summary) {
  std::vector<int> sectors;
  for (int i = 0; i < summary.count; ++i)
    if (summary.sectors[static_cast<std::size_t>(i)].occupied) sectors.push_back(i);
  return sectors;
}

TEST_CASE("ObstacleSectors: in an empty map nothing is free") {
  oracle::Random random(7011);
  for (const double resolution_m : {0.05, 0.1, 0.2, 0.4, 0.8}) {
    for (const int count : kCounts) {
      for (const double ring_m : {0.1, 0.35, 1.0, 3.0}) {
        INFO(resolution_m << " m, " << count << " sectors, rings of " << ring_m << " m");
        Rig rig({.count = count, .max_range_m = 3.0, .ring_m = ring_m}, voxels_of(resolution_m));
        for (int place = 0; place < 4; ++place) {
          const double x = place == 0 ? 0.0 : random.uniform(-1.0, 1.0);
          const double y = place == 0 ? 0.0 : random.uniform(-1.0, 1.0);
          const double heading = place == 0 ? 0.0 : random.uniform(-3.0, 3.0);
          const ObstacleSummary& summary = rig.sweep(pose_at(x, y, 0.0, heading));
          const auto free = std::count_if(
              summary.sectors.begin(), summary.sectors.end(),
              [](const ObstacleSector& sector) { return sector.free_up_to_m != 0.0; });
          CHECK(free == 0);
        }
      }
    }
  }
}

TEST_CASE("ObstacleSectors: in an empty map only the vehicle's own radius is known") {
  for (const double resolution_m : {0.1, 0.4, 0.8}) {
    for (const int count : kCounts) {
      INFO(resolution_m << " m, " << count << " sectors");
      Rig rig({.count = count, .max_range_m = 4.0, .own_radius_m = 1.2, .ring_m = 0.25},
              voxels_of(resolution_m));
      const ObstacleSummary& summary = rig.sweep(pose_at(0.07, -0.11, 0.0, 0.3));
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        CHECK(summary.sectors[i].free_up_to_m == 1.0);
    }
  }
}

TEST_CASE("ObstacleSectors: rings narrower than voxels do not end what is free") {
  for (const int count : kCounts) {
    for (const double ring_m : {0.1, 1.0}) {
      INFO(count << " sectors, rings of " << ring_m << " m");
      Rig rig({.count = count, .max_range_m = 6.0, .ring_m = ring_m}, voxels_of(0.4));
      for (int x = -17; x <= 17; ++x)
        for (int y = -17; y <= 17; ++y) REQUIRE(carve(rig.small.map, {x, y, 0}) == Status::kOk);
      const ObstacleSummary& summary = rig.sweep(pose_at(0.17, 0.06, 0.0, 0.3));
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        CHECK(summary.sectors[i].free_up_to_m > 5.0);
    }
  }
}

TEST_CASE("ObstacleSectors: a voxel that the body almost touches is on its own side only") {
  Rig rig({.count = 16, .max_range_m = 4.0}, voxels_of(0.4));
  REQUIRE(hit(rig.small.map, {0, 0, 0}, 1, 5.0F) == Status::kOk);
  const auto from = [&](double x, double y) {
    return occupied_sectors(rig.sweep(pose_at(x, y, 0.1, 0.0)));
  };
  CHECK(from(0.2, -0.01) == std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8});
  CHECK(from(0.2, 0.41) == std::vector<int>{0, 8, 9, 10, 11, 12, 13, 14, 15});
  CHECK(from(-0.01, 0.2) == std::vector<int>{0, 1, 2, 3, 4, 12, 13, 14, 15});
  CHECK(from(0.41, 0.2) == std::vector<int>{4, 5, 6, 7, 8, 9, 10, 11, 12});
  CHECK(from(0.2, 0.2).size() == 16);
}

TEST_CASE("ObstacleSectors: the sectors of a voxel close by are those of its angles") {
  oracle::Random random(7012);
  const double edge = 0.4;
  for (const int count : kCounts) {
    Rig rig({.count = count, .max_range_m = 4.0}, voxels_of(edge));
    REQUIRE(hit(rig.small.map, {0, 0, 0}, 1, 5.0F) == Status::kOk);
    for (int round = 0; round < 600; ++round) {
      const double away = round % 3 == 0 ? 0.001 : random.uniform(0.001, 0.15);
      const double along = random.uniform(-0.15, edge + 0.15);
      const int side = random.below(4);
      const double across = side < 2 ? -away : edge + away;
      const double x = side % 2 == 0 ? along : across;
      const double y = side % 2 == 0 ? across : along;
      const double heading = random.uniform(-3.0, 3.0);
      INFO("round " << round << ", body at " << x << " " << y << " turned by " << heading);
      std::vector<int> expected = sectors_of_square(-x, -y, edge, heading, count);
      std::sort(expected.begin(), expected.end());
      CHECK(occupied_sectors(rig.sweep(pose_at(x, y, 0.1, heading))) == expected);
    }
  }
}

}  // namespace
}  // namespace tessera
