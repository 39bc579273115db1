// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The neighbour rule of carving, ray by ray: each is freed up to the nearest return around its
// direction, not beyond and not much less.
#include <catch2/catch.hpp>
#include <cmath>

#include "oracle/carving_oracle.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

constexpr double kResolution_m = 0.1;

InferenceConfig counting(const FreeSpaceConfig& free_space) {
  InferenceConfig config;
  config.mode = InferenceMode::kCounting;
  config.free_space = free_space;
  config.free_space.carving = Carving::kRays;
  config.min_range_m = 0.05F;
  config.thinning_m = 0.0;
  return config;
}

bool freed(const Mapper& mapper, double x, double y, double z) {
  return mapper.map().evidence(Point3d(x, y, z).cast<float>()).sigma[0] > 0.0F;
}

/// A scan from the middle of the voxel at the origin: a pole of returns at 4 m, and a ray that ends
/// at 12 m and passes it at off_rad, in a plane turned by roll_rad around the way to the pole.
Cloud ray_past_pole(double off_rad, double roll_rad) {
  const double side_m = 12.0 * std::sin(off_rad);
  Cloud cloud;
  cloud.add(4.0, 0.0, 0.0, 1);
  cloud.add(12.0 * std::cos(off_rad), side_m * std::cos(roll_rad), side_m * std::sin(roll_rad), 2);
  return cloud;
}

}  // namespace

TEST_CASE(
    "neighbour rule: a ray that passes a pole within the angle is freed up to the pole only") {
  const float angle_rad = GENERATE(0.005F, 0.015F, 0.05F);
  const double part = GENERATE(0.2, 0.45, 0.7, 0.99);
  const double roll_rad = GENERATE(0.0, 0.4, 0.785398, 2.0, 4.5);
  CAPTURE(angle_rad, part, roll_rad);
  const double off_rad = part * static_cast<double>(angle_rad);
  Mapper mapper(
      uncapped_map(kResolution_m),
      counting({.enabled = true, .neighbour_angle_rad = angle_rad, .margin_voxels = 2.0F}), 5);
  static_cast<void>(
      mapper.integrate(ray_past_pole(off_rad, roll_rad), pose_at({0.05, 0.05, 0.05})));
  int freed_beyond = 0;
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    freed_beyond += voxel[0] >= 39 && evidence.sigma[0] > 0.0F ? 1 : 0;
  }
  CHECK(freed_beyond == 0);
  CHECK(freed(mapper, 3.75, 0.05, 0.05));
}

TEST_CASE("neighbour rule: a ray that passes a pole farther off is freed up to its own return") {
  const FreeSpaceConfig own_only{.neighbour_angle_rad = 0.0F, .margin_voxels = 2.0F};
  const FreeSpaceConfig defaults;
  const bool with_rule = GENERATE(false, true);
  const double off_rad =
      with_rule ? static_cast<double>(defaults.neighbour_angle_rad) + 0.0149 : 0.001;
  Mapper mapper(uncapped_map(kResolution_m), counting(with_rule ? defaults : own_only), 5);
  static_cast<void>(mapper.integrate(ray_past_pole(off_rad, 0.4), pose_at({0.05, 0.05, 0.05})));
  int freed_beyond = 0;
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    freed_beyond += voxel[0] >= 50 && evidence.sigma[0] > 0.0F ? 1 : 0;
  }
  CHECK(freed_beyond >= 68);
}

TEST_CASE(
    "neighbour rule: each ray frees at least up to the nearest return within the angle and a "
    "pixel, at most up to the nearest within the angle") {
  const float angle_rad = GENERATE(0.004F, 0.015F, 0.05F);
  const float margin_voxels = GENERATE(0.0F, 1.5F);
  CAPTURE(angle_rad, margin_voxels);
  InferenceConfig config =
      counting({.neighbour_angle_rad = angle_rad, .margin_voxels = margin_voxels});
  config.max_range_m = 3.0F;
  Random random(announce_seed(44));
  Mapper mapper(uncapped_map(kResolution_m), config, 5);
  const Vector origin{0.213, -0.127, 0.341};
  static_cast<void>(
      mapper.integrate(random_cloud(random, {.points = 150, .reach_m = 4.0}), pose_at(origin)));
  std::vector<Vector> returns;
  std::set<Voxel> hits;
  for (const ScanPoint& point : mapper.integrator().admitted()) {
    returns.push_back(vector_of(point.p_map));
    hits.insert(cell_of(returns.back(), kResolution_m));
  }
  std::vector<Vector> ends = returns;
  for (const ScanPoint& ray : mapper.integrator().admitted_rays())
    ends.push_back(vector_of(ray.p_map));
  REQUIRE(ends.size() > returns.size() + 20);
  Pierced at_least;
  Pierced at_most;
  const auto angle = static_cast<double>(angle_rad);
  const double margin_m = static_cast<double>(margin_voxels) * kResolution_m;
  for (const Vector& end : ends) {
    const double near_m = nearest_within(returns, origin, end, angle + RangeImage::kSlack_rad);
    const double far_m = nearest_within(returns, origin, end, angle);
    at_least.add(origin, point_along(origin, end, near_m - margin_m), kResolution_m);
    if (far_m > margin_m)
      at_most.add(origin, point_along(origin, end, far_m - margin_m + 1e-6), kResolution_m);
  }
  int missing = 0;
  int extra = 0;
  const std::map<Voxel, VoxelEvidence> observed = observed_voxels(mapper.map());
  const auto is_free = [&](const Voxel& voxel) {
    const auto found = observed.find(voxel);
    return found != observed.end() && found->second.sigma[0] > 0.0F;
  };
  for (const Voxel& voxel : at_least.certain)
    missing += hits.count(voxel) == 0 && !is_free(voxel) ? 1 : 0;
  for (const auto& [voxel, evidence] : observed)
    extra += evidence.sigma[0] > 0.0F && at_most.possible.count(voxel) == 0 ? 1 : 0;
  CHECK(at_least.certain.size() > 300);
  CHECK(missing == 0);
  CHECK(extra == 0);
}

}  // namespace tessera::oracle
