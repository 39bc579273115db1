// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The street's floor: its cross-section, and rays that end on it.
#include "simulator/ground.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "simulator/random.hpp"

namespace {

using tessera::street::Ground;
using tessera::street::Hit;
using tessera::street::kNoHit;
using tessera::street::Random;
using tessera::street::RawId;
using tessera::street::Ray;

constexpr std::uint64_t kSeed = 5;

}  // namespace

TEST_CASE("Ground: road in the middle, sidewalk beyond the kerb strip, gardens outside") {
  const Ground ground(kSeed, 80.0);
  for (const double side : {1.0, -1.0}) {
    CHECK(ground.surface(3.0, side * 1.0).id == RawId::kRoad);
    CHECK(ground.surface(3.0, side * 7.0).id == RawId::kSidewalk);
    CHECK(ground.surface(3.0, side * 12.0).id == RawId::kTerrain);
  }
}

TEST_CASE("Ground: the kerb strip alternates between parking bays and grass") {
  const Ground ground(kSeed, 80.0);
  int bays = 0;
  for (int slot = -10; slot < 10; ++slot) bays += ground.is_parking(1, slot) ? 1 : 0;
  CHECK(bays > 5);
  CHECK(bays < 16);
}

TEST_CASE("Ground: the gardens undulate more than the road") {
  const Ground ground(kSeed, 80.0);
  double road = 0.0;
  double garden = 0.0;
  for (double x = -60.0; x < 60.0; x += 0.5) {
    road = std::max(road, std::abs(ground.height(x, 1.0) - ground.road_height(x)));
    garden = std::max(garden, std::abs(ground.height(x, 16.0) - ground.road_height(x)));
  }
  CHECK(road < 0.1);
  CHECK(garden > 0.3);
}

TEST_CASE("Ground: a ray ends where it reaches the height of the floor") {
  const Ground ground(kSeed, 80.0);
  Random random(3);
  double worst_m = 0.0;
  int met = 0;
  for (int i = 0; i < 3000; ++i) {
    const double azimuth = random.uniform(0.0, 6.283185307179586);
    const Eigen::Vector3d direction =
        Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), random.uniform(-0.5, -0.02))
            .normalized();
    const Ray ray{{random.uniform(-20, 20), 0.5, 2.0}, direction};
    Hit hit;
    ground.meet(ray, hit);
    if (hit.range_m == kNoHit) continue;
    ++met;
    const Eigen::Vector3d p = ray.origin + hit.range_m * ray.direction;
    // The kerbs are ramps of one cell in the stored field and steps in the formula: leave them out.
    const double off = std::abs(p.y());
    if (off > 3.3 && off < 8.6) continue;
    worst_m = std::max(worst_m, std::abs(p.z() - ground.height(p.x(), p.y())));
  }
  CHECK(met > 1000);
  CHECK(worst_m < 0.03);
}

TEST_CASE("Ground: skipping tiles changes nothing, however shallow the ray") {
  const Ground ground(kSeed, 80.0);
  Random random(4);
  int below = 0;
  for (int i = 0; i < 500; ++i) {
    const Ray ray{{-70.0, random.uniform(-3.0, 3.0), 1.7},
                  Eigen::Vector3d(1.0, random.uniform(-0.05, 0.05), -0.02).normalized()};
    Hit hit;
    ground.meet(ray, hit);
    const double end = std::min(hit.range_m, 140.0) - 0.3;
    for (double t = 0.0; t < end; t += 0.2) {
      const Eigen::Vector3d p = ray.origin + t * ray.direction;
      const bool on_road = std::abs(p.y()) < 3.3;
      if (on_road && p.z() < ground.height(p.x(), p.y()) - 0.01) ++below;
    }
  }
  CHECK(below == 0);
}

TEST_CASE("Ground: rays beyond the floor's end and rays into the sky meet nothing") {
  const Ground ground(kSeed, 80.0);
  Hit up;
  ground.meet({{0, 0, 2}, Eigen::Vector3d(1, 0, 0.5).normalized()}, up);
  CHECK(up.range_m == kNoHit);
  Hit beyond;
  ground.meet({{81.0, 0, 5}, Eigen::Vector3d(1, 0, -0.1).normalized()}, beyond);
  CHECK(beyond.range_m == kNoHit);
}

TEST_CASE("Ground: a longer street has the same middle") {
  const Ground shorter(kSeed, 80.0);
  const Ground longer(kSeed, 160.0);
  const Ray ray{{0, 1, 2}, Eigen::Vector3d(1, 0.3, -0.1).normalized()};
  Hit a;
  Hit b;
  shorter.meet(ray, a);
  longer.meet(ray, b);
  CHECK(a.range_m == Approx(b.range_m).epsilon(1e-9));
}
