// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Obstacles that are in no map, in the sectors around the robot.
#include "vehicle/boxes_in_sectors.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

std::vector<SectorReport> free_sectors(std::size_t count) {
  return std::vector<SectorReport>(count, {.available = true, .free_up_to_m = 20.0F});
}

/// 2 m long and 1 m wide, its middle there.
PlacedBox box_at(double x, double y, double z) {
  Matrix34d T = Matrix34d::Identity();
  T.col(3) = Point3d(x, y, z);
  return {.T_box_map = inverse(T), .box = {{-1, -0.5F, -0.5F}, {1, 0.5F, 0.5F}}};
}

}  // namespace

TEST_CASE("add_box: a box is an obstacle of the sectors that it is in, and of no other") {
  const ObstacleSectorsConfig config;
  std::vector<SectorReport> sectors = free_sectors(16);
  add_box(box_at(6.0, 0.0, 0.0), Matrix34d::Identity(), config, sectors);
  for (std::size_t i = 0; i < sectors.size(); ++i) CHECK(sectors[i].occupied == (i == 0));
  CHECK(sectors[0].distance_m == Approx(4.9).margin(0.01));
  CHECK(sectors[0].free_up_to_m == Approx(4.9).margin(0.01));
  CHECK((sectors[0].label == 0 && sectors[0].occupancy == 1.0F));
  CHECK(sectors[8].free_up_to_m == 20.0F);
  // Of a robot that looks to the left it is to the right.
  Matrix34d T_map_body;
  T_map_body << 0, -1, 0, 1, 1, 0, 0, 0, 0, 0, 1, 0;
  sectors = free_sectors(32);
  add_box(box_at(6.0, 0.0, 0.0), T_map_body, config, sectors);
  CHECK(sectors[24].occupied);
  CHECK(sectors[24].distance_m == Approx(3.9).margin(0.01));
  CHECK_FALSE(sectors[0].occupied);
  CHECK_FALSE(sectors[16].occupied);
}

TEST_CASE("add_box: what is nearer stays, and what is out of range or of the band adds nothing") {
  ObstacleSectorsConfig config;
  std::vector<SectorReport> sectors = free_sectors(16);
  sectors[0].occupied = true;
  sectors[0].label = 7;
  sectors[0].distance_m = 3.0F;
  sectors[0].free_up_to_m = 2.0F;
  sectors[4].available = false;
  add_box(box_at(6.0, 0.0, 0.0), Matrix34d::Identity(), config, sectors);
  CHECK((sectors[0].label == 7 && sectors[0].distance_m == 3.0F));
  CHECK(sectors[0].free_up_to_m == 2.0F);
  add_box(box_at(0.0, 6.0, 0.0), Matrix34d::Identity(), config, sectors);
  CHECK_FALSE(sectors[4].occupied);
  for (const auto& [x, z] : {std::pair{-30.0, 0.0}, {-6.0, 1.6}, {-6.0, -1.6}}) {
    add_box(box_at(x, 0.0, z), Matrix34d::Identity(), config, sectors);
    CHECK_FALSE(sectors[8].occupied);
  }
  add_box(box_at(-6.0, 0.0, 1.4), Matrix34d::Identity(), config, sectors);
  CHECK(sectors[8].occupied);
  add_box(box_at(-2.5, 0.0, 0.0), Matrix34d::Identity(), config, {});
}

}  // namespace tessera
