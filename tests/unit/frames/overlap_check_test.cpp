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

}  // namespace tessera
