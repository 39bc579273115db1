// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/grid/centroid.hpp"

#include <catch2/catch.hpp>
#include <set>

namespace tessera {
namespace {

TEST_CASE("Centroid: 216 places and none have a code each") {
  std::set<int> codes{Centroid().code()};
  CHECK_FALSE(Centroid().known());
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      for (int z = 0; z < 6; ++z) {
        const Centroid centroid = Centroid::of_levels({x, y, z});
        CHECK(centroid.known());
        CHECK(centroid.levels() == std::array<int, 3>{x, y, z});
        codes.insert(centroid.code());
      }
    }
  }
  CHECK(codes.size() == 217);
  CHECK(*codes.rbegin() == Centroid::kCodes - 1);
}

TEST_CASE(
    "Centroid: a place is in the middle of its sixth, to a twelfth; outside counts as at the "
    "face") {
  for (int i = 0; i < 600; ++i) {
    const float place = (static_cast<float>(i) + 0.5F) / 600.0F;
    const int level = Centroid::at(place, 0.5F, 0.5F).levels()[0];
    CHECK(Centroid::middle_of(level) == Approx(place).margin(1.0 / 12.0 + 1e-6));
  }
  CHECK(Centroid::at(-1.0F, 0.0F, 0.999F).levels() == std::array<int, 3>{0, 0, 5});
  CHECK(Centroid::at(1.0F, 7.0F, std::numeric_limits<float>::quiet_NaN()).levels() ==
        std::array<int, 3>{5, 5, 0});
}

TEST_CASE("Centroid: with each scan it moves one level on each axis toward what was seen") {
  const Centroid here = Centroid::of_levels({0, 3, 5});
  CHECK(here.moved_toward(Centroid()) == here);
  CHECK(Centroid().moved_toward(here) == here);
  CHECK(here.moved_toward(Centroid::of_levels({5, 3, 0})) == Centroid::of_levels({1, 3, 4}));
  CHECK(here.moved_toward(here) == here);
}

}  // namespace
}  // namespace tessera
