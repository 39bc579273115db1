// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where other robots are, for threads beside the one that hears them.
#include "node/teammates_state.hpp"

#include <catch2/catch.hpp>

#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

TeammatesState with_one(double speed_m_per_s) {
  TeammatesState state;
  state.count = 1;
  TeammatesState::One& one = state.all[0];
  one.robot = 3;
  one.speed_m_per_s = static_cast<std::uint8_t>(speed_m_per_s);
  one.T_map_body = {1, 0, 0, 10, 0, 1, 0, 0, 0, 0, 1, 0};
  one.velocity = {speed_m_per_s, 0, 0};
  one.box = {{-1, -0.5F, -0.5F}, {1, 0.5F, 0.5F}};
  one.margin_m = 0.2;
  one.time_us = 5'000'000;
  one.until_us = 6'000'000;
  return state;
}

}  // namespace

TEST_CASE(
    "TeammatesState: a robot is carried on to the time of a scan, until it is none any more") {
  const TeammatesState state = with_one(4.0);
  std::array<PlacedBox, TeammatesState::kMost> boxes;
  REQUIRE(state.place(5'100'000, boxes) == 1);
  CHECK(apply(boxes[0].T_box_map, {10.4, 0, 0}).x() == Approx(0.0).margin(1e-9));
  CHECK(boxes[0].box.high[0] == Approx(1.0 + 0.2 + 0.5 * 4.0 * 0.1));
  REQUIRE(state.place(4'900'000, boxes) == 1);
  CHECK(apply(boxes[0].T_box_map, {9.6, 0, 0}).x() == Approx(0.0).margin(1e-9));
  CHECK(state.place(6'000'000, boxes) == 1);
  CHECK(state.place(6'000'001, boxes) == 0);
  CHECK(TeammatesState{}.place(0, boxes) == 0);
}

TEST_CASE("TeammatesState: sectors have it as an obstacle") {
  SectorsReport sectors;
  for (SectorReport& sector : sectors.sectors) sector.available = true;
  with_one(0.0).add_to(sectors, Matrix34d::Identity(), {}, 5'000'000);
  CHECK(sectors.sectors[0].occupied);
  CHECK(sectors.sectors[0].distance_m == Approx(8.7).margin(0.01));
  CHECK_FALSE(sectors.sectors[8].occupied);
}

}  // namespace tessera
