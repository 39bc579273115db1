// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map's surfaces and free space in coarse cells, against a count of its voxels.
#include "tessera/frames/map_sketch.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <vector>

#include "finder_rig.hpp"
#include "support/random.hpp"

namespace tessera {

namespace {

struct OwnSketch {
  AlignedMemory memory{MapSketch::required_bytes()};
  std::vector<KeyedIndex> scratch{MapSketch::kScratch};
  MapSketch sketch;

  OwnSketch() {
    Arena arena = memory.arena();
    sketch = *MapSketch::make(arena);
    REQUIRE(arena.remaining_bytes() == 0);
  }
  void draw(const LocalMap& map) {
    sketch.begin(map.lattice().resolution_m());
    SweepCursor cursor;
    map.visit_blocks(cursor, ~std::size_t{0} / 2, [&](BlockKey, SlabHandle handle) {
      sketch.add(map, handle);
      return true;
    });
    sketch.finish(scratch);
  }
};

struct CellOracle {
  std::uint64_t occupied = 0;
  std::uint64_t free = 0;
  std::vector<Point3d> places_m;
};

/// All of a map's cells, voxel by voxel. voxels_part: on an axis.
std::map<std::array<int, 3>, CellOracle> cells_of(const LocalMap& map, int reach, int voxels_part) {
  std::map<std::array<int, 3>, CellOracle> cells;
  const int voxels_cell = 4 * voxels_part;
  const auto floor_div = [](int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); };
  for (int z = -reach; z < reach; ++z) {
    for (int y = -reach; y < reach; ++y) {
      for (int x = -reach; x < reach; ++x) {
        const Estimate estimate = map.query(VoxelCoord{x, y, z});
        if (estimate.state == VoxelState::kUnknown || map.classes().moves(estimate.label)) continue;
        const std::array<int, 3> at{floor_div(x, voxels_cell), floor_div(y, voxels_cell),
                                    floor_div(z, voxels_cell)};
        CellOracle& cell = cells[at];
        const int part = (x - at[0] * voxels_cell) / voxels_part +
                         4 * ((y - at[1] * voxels_cell) / voxels_part) +
                         16 * ((z - at[2] * voxels_cell) / voxels_part);
        const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(part);
        if (estimate.state == VoxelState::kFree) {
          cell.free |= bit;
        } else {
          cell.occupied |= bit;
          cell.places_m.push_back(map.lattice().center_of({x, y, z}));
        }
      }
    }
  }
  return cells;
}

}  // namespace

TEST_CASE("cells are what their voxels are") {
  for (const double resolution_m : {0.2, 0.1}) {
    CAPTURE(resolution_m);
    MapConfig config = config_of_pages(400);
    config.resolution_m = resolution_m;
    WorldMap world(config, room_classes(true));
    oracle::Random random(11);
    constexpr int kReach = 24;
    for (int n = 0; n < 6'000; ++n) {
      const VoxelCoord voxel{random.below(2 * kReach) - kReach, random.below(2 * kReach) - kReach,
                             random.below(2 * kReach) - kReach};
      if (random.below(3) == 0)
        REQUIRE(hit(world.map, voxel, 1 + random.below(3), 3.0F) == Status::kOk);
      else
        REQUIRE(carve(world.map, voxel) == Status::kOk);
    }
    OwnSketch own;
    own.draw(world.map);
    const auto oracle = cells_of(world.map, kReach, resolution_m < 0.15 ? 2 : 1);
    std::size_t with_surface = 0;
    for (const auto& [at, cell] : oracle) {
      const VoxelCoord coord{at[0], at[1], at[2]};
      const MapSketch::Parts parts = own.sketch.parts(coord);
      REQUIRE(parts.occupied == cell.occupied);
      REQUIRE(parts.free == (cell.free & ~cell.occupied));
      const MapSketch::Surface* const surface = own.sketch.find_surface(coord);
      REQUIRE((surface != nullptr) == (cell.occupied != 0));
      if (surface == nullptr) continue;
      ++with_surface;
      Point3d mean = Point3d::Zero();
      for (const Point3d& p : cell.places_m) mean += p;
      mean /= static_cast<double>(cell.places_m.size());
      CHECK(norm(Point3d(own.sketch.center_of(*surface) - mean)) < 1e-5);
    }
    CHECK(own.sketch.surface_count() == with_surface);
    CHECK(own.sketch.surface_count() + own.sketch.free_cell_count() == oracle.size());
    for (std::uint32_t i = 1; i < own.sketch.surface_count(); ++i)
      CHECK(own.sketch.surface(i - 1).key < own.sketch.surface(i).key);
    CHECK(own.sketch.find_surface({1'000, 0, 0}) == nullptr);
    CHECK(own.sketch.parts({1'000, 0, 0}).occupied == 0);
  }
}

TEST_CASE("what lies flat, what stands, and how little a plane says along itself") {
  OwnSketch own;
  const auto map = map_of(large_hall(), left_of(30.5), room_classes());
  own.draw(map->map);
  // The floor, far from what stands.
  const MapSketch::Surface* const floor = own.sketch.find_surface({6, 18, -1});
  REQUIRE(floor != nullptr);
  CHECK(floor->kind == MapSketch::Kind::kFlat);
  CHECK(floor->label == 1);
  CHECK(std::abs(floor->normal[2]) > 0.99F);
  CHECK(floor->looseness_m2[5] < 0.02F);
  CHECK(floor->looseness_m2[0] > 0.4F);
  // A wall, between its corners.
  const MapSketch::Surface* const wall = own.sketch.find_surface({-1, 10, 2});
  REQUIRE(wall != nullptr);
  CHECK(wall->kind == MapSketch::Kind::kUpright);
  CHECK(wall->label == 2);
  CHECK(wall->looseness_m2[0] < 0.02F);
  CHECK(wall->looseness_m2[3] > 0.4F);
  CHECK(wall->looseness_m2[5] > 0.4F);
}

TEST_CASE("of more cells than there is room for, the same are kept in any order") {
  // Every second cell of a large square has a surface, the others are free.
  constexpr int kEdge = 330;
  const auto make = [&](bool backwards) {
    MapConfig config = config_of_pages(16'000);
    auto world = std::make_unique<WorldMap>(config, room_classes());
    bool all_fit = true;
    for (int n = 0; n < kEdge * kEdge; ++n) {
      const int at = backwards ? kEdge * kEdge - 1 - n : n;
      const VoxelCoord voxel{8 * (at % kEdge) - 1'320, 8 * (at / kEdge) - 1'320, 1};
      const Status status =
          at % 2 == 0 ? hit(world->map, voxel, 1, 3.0F) : carve(world->map, voxel);
      all_fit = all_fit && status == Status::kOk;
    }
    REQUIRE(all_fit);
    return world;
  };
  OwnSketch one;
  OwnSketch other;
  one.draw(make(false)->map);
  other.draw(make(true)->map);
  CHECK(one.sketch.surface_levels() == 1);
  CHECK(one.sketch.surface_count() <= MapSketch::kMostSurfaces);
  CHECK(one.sketch.surface_count() > MapSketch::kMostSurfaces / 2);
  REQUIRE(one.sketch.surface_count() == other.sketch.surface_count());
  for (std::uint32_t i = 0; i < one.sketch.surface_count(); ++i)
    REQUIRE(one.sketch.surface(i).key == other.sketch.surface(i).key);
  CHECK(one.sketch.free_cell_count() == other.sketch.free_cell_count());
}

}  // namespace tessera
