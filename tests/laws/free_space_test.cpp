// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Free space against brute force: which voxels a scan's rays free, how often, and what must not be
// freed.
#include <catch2/catch.hpp>
#include <cmath>
#include <iostream>

#include "oracle/carving_oracle.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

constexpr double kResolution_m = 0.1;

/// Every ray up to its own return, nothing else.
InferenceConfig bare_carving() {
  InferenceConfig config;
  config.mode = InferenceMode::kCounting;
  config.free_space = {
      .carving = Carving::kRays, .neighbour_angle_rad = 0.0F, .margin_voxels = 0.0F};
  config.min_range_m = 0.05F;
  config.thinning_m = 0.0;
  return config;
}

struct FreeVoxels {
  std::set<Voxel> voxels;
  float least = 1e9F;
  float most = 0.0F;
};

FreeVoxels free_voxels(const LocalMap& map) {
  FreeVoxels result;
  for (const auto& [voxel, evidence] : observed_voxels(map)) {
    const float free = evidence.sigma[0];
    if (!(free > 0.0F)) continue;
    result.voxels.insert(voxel);
    result.least = std::fmin(result.least, free);
    result.most = std::fmax(result.most, free);
  }
  return result;
}

/// What one scan from origin may and must free, from what the integrator says it admitted.
void check_carved(const Mapper& mapper, const Vector& origin) {
  Pierced pierced;
  std::set<Voxel> hits;
  for (const ScanPoint& point : mapper.integrator().admitted()) {
    pierced.add(origin, vector_of(point.p_map), kResolution_m);
    hits.insert(cell_of(vector_of(point.p_map), kResolution_m));
  }
  for (const ScanPoint& ray : mapper.integrator().admitted_rays()) {
    pierced.add(origin, vector_of(ray.p_map), kResolution_m);
  }
  const FreeVoxels carved = free_voxels(mapper.map());
  int missing = 0;
  int extra = 0;
  for (const Voxel& voxel : pierced.certain)
    missing += hits.count(voxel) == 0 && carved.voxels.count(voxel) == 0 ? 1 : 0;
  for (const Voxel& voxel : carved.voxels)
    extra += hits.count(voxel) != 0 || pierced.possible.count(voxel) == 0 ? 1 : 0;
  CHECK(carved.voxels.size() > 100);
  CHECK(missing == 0);
  CHECK(extra == 0);
  CHECK(carved.least == mapper.map().config().free_weight);
  CHECK(carved.most == mapper.map().config().free_weight);
}

}  // namespace

TEST_CASE(
    "free space: exactly the voxels that a ray pierces before its hit are freed, once a scan") {
  const Vector origin = GENERATE(Vector{0.013, -0.027, 0.041}, Vector{-1.237, 0.411, -0.893},
                                 Vector{0.55, 0.55, 0.55});
  Random random(announce_seed(41));
  Mapper mapper(uncapped_map(kResolution_m), bare_carving(), 5);
  const ScanReport report = mapper.integrate(random_cloud(random, {.points = 90}), pose_at(origin));
  REQUIRE(report.admitted == report.thinned);
  REQUIRE(report.rays == report.admitted);
  check_carved(mapper, origin);
}

TEST_CASE("free space: a return beyond the range frees up to the range and adds no hit") {
  const Vector origin{0.213, -0.127, 0.341};
  InferenceConfig config = bare_carving();
  config.max_range_m = 2.0F;
  Random random(announce_seed(42));
  Mapper mapper(uncapped_map(kResolution_m), config, 5);
  const ScanReport report =
      mapper.integrate(random_cloud(random, {.points = 120, .reach_m = 6.0}), pose_at(origin));
  REQUIRE(report.beyond_range > 60);
  CHECK(mapper.integrator().admitted_rays().size() == report.beyond_range);
  const Point3d from(origin[0], origin[1], origin[2]);
  for (const ScanPoint& ray : mapper.integrator().admitted_rays()) {
    CHECK((ray.p_map.cast<double>() - from).norm() == Approx(2.0).epsilon(1e-6));
  }
  check_carved(mapper, origin);
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    const Point3d center((static_cast<double>(voxel[0]) + 0.5) * kResolution_m,
                         (static_cast<double>(voxel[1]) + 0.5) * kResolution_m,
                         (static_cast<double>(voxel[2]) + 0.5) * kResolution_m);
    REQUIRE((center - from).norm() < 2.0 + kResolution_m);
  }
}

TEST_CASE("free space: a hundred rays through a voxel count one pass") {
  Mapper mapper(uncapped_map(kResolution_m), bare_carving(), 5);
  Cloud cloud;
  for (int i = 0; i < 100; ++i) cloud.add(3.0 + 0.001 * i, 0.05, 0.05, 1);
  for (int scan = 1; scan <= 3; ++scan) {
    static_cast<void>(mapper.integrate(cloud, pose_at({0.05, 0.05, 0.05})));
    CHECK(mapper.map().evidence(Point3f(1.55F, 0.05F, 0.05F)).sigma[0] == Approx(0.4 * scan));
  }
}

TEST_CASE("free space: a voxel that holds a hit is not freed by rays that pass through it") {
  Mapper mapper(uncapped_map(kResolution_m), bare_carving(), 5);
  Cloud cloud;
  cloud.add(1.55, 0.05, 0.05, 1);
  cloud.add(3.0, 0.05, 0.05, 2);
  static_cast<void>(mapper.integrate(cloud, pose_at({0.0, 0.0, 0.0})));
  const VoxelEvidence at_hit = mapper.map().evidence(Point3f(1.55F, 0.05F, 0.05F));
  CHECK(at_hit.sigma[0] == 0.0F);
  CHECK(at_hit.sigma[1] == 1.0F);
}

namespace {

constexpr double kGround_m = -1.73;

/// One turn of a spinning sensor over ground, beside a wall along the way and towards a thin post.
Cloud street_scan(double x_sensor, Random& random) {
  Cloud cloud;
  constexpr int kBeams = 40;
  constexpr int kTurn = 480;
  for (int beam = 0; beam < kBeams; ++beam) {
    const double elevation = (-24.0 + 26.0 * beam / (kBeams - 1)) * 3.14159265358979 / 180.0;
    for (int i = 0; i < kTurn; ++i) {
      const double azimuth = 2.0 * 3.14159265358979 * (i + 0.3) / kTurn;
      const double ux = std::cos(elevation) * std::cos(azimuth);
      const double uy = std::cos(elevation) * std::sin(azimuth);
      const double uz = std::sin(elevation);
      double range_m = uz < 0.0 ? kGround_m / uz : 1e9;
      int label = 1;
      const double to_wall_m = uy > 0.0 ? 4.03 / uy : 1e9;
      if (to_wall_m < range_m && to_wall_m * uz < 1.0 &&
          std::abs(x_sensor + to_wall_m * ux) < 18.0) {
        range_m = to_wall_m;
        label = 2;
      }
      const double to_panel_m = ux > 0.0 ? (12.05 - x_sensor) / ux : 1e9;
      if (to_panel_m < range_m && std::abs(to_panel_m * uy + 1.5) < 0.6 && to_panel_m * uz < 0.5) {
        range_m = to_panel_m;
        label = 3;
      }
      if (range_m > 60.0) continue;
      range_m += random.uniform(-0.02, 0.02);
      cloud.add(range_m * ux, range_m * uy, range_m * uz, label);
    }
  }
  return cloud;
}

}  // namespace

TEST_CASE("free space: thin walls and grazed ground outlive ten scans with the defaults") {
  const InferenceMode mode = GENERATE(InferenceMode::kCounting, InferenceMode::kMultiEntropy);
  CAPTURE(static_cast<int>(mode));
  MapConfig map_config;
  map_config.storage_bytes = std::size_t{256} << 20U;
  InferenceConfig config;
  config.mode = mode;
  Mapper mapper(map_config, config, 5, {.points = 20000, .tiles = 20000, .ray_blocks = 131072});
  Random random(announce_seed(43));
  std::set<Voxel> hits;
  for (int scan = 0; scan < 10; ++scan) {
    const double x_sensor = 0.37 * scan;
    const ScanReport report =
        mapper.integrate(street_scan(x_sensor, random), pose_at({x_sensor, 0.0, 0.0}));
    REQUIRE(report.left_out() == 0);
    for (const ScanPoint& point : mapper.integrator().admitted()) {
      hits.insert(cell_of(vector_of(point.p_map), map_config.resolution_m));
    }
  }
  std::size_t occupied = 0;
  for (const Voxel& voxel : hits) {
    const VoxelCoord at{static_cast<int>(voxel[0]), static_cast<int>(voxel[1]),
                        static_cast<int>(voxel[2])};
    occupied += mapper.map().query(at).state == VoxelState::kOccupied ? 1U : 0U;
  }
  std::cout << occupied << " of " << hits.size() << " hit voxels stay occupied\n";
  CHECK(mapper.map().count_free_voxels() > hits.size());
  CHECK(static_cast<double>(occupied) >= 0.99 * static_cast<double>(hits.size()));
}

TEST_CASE(
    "free space: what moved away is free after max_evidence / free_weight passes, however old") {
  MapConfig map_config = uncapped_map(kResolution_m);
  map_config.max_evidence = 10.0F;
  map_config.free_weight = 0.4F;
  Mapper mapper(map_config, bare_carving(), 5);
  Cloud object;
  Cloud behind;
  for (int y = -4; y < 4; ++y) {
    for (int z = -4; z < 4; ++z) {
      const double py = 0.1 * y + 0.05;
      const double pz = 0.1 * z + 0.05;
      object.add(2.05, py, pz, 1);
      behind.add(3.0 * 2.05, 3.0 * py, 3.0 * pz, 2);
    }
  }
  for (int scan = 0; scan < 60; ++scan) static_cast<void>(mapper.integrate(object));
  const auto count = [&](VoxelState state) {
    int n = 0;
    for (std::size_t i = 0; i < object.size(); ++i) {
      const Point3f p(object.xyz[3 * i], object.xyz[3 * i + 1], object.xyz[3 * i + 2]);
      n += mapper.map().query(p).state == state ? 1 : 0;
    }
    return n;
  };
  REQUIRE(count(VoxelState::kOccupied) == 64);
  for (int pass = 0; pass < 25; ++pass) static_cast<void>(mapper.integrate(behind));
  CHECK(count(VoxelState::kFree) == 64);
  CHECK(mapper.map().usage().label_voxels == 64);
}

}  // namespace tessera::oracle
