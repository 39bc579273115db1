// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/obstacle_sectors.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "sectors_rig.hpp"

namespace tessera {
namespace {

TEST_CASE("ObstacleSectors: ahead is sector 0, to the left is a quarter on") {
  Rig rig({.count = 16, .max_range_m = 10.0});
  const double heading = 0.5;
  const Matrix34d T = pose_at(2.03, -1.04, 0.02, heading);
  for (int sector = 0; sector < 16; ++sector) {
    const double turn = heading + kTurn * sector / 16;
    const double away = 3.0 + 0.3 * sector;
    const Point3d p(2.03 + away * std::cos(turn), -1.04 + away * std::sin(turn), 0.0);
    const int label = 1 + sector % 3;
    REQUIRE(hit(rig.small.map, *rig.small.map.lattice().voxel_of(p), label, 3.0F) == Status::kOk);
  }
  const ObstacleSummary& summary = rig.sweep(T);
  for (std::size_t i = 0; i < 16; ++i) {
    INFO("sector " << i);
    CHECK(summary.sectors[i].occupied);
    CHECK(summary.sectors[i].label == 1 + static_cast<int>(i) % 3);
    const double away = 3.0 + 0.3 * static_cast<double>(i);
    CHECK(summary.sectors[i].distance_m <= away);
    CHECK(summary.sectors[i].distance_m > away - 0.3);
    CHECK(summary.sectors[i].free_up_to_m == 0.0);
  }
}

TEST_CASE("ObstacleSectors: unknown is not free, and free ends at the obstacle") {
  Rig rig({.count = 8, .max_range_m = 8.0, .min_height_m = 0.0, .max_height_m = 0.4});
  const Matrix34d T = pose_at(0.05, 0.05, 0.0, 0.0);
  CHECK(rig.sweep(T).sectors[0].free_up_to_m == 0.0);
  CHECK_FALSE(rig.sweep(T).sectors[0].occupied);
  for (int x = 0; x < 45; ++x)
    for (int y = -x - 3; y <= x + 3; ++y) REQUIRE(carve(rig.small.map, {x, y, 1}) == Status::kOk);
  CHECK(rig.sweep(T).sectors[0].free_up_to_m == 4.0);
  // Of a column, one voxel is enough to be an obstacle.
  REQUIRE(hit(rig.small.map, {26, 0, 3}, 2, 5.0F) == Status::kOk);
  CHECK(rig.sweep(T).sectors[0].free_up_to_m == 2.0);
  CHECK(rig.sweep(T).sectors[0].distance_m == Approx(2.6 - 0.1 * std::sqrt(0.5)));
  CHECK(rig.sweep(T).sectors[0].label == 2);
  // Behind the body nothing is known.
  CHECK(rig.sweep(T).sectors[4].free_up_to_m == 0.0);
}

TEST_CASE(
    "ObstacleSectors: what is above or below the band, or the vehicle itself, is no obstacle") {
  ObstacleSectorsConfig config{.count = 8, .max_range_m = 8.0};
  config.min_height_m = -0.5;
  config.max_height_m = 0.5;
  config.own_radius_m = 1.0;
  Rig rig(config);
  const Matrix34d T = pose_at(0.0, 0.0, 1.0, 0.0);
  REQUIRE(hit(rig.small.map, {30, 0, 4}, 1, 5.0F) == Status::kOk);
  REQUIRE(hit(rig.small.map, {30, 0, 15}, 1, 5.0F) == Status::kOk);
  REQUIRE(hit(rig.small.map, {8, 0, 10}, 1, 5.0F) == Status::kOk);
  CHECK_FALSE(rig.sweep(T).sectors[0].occupied);
  REQUIRE(hit(rig.small.map, {30, 0, 14}, 1, 5.0F) == Status::kOk);
  CHECK(rig.sweep(T).sectors[0].occupied);
  REQUIRE(hit(rig.small.map, {20, 0, 5}, 1, 5.0F) == Status::kOk);
  CHECK(rig.sweep(T).sectors[0].voxel == VoxelCoord{20, 0, 5});
}

TEST_CASE("ObstacleSectors: a call does no more than it may, and the last sweep stays meanwhile") {
  Rig rig({.count = 16, .max_range_m = 10.0, .min_height_m = -0.4, .max_height_m = 0.3});
  REQUIRE(hit(rig.small.map, {30, 0, 0}, 1, 5.0F) == Status::kOk);
  const Matrix34d T = pose_at(0.05, 0.05, 0.05, 0.0);
  CHECK(rig.sectors.latest().count == 0);
  const std::uint32_t all = rig.sweep(T).blocks;
  CHECK(rig.sectors.column_blocks() == 2);
  CHECK(all <= 2 * 27 * 27);
  MapReader reader(rig.small.map);
  REQUIRE(rig.sectors.begin(T, 99) == Status::kOk);
  std::uint32_t calls = 0;
  while (!rig.sectors.step(reader, 20)) {
    ++calls;
    CHECK(rig.sectors.is_sweeping());
    REQUIRE(rig.sectors.latest().stamp_us == 77);
  }
  CHECK(calls >= all / 20 - 1);
  CHECK(rig.sectors.latest().stamp_us == 99);
  CHECK(rig.sectors.latest().blocks == all);
  CHECK(rig.sectors.latest().present == 1);
  CHECK(rig.sectors.step(reader, 20));
}

TEST_CASE("ObstacleSectors: what is behind an obstacle all around is not looked at") {
  Rig rig({.count = 8, .max_range_m = 20.0});
  const Matrix34d T = pose_at(0.0, 0.0, 0.0, 0.0);
  const std::uint32_t open = rig.sweep(T).columns;
  for (int i = -12; i <= 12; ++i)
    for (const int j : {-12, 12})
      for (const VoxelCoord v : {VoxelCoord{i, j, 0}, VoxelCoord{j, i, 0}})
        REQUIRE(hit(rig.small.map, v, 1, 5.0F) == Status::kOk);
  CHECK(rig.sweep(T).columns < open / 20);
}

TEST_CASE("ObstacleSectors: configurations and poses that make no sense are refused") {
  SmallMap small(config_of_pages(4));
  AlignedMemory memory(ObstacleSectors::required_bytes(small.map));
  const auto made = [&](const ObstacleSectorsConfig& config) {
    Arena arena = memory.arena();
    return ObstacleSectors::make(config, small.map, arena).status();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(made({}) == Status::kOk);
  for (const int count : {0, 4, 15, 64, -16})
    CHECK(made({.count = count}) == Status::kInvalidArgument);
  for (const double range : {0.0, -1.0, kNan, 500.0, 70.0})
    CHECK(made({.max_range_m = range}) == Status::kInvalidArgument);
  CHECK(made({.min_height_m = 1.1}) == Status::kInvalidArgument);
  CHECK(made({.max_height_m = kNan}) == Status::kInvalidArgument);
  CHECK(made({.own_radius_m = -0.1}) == Status::kInvalidArgument);
  CHECK(made({.ring_m = 0.3}) == Status::kInvalidArgument);
  CHECK(made({.ring_m = 21.0}) == Status::kInvalidArgument);
  CHECK(made({.known_share = 0.0}) == Status::kInvalidArgument);
  CHECK(made({.known_share = 1.1}) == Status::kInvalidArgument);
  Arena none(memory.span().first(64));
  CHECK(ObstacleSectors::make({}, small.map, none).status() == Status::kResourceExhausted);

  ObstacleSectors unmade;
  CHECK(unmade.begin(Matrix34d::Identity(), 0) == Status::kResourceExhausted);
  Rig rig({});
  CHECK(rig.sectors.begin(Matrix34d::Zero(), 0) == Status::kInvalidArgument);
  Matrix34d up = Matrix34d::Zero();  // Its x axis looks at the sky.
  up(2, 0) = up(1, 1) = 1.0;
  up(0, 2) = -1.0;
  CHECK(rig.sectors.begin(up, 0) == Status::kInvalidArgument);
  CHECK(rig.sectors.begin(pose_at(1e6, 0, 0, 0), 0) == Status::kOutOfRange);
}

}  // namespace
}  // namespace tessera
