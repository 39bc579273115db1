// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How two sketches agree: counts that can be told by hand.
#include "tessera/frames/internal/overlap_check.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "finder_rig.hpp"

namespace tessera {

TEST_CASE("a map agrees with itself, and less the further it is moved") {
  const auto map = map_of(large_hall(), left_of(30.5), room_classes());
  FinderRig rig;
  REQUIRE(rig.finder.begin(map->map, map->map, FinderRig::nearby()) == Status::kOk);
  while (!rig.finder.step()) continue;
  const MapSketch& a = rig.finder.sketch_a();
  const MapSketch& b = rig.finder.sketch_b();
  const auto at = [&](double x_m, double yaw_deg) {
    return check_overlap(a, b, frame_of(yaw_deg, 0.0, 0.0, {x_m, 0.0, 0.0}), 8'192);
  };
  const Agreement here = at(0.0, 0.0);
  CHECK(here.contradicted == 0);
  CHECK(here.flat_contradicted == 0);
  CHECK(here.agreed > 1'000);
  CHECK(here.labelled == here.same_label);
  // Beside is as good as on it: what is turned is not exactly in the same part.
  CHECK(at(0.2, 0.0).share() > 0.99);
  double before = 1.0;
  for (const double x_m : {0.6, 1.0, 1.6}) {
    const double share = at(x_m, 0.0).share();
    CHECK(share < before);
    before = share;
  }
  CHECK(at(0.0, 5.0).share() < 0.9);
  // Where they do not meet nothing is said.
  const Agreement far = at(500.0, 0.0);
  CHECK(far.agreed + far.contradicted + far.flat_agreed + far.labelled == 0);
  CHECK(far.unseen > 0);
  CHECK(far.share() == 0.0);
}

TEST_CASE("a wall that was seen from its other side does not agree") {
  // Two rooms back to back, each seen from inside: all that they have in common is the wall.
  SolidWorld rooms = room_of(20.2, 8.0, 3.0, {{{10.0, 0.0, 0.0}, {10.2, 8.0, 3.0}, 2}});
  const auto inside = [&](double from_m, double to_m) {
    return map_of(rooms, {{from_m, 0.5, 0.5}, {to_m, 7.5, 2.5}}, room_classes());
  };
  const auto one = inside(4.0, 10.2);
  const auto other = inside(10.0, 16.0);
  FinderRig rig;
  REQUIRE(rig.finder.begin(one->map, other->map, FinderRig::nearby()) == Status::kOk);
  while (!rig.finder.step()) continue;
  const Matrix34d there = frame_of(0.0, 0.0, 0.0, Point3d::Zero());
  const Agreement back_to_back =
      check_overlap(rig.finder.sketch_a(), rig.finder.sketch_b(), there, 8'192);
  CHECK(back_to_back.agreed == 0);
  CHECK(back_to_back.contradicted == 0);
  CHECK(back_to_back.unseen > 100);
  // Turned by half about the wall both have it from the same side.
  const Matrix34d turned = frame_of(180.0, 0.0, 0.0, {20.2, 8.0, 0.0});
  const Agreement same_side =
      check_overlap(rig.finder.sketch_a(), rig.finder.sketch_b(), turned, 8'192);
  CHECK(same_side.agreed > 100);
}

}  // namespace tessera
