// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/grid/centroid.hpp"

#include <algorithm>
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

/// In twelfths of the voxel.
int square_from_middle(Centroid centroid) {
  int sum = 0;
  for (const int level : centroid.levels()) {
    const int twelfths = 2 * level + 1;
    sum += (twelfths - 6) * (twelfths - 6);
  }
  return sum;
}

TEST_CASE("Centroid: of two the one nearer to the middle stays, whatever their order") {
  const Centroid far = Centroid::of_levels({0, 3, 5});
  const Centroid near = Centroid::of_levels({4, 2, 2});
  CHECK(far.nearer(near) == near);
  CHECK(Centroid().nearer(far) == far);
  CHECK(far.nearer(Centroid()) == far);
  CHECK_FALSE(Centroid().nearer(Centroid()).known());
  for (int a = 1; a < Centroid::kCodes; ++a) {
    for (int b = 1; b < Centroid::kCodes; ++b) {
      const Centroid one = Centroid::of_code(static_cast<std::uint8_t>(a));
      const Centroid other = Centroid::of_code(static_cast<std::uint8_t>(b));
      const Centroid joined = one.nearer(other);
      REQUIRE(joined == other.nearer(one));
      REQUIRE((joined == one || joined == other));
      REQUIRE(square_from_middle(joined) ==
              std::min(square_from_middle(one), square_from_middle(other)));
      const Centroid third = Centroid::of_code(static_cast<std::uint8_t>(1 + (a * 7 + b) % 216));
      REQUIRE(joined.nearer(third) == one.nearer(other.nearer(third)));
    }
  }
}

}  // namespace
}  // namespace tessera
