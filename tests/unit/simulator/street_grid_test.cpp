// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "simulator/street_grid.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

namespace tessera::street {
namespace {

/// From the road, so outside of all things.
Ray random_ray(Random& random, const StreetGrid& grid) {
  const double along_m = random.uniform(0.0, grid.config().blocks * grid.config().pitch_m);
  const Eigen::Vector2d street = grid.crossing(0, random.below(grid.config().blocks + 1));
  const double azimuth = random.uniform(0.0, 2.0 * std::numbers::pi);
  const double elevation = random.uniform(-0.4, 0.4);
  Ray ray;
  ray.origin = {along_m, street.y() + random.uniform(-1.0, 1.0), random.uniform(0.5, 2.5)};
  ray.direction = {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                   std::sin(elevation)};
  return ray;
}

/// Of a ray with a box: the first of many places on the way that is inside.
double first_inside_m(const StreetGrid& grid, const Ray& ray, double most_m, double step_m) {
  for (double range_m = 0.0; range_m < most_m; range_m += step_m) {
    const Eigen::Vector3d p = ray.origin + range_m * ray.direction;
    if (p.z() < 0.0) return range_m;
    for (const StreetGrid::Box& box : grid.boxes()) {
      if ((p - box.low).minCoeff() > 0.0 && (box.high - p).minCoeff() > 0.0) return range_m;
    }
  }
  return most_m;
}

TEST_CASE("Grid of streets: a ray hits what it comes to first, on a surface") {
  const StreetGrid grid({.seed = 3, .blocks = 2});
  Random random(17);
  constexpr double kMost_m = 40.0;
  constexpr double kStep_m = 0.02;
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Ray ray = random_ray(random, grid);
    Hit hit;
    hit.range_m = kMost_m;
    grid.meet(ray, hit);
    const double walked_m = first_inside_m(grid, ray, kMost_m, kStep_m);
    // A walk may step over an edge that the ray just touches.
    REQUIRE(hit.range_m <= walked_m + 1e-9);
    if (hit.range_m == kMost_m) continue;
    ++hits;
    REQUIRE(grid.distance_m(ray.origin + hit.range_m * ray.direction, 1.0) < 1e-9);
    REQUIRE(hit.cos_incidence >= 0.0);
    REQUIRE(hit.cos_incidence <= 1.0);
    REQUIRE(hit.surface.id != RawId::kUnlabelled);
  }
  CHECK(hits > 200);
}

TEST_CASE("Grid of streets: the distance is that to the nearest face, from either side") {
  const StreetGrid grid({.seed = 5, .blocks = 1});
  Random random(23);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p(random.uniform(-20.0, 80.0), random.uniform(-20.0, 80.0),
                            random.uniform(-0.5, 8.0));
    double nearest_m = std::min(2.0, std::abs(p.z()));
    for (const StreetGrid::Box& box : grid.boxes()) {
      // To each of the six faces: the nearest place of a rectangle.
      for (int face = 0; face < 6; ++face) {
        Eigen::Vector3d low = box.low;
        Eigen::Vector3d high = box.high;
        (face < 3 ? high : low)[face % 3] = (face < 3 ? low : high)[face % 3];
        nearest_m = std::min(nearest_m, (p - p.cwiseMax(low).cwiseMin(high)).norm());
      }
    }
    REQUIRE(grid.distance_m(p, 2.0) == Approx(nearest_m).margin(1e-12));
  }
}

TEST_CASE("Grid of streets: roads are free, several kilometres long, and each seed has its own") {
  const StreetGrid grid({.seed = 1});
  CHECK(grid.length_m() == Approx(8640.0));
  for (const StreetGrid::Box& box : grid.boxes()) {
    // Nothing stands within 2.5 m of the middle of a street, on its whole length.
    for (int street = 0; street <= grid.config().blocks; ++street) {
      const double middle_m = grid.crossing(street, street).x();
      for (int axis = 0; axis < 2; ++axis) {
        const bool is_clear = box.low[axis] > middle_m + 2.5 || box.high[axis] < middle_m - 2.5;
        REQUIRE(is_clear);
      }
    }
  }
  const StreetGrid same({.seed = 1});
  const StreetGrid other({.seed = 2});
  REQUIRE(same.boxes().size() == grid.boxes().size());
  CHECK(same.boxes().back().high == grid.boxes().back().high);
  CHECK(other.boxes().size() != grid.boxes().size());
}

}  // namespace
}  // namespace tessera::street
