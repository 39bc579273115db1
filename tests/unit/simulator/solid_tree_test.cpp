// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rays against single solids, and the tree against trying every solid.
#include "simulator/solid_tree.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "simulator/assembly.hpp"
#include "simulator/random.hpp"

namespace {

using tessera::street::Assembly;
using tessera::street::Hit;
using tessera::street::kNoHit;
using tessera::street::Primitive;
using tessera::street::Random;
using tessera::street::RawId;
using tessera::street::Ray;
using tessera::street::SolidTree;
using tessera::street::surface_of;

Hit first(const std::vector<Primitive>& solids, const Ray& ray) {
  Hit hit;
  for (const Primitive& solid : solids) tessera::street::meet(solid, ray, hit);
  return hit;
}

std::vector<Primitive> clutter(int count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Primitive> solids;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d at(random.uniform(-40, 40), random.uniform(-15, 15),
                             random.uniform(0, 5));
    Assembly out(solids, {at, random.uniform(0.0, 6.0)}, static_cast<std::uint32_t>(i));
    const double size = random.uniform(0.1, 1.5);
    auto surface = surface_of(RawId::kBuilding);
    if (i % 5 == 0) surface.fill = 0.3;
    if (i % 3 == 0) out.tapered({0, 0, 0}, {size, 0.5}, {0.5 * size, 0.1}, size, surface);
    if (i % 3 == 1) out.cylinder({0, 0, 0}, 0.1 * size, 3.0 * size, surface);
    if (i % 3 == 2) out.ellipsoid({0, 0, 0}, {size, 0.4, 0.7}, surface);
  }
  return solids;
}

}  // namespace

TEST_CASE("Primitive: a ray meets a turned box on the face towards it") {
  std::vector<Primitive> solids;
  Assembly(solids, {{10, 0, 0}, 0.5 * 3.141592653589793}, 7)
      .box({0, 0, 0}, {1.0, 2.0}, 3.0, surface_of(RawId::kFence));
  const Hit hit = first(solids, {{0, 0, 1}, {1, 0, 0}});
  CHECK(hit.range_m == Approx(8.0));
  CHECK(hit.cos_incidence == Approx(1.0));
  CHECK(hit.object == 7);
}

TEST_CASE("Primitive: a ray above a box misses it") {
  std::vector<Primitive> solids;
  Assembly(solids, {{10, 0, 0}, 0.0}, 1).box({0, 0, 0}, {1.0, 2.0}, 3.0, surface_of(RawId::kFence));
  CHECK(first(solids, {{0, 0, 3.01}, {1, 0, 0}}).range_m == kNoHit);
}

TEST_CASE("Primitive: a tapered box leans its sides by the difference of foot and top") {
  std::vector<Primitive> solids;
  Assembly(solids, {{10, 0, 0}, 0.0}, 1)
      .tapered({0, 0, 0}, {2.0, 2.0}, {0.0, 0.0}, 4.0, surface_of(RawId::kFence));
  const Hit hit = first(solids, {{0, 0, 2}, {1, 0, 0}});
  CHECK(hit.range_m == Approx(9.0));
  CHECK(hit.cos_incidence == Approx(2.0 / std::sqrt(5.0)));
}

TEST_CASE("Primitive: a pole of 3 cm radius is met exactly at 100 m") {
  std::vector<Primitive> solids;
  Assembly(solids, {{100, 0, 0}, 0.0}, 1).cylinder({0, 0, 0}, 0.03, 3.0, surface_of(RawId::kPole));
  CHECK(first(solids, {{0, 0, 1}, {1, 0, 0}}).range_m == Approx(99.97).epsilon(1e-9));
  CHECK(first(solids, {{0, 0.031, 1}, {1, 0, 0}}).range_m == kNoHit);
}

TEST_CASE("Primitive: leaves are in the same places for every ray that reaches them") {
  std::vector<Primitive> solids;
  auto leaves = surface_of(RawId::kVegetation);
  leaves.fill = 0.2;
  Assembly(solids, {{10, 0, 0}, 0.0}, 3).ellipsoid({0, 0, 0}, {2, 2, 2}, leaves);
  const Hit whole = first(solids, {{0, 0.1, 0.1}, {1, 0, 0}});
  REQUIRE(whole.range_m < 12.0);
  // From just before the leaf, it is still the first thing in the way.
  const Hit near = first(solids, {{whole.range_m - 0.01, 0.1, 0.1}, {1, 0, 0}});
  CHECK(near.range_m < 0.15);
}

TEST_CASE("SolidTree: an empty tree meets nothing") {
  Hit hit;
  SolidTree().meet({{0, 0, 0}, {1, 0, 0}}, hit);
  CHECK(hit.range_m == kNoHit);
}

TEST_CASE("SolidTree: finds what trying every solid finds") {
  constexpr std::uint64_t kSeed = 11;
  CAPTURE(kSeed);
  const auto solids = clutter(500, kSeed);
  const SolidTree tree(solids);
  Random random(kSeed + 1);
  int wrong = 0;
  int met = 0;
  for (int i = 0; i < 4000; ++i) {
    const double azimuth = random.uniform(0.0, 6.283185307179586);
    const double rise = random.uniform(-0.3, 0.3);
    const Eigen::Vector3d direction =
        Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), rise).normalized();
    const Ray ray{{random.uniform(-5, 5), random.uniform(-5, 5), 1.7}, direction};
    const Hit brute = first(solids, ray);
    Hit hit;
    tree.meet(ray, hit);
    met += brute.range_m < kNoHit ? 1 : 0;
    wrong += (hit.range_m < brute.range_m || brute.range_m < hit.range_m) ? 1 : 0;
  }
  CHECK(wrong == 0);
  CHECK(met > 1000);
}

TEST_CASE("SolidTree: rays along the axes meet solids that touch them") {
  std::vector<Primitive> solids;
  for (int i = 0; i < 10; ++i) {
    Assembly(solids, {{5.0 + 3.0 * i, 0, 0}, 0.0}, 1)
        .box({0, 0, 0}, {0.5, 0.5}, 1.0, surface_of(RawId::kFence));
  }
  Hit hit;
  SolidTree(solids).meet({{0, 0, 0.5}, {1, 0, 0}}, hit);
  CHECK(hit.range_m == Approx(4.5));
}
