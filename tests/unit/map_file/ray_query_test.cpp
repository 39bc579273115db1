// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rays, against walking along them in steps of a thousandth of a voxel, and voxel by voxel.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>

#include "support/sample_map.hpp"
#include "tessera/grid/internal/segment.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

constexpr double kResolution_m = 0.1;

struct Ray {
  Point3f origin;
  Point3f direction;
};

Ray random_ray(SampleRandom& random) {
  const auto coordinate = [&] { return static_cast<float>(random.uniform(-1.2, 1.2)); };
  return {{coordinate(), coordinate(), coordinate()}, {coordinate(), coordinate(), coordinate()}};
}

Point3f along(const Ray& ray, double distance_m) {
  const Point3d d = ray.direction.cast<double>();
  const Point3d p = ray.origin.cast<double>() + d * (distance_m / std::sqrt(d.squaredNorm()));
  return p.cast<float>();
}

/// Where the ray first meets a voxel that is not free (nor, unless it stops, unknown); range if
/// nowhere.
double first_stop(const LocalMap& map, const Ray& ray, double range_m, bool stop_at_unknown,
                  double step_m) {
  for (double t = 0.0; t < range_m; t += step_m) {
    const VoxelState state = map.query(along(ray, t)).state;
    if (state == VoxelState::kOccupied) return t;
    if (stop_at_unknown && state == VoxelState::kUnknown) return t;
  }
  return range_m;
}

void compare(const LocalMap& map, bool stop_at_unknown) {
  constexpr double kStep_m = kResolution_m / 1000.0;
  constexpr double kRange_m = 2.0;
  SampleRandom random(9);
  int hits = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Ray ray = random_ray(random);
    const RayHit hit = cast_ray(map, ray.origin, ray.direction, kRange_m, stop_at_unknown);
    REQUIRE(hit.end != RayHit::End::kInvalid);
    const double walked_m = first_stop(map, ray, kRange_m, stop_at_unknown, kStep_m);
    INFO("trial " << trial << ", walked " << walked_m << " m, cast " << hit.distance_m << " m");
    CHECK(hit.distance_m <= walked_m + 1e-5);
    // A corner may be cut in less than a step, and then walking passes it by.
    const bool cuts_a_corner =
        map.lattice().voxel_of(along(ray, hit.distance_m + 2 * kStep_m)).ok() &&
        !(*map.lattice().voxel_of(along(ray, hit.distance_m + 2 * kStep_m)) == hit.voxel);
    if (!cuts_a_corner) CHECK(hit.distance_m >= walked_m - 2 * kStep_m);
    if (hit.end == RayHit::End::kOccupied) {
      ++hits;
      CHECK(map.query(hit.voxel).state == VoxelState::kOccupied);
      CHECK(hit.estimate.label == map.query(hit.voxel).label);
    }
    if (hit.end == RayHit::End::kUnknown) CHECK(map.query(hit.voxel).state == VoxelState::kUnknown);
  }
  if (!stop_at_unknown) CHECK(hits > 10);
}

/// A row of voxels along x: free at 1 and 2, unknown at 3, occupied at 4 and 5.
SmallMap row() {
  SmallMap sample(config_of_pages(8), kSampleClasses);
  observe(
      sample.map,
      {{{0, 0, 0}, 0}, {{1, 0, 0}, 0}, {{2, 0, 0}, 0}, {{4, 0, 0}, 2, 1.0F}, {{5, 0, 0}, 1, 1.0F}});
  return sample;
}

const Point3f kOrigin{0.05F, 0.05F, 0.05F};

Estimate estimate_of(const LocalMap& map, VoxelCoord voxel) {
  return estimate(map.evidence(voxel), map.reading());
}

/// cast_ray as its definition has it: every voxel of the walk, one by one.
RayHit walked(const LocalMap& map, const Ray& ray, double range_m, bool stop_at_unknown) {
  RayHit hit{.end = RayHit::End::kMaxRange, .distance_m = range_m};
  const Point3d from = ray.origin.cast<double>();
  const Point3d d = ray.direction.cast<double>();
  const Point3d to = from + d * (range_m / norm(d));
  const double resolution_m = map.config().resolution_m;
  walk_segment(from / resolution_m, to / resolution_m, [&](int x, int y, int z, double t) {
    const VoxelCoord voxel{x, y, z};
    const Estimate estimate = estimate_of(map, voxel);
    const bool unknown = estimate.state == VoxelState::kUnknown;
    if (estimate.state == VoxelState::kFree || (unknown && !stop_at_unknown)) return true;
    hit = {unknown ? RayHit::End::kUnknown : RayHit::End::kOccupied, voxel, t * range_m, estimate};
    return false;
  });
  return hit;
}

}  // namespace

TEST_CASE("a ray ends where small steps along it end") {
  const SmallMap sample = sample_map(1, 900, 12, 200);
  compare(sample.map, false);
}

TEST_CASE("a ray that stops at unknown voxels ends where small steps along it end") {
  SmallMap sample(config_of_pages(100), kSampleClasses);
  for (int z = -6; z < 6; ++z) {
    for (int y = -6; y < 6; ++y) {
      for (int x = -6; x < 6; ++x) observe(sample.map, {{{x, y, z}, 0}});
    }
  }
  compare(sample.map, true);
}

TEST_CASE("a ray meets what a walk that asks for every voxel meets, to the last bit") {
  std::array<int, 3> ends{};
  for (const double prior : {0.001, 7.0}) {  // with 7, a single pass leaves a voxel occupied
    for (const bool stop_at_unknown : {false, true}) {
      MapConfig config = config_of_pages(200);
      config.prior = prior;
      SmallMap sample(config, kSampleClasses);
      // Free on one side, with labels here and there; nothing on the other.
      SampleRandom random(31);
      for (int i = 0; i < 9000; ++i) {
        const VoxelCoord v{random.integer(-30, 12), random.integer(-12, 12), random.integer(-9, 9)};
        observe(sample.map, {{v, 0}});
        const bool labelled = i % 150 == 0;
        if (labelled) observe(sample.map, {{v, 1 + i % 3, 0.1F * static_cast<float>(i % 7)}});
      }
      CHECK(sample.map.only_labels_occupy() == (prior < 1.0));
      for (int trial = 0; trial < 3000; ++trial) {
        Ray ray = random_ray(random);
        for (int axis = 0; axis < 3; ++axis) {
          if (random.integer(0, 3) == 0) ray.direction[axis] = 0.0F;
          if (random.integer(0, 3) == 0)
            ray.origin[axis] = 0.1F * static_cast<float>(random.integer(-12, 12));
        }
        if (ray.direction.isZero()) continue;
        const double range_m = random.uniform(0.05, 6.0);
        const RayHit hit =
            cast_ray(sample.map, ray.origin, ray.direction, range_m, stop_at_unknown);
        const RayHit expected = walked(sample.map, ray, range_m, stop_at_unknown);
        REQUIRE(hit.end == expected.end);
        REQUIRE(hit.voxel == expected.voxel);
        REQUIRE(hit.distance_m == expected.distance_m);
        REQUIRE(hit.estimate.state == expected.estimate.state);
        REQUIRE(hit.estimate.label == expected.estimate.label);
        REQUIRE(hit.estimate.probability == expected.estimate.probability);
        REQUIRE(hit.estimate.occupancy == expected.estimate.occupancy);
        ++ends.at(static_cast<std::size_t>(hit.end));
      }
    }
  }
  for (const int count : ends) CHECK(count > 500);
}

TEST_CASE("a ray passes free and unknown voxels and ends at the first occupied one") {
  const SmallMap sample = row();
  const RayHit hit = cast_ray(sample.map, kOrigin, {3.0F, 0.0F, 0.0F}, 10.0);
  CHECK(hit.end == RayHit::End::kOccupied);
  CHECK(hit.voxel == VoxelCoord{4, 0, 0});
  CHECK(hit.distance_m == Approx(0.35));
  CHECK(hit.estimate.label == 2);
}

TEST_CASE("a ray that stops at unknown ends at the first voxel never observed") {
  const SmallMap sample = row();
  const RayHit hit = cast_ray(sample.map, kOrigin, {1.0F, 0.0F, 0.0F}, 10.0, true);
  CHECK(hit.end == RayHit::End::kUnknown);
  CHECK(hit.voxel == VoxelCoord{3, 0, 0});
  CHECK(hit.distance_m == Approx(0.25));
}

TEST_CASE("a ray that starts in an occupied voxel ends there") {
  const SmallMap sample = row();
  const RayHit hit = cast_ray(sample.map, {0.45F, 0.05F, 0.05F}, {0.0F, 0.0F, -1.0F}, 1.0);
  CHECK(hit.end == RayHit::End::kOccupied);
  CHECK(hit.distance_m == 0.0);
}

TEST_CASE("a ray too short to reach anything ends at its range") {
  const SmallMap sample = row();
  const RayHit hit = cast_ray(sample.map, kOrigin, {1.0F, 0.0F, 0.0F}, 0.3);
  CHECK(hit.end == RayHit::End::kMaxRange);
  CHECK(hit.distance_m == 0.3);
}

TEST_CASE("a ray without a direction, a range or a place is invalid") {
  const SmallMap sample = row();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const auto end = [&](Point3f origin, Point3f direction, double range_m) {
    return cast_ray(sample.map, origin, direction, range_m).end;
  };
  const Point3f ahead{1.0F, 0.0F, 0.0F};
  CHECK(end(kOrigin, {0.0F, 0.0F, 0.0F}, 1.0) == RayHit::End::kInvalid);
  CHECK(end(kOrigin, {kNan, 0.0F, 0.0F}, 1.0) == RayHit::End::kInvalid);
  CHECK(end(kOrigin, {kInf, 0.0F, 0.0F}, 1.0) == RayHit::End::kInvalid);
  CHECK(end({kNan, 0.0F, 0.0F}, ahead, 1.0) == RayHit::End::kInvalid);
  CHECK(end({1e9F, 0.0F, 0.0F}, ahead, 1.0) == RayHit::End::kInvalid);
  for (const double range_m :
       {0.0, -1.0, 1e12, static_cast<double>(kNan), static_cast<double>(kInf)})
    CHECK(end(kOrigin, ahead, range_m) == RayHit::End::kInvalid);
}

TEST_CASE("the end of a ray has a name") {
  CHECK(std::string(to_string(RayHit::End::kMaxRange)) == "max range");
  CHECK(std::string(to_string(RayHit::End::kOccupied)) == "occupied");
  CHECK(std::string(to_string(RayHit::End::kUnknown)) == "unknown");
  CHECK(std::string(to_string(RayHit::End::kInvalid)) == "invalid");
}

}  // namespace tessera
