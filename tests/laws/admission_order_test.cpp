// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which points a scan that does not fit keeps: near before far, sparse before dense.
#include "tessera/inference/internal/admission_order.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

using Cell = std::array<int, 3>;

constexpr double kResolution_m = 0.1;

Cell cell_of(const Point3f& p_map, double edge_m) {
  const auto axis = [&](float v) {
    return static_cast<int>(std::floor(static_cast<double>(v) / edge_m));
  };
  return {axis(p_map.x()), axis(p_map.y()), axis(p_map.z())};
}

/// The nearest point of each cell; of equally near ones the first.
std::map<Cell, std::size_t> nearest_of_cells(std::span<const ScanPoint> points, double edge_m) {
  std::map<Cell, std::size_t> nearest;
  const auto square = [&](std::size_t i) {
    return static_cast<float>(points[i].p_map.cast<double>().squaredNorm());
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [at, is_new] = nearest.emplace(cell_of(points[i].p_map, edge_m), i);
    if (!is_new && square(i) < square(at->second)) at->second = i;
  }
  return nearest;
}

/// By definition, from cells found one by one. The sensor is at the origin.
std::vector<double> effective_distances(std::span<const ScanPoint> points, int unit_edge) {
  std::vector<double> effective;
  for (const ScanPoint& point : points) effective.push_back(point.p_map.cast<double>().norm());
  const std::vector<double> distance = effective;
  const double unit_m = unit_edge * kResolution_m;
  for (const auto& [cell, i] : nearest_of_cells(points, unit_m)) effective[i] = distance[i] / 4.0;
  for (const auto& [cell, i] : nearest_of_cells(points, 4 * unit_m))
    effective[i] = distance[i] / 16.0;
  return effective;
}

InferenceConfig config_of(InferenceMode mode, int edge, bool free_space) {
  InferenceConfig config;
  config.mode = mode;
  config.entropy.block_edge = edge;
  config.free_space.enabled = free_space;
  config.free_space.carving = Carving::kRays;
  config.kernel_length_m = 0.27F;
  config.min_range_m = 0.05F;
  config.thinning_m = 0.0;
  return config;
}

struct Setting {
  InferenceMode mode = InferenceMode::kCounting;
  int edge = 2;
  std::uint64_t budget = 0;
};
const std::vector<Setting> kSettings{{InferenceMode::kCounting, 2, 100},
                                     {InferenceMode::kKernel, 2, 8000},
                                     {InferenceMode::kMultiEntropy, 1, 800},
                                     {InferenceMode::kMultiEntropy, 2, 8000},
                                     {InferenceMode::kMultiEntropy, 4, 8000}};

/// One turn of a lidar 1.7 m above a street: ground, a wall with gaps on each side, cars along it.
Cloud street_scan() {
  Cloud cloud;
  constexpr int kRings = 64;
  constexpr int kColumns = 720;
  constexpr double kGround_m = -1.7;
  for (int ring = 0; ring < kRings; ++ring) {
    const double elevation = (-24.8 + 26.8 * ring / (kRings - 1)) * std::numbers::pi / 180.0;
    for (int column = 0; column < kColumns; ++column) {
      const double azimuth = 2.0 * std::numbers::pi * (column + 0.5) / kColumns;
      const Point3d u(std::cos(elevation) * std::cos(azimuth),
                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      double range = u.z() < 0.0 ? kGround_m / u.z() : 1e9;
      int label = 1;
      const auto face = [&](double side_m, double height_m, double period_m, double filled_m,
                            int component) {
        const double t = side_m / u.y();
        if (!(t > 0.0) || t >= range) return;
        const double along = t * u.x() - period_m * std::floor(t * u.x() / period_m);
        if (along > filled_m || t * u.z() > kGround_m + height_m) return;
        range = t;
        label = component;
      };
      face(8.5, 7.0, 15.0, 12.0, 2);
      face(-7.0, 9.0, 20.0, 18.0, 2);
      face(5.0, 1.5, 7.0, 4.2, 3);
      face(-4.5, 1.5, 9.0, 4.2, 3);
      if (range < 70.0)
        cloud.add(range * u.x() + 0.013, range * u.y() + 0.017, range * u.z(), label);
    }
  }
  return cloud;
}

Cloud cloud_of(std::span<const ScanPoint> points, const std::vector<std::size_t>& chosen) {
  Cloud cloud;
  for (const std::size_t i : chosen) {
    const Point3d p = points[i].p_map.cast<double>();
    cloud.add(p.x(), p.y(), p.z(), points[i].component, static_cast<double>(points[i].weight));
  }
  return cloud;
}

/// What of a scene is in a map.
struct Kept {
  std::size_t near_voxels = 0;  ///< Labelled or occupied within 10 m of the sensor.
  std::size_t area = 0;         ///< Cells of 0.8 m with such a voxel, anywhere.
};

Kept kept_in(const LocalMap& map) {
  Kept kept;
  std::set<Cell> cells;
  for (const auto& [voxel, evidence] : observed_voxels(map)) {
    const Point3d centre = kResolution_m * Point3d(static_cast<double>(voxel[0]) + 0.5,
                                                   static_cast<double>(voxel[1]) + 0.5,
                                                   static_cast<double>(voxel[2]) + 0.5);
    cells.insert(cell_of(centre.cast<float>(), 0.8));
    if (centre.norm() <= 10.0) ++kept.near_voxels;
  }
  kept.area = cells.size();
  return kept;
}

}  // namespace

TEST_CASE("admission: under a work budget the effectively nearest points are admitted") {
  const std::size_t which = GENERATE(range<std::size_t>(0, 5));
  const bool free_space = GENERATE(false, true);
  const std::uint64_t seed = GENERATE(6001U, 6002U, 6003U);
  const Setting& setting = kSettings[which];
  CAPTURE(which, free_space, seed);
  InferenceConfig config = config_of(setting.mode, setting.edge, free_space);
  Random random(announce_seed(seed));
  const Cloud cloud = random_cloud(random, {.points = 400, .classes = 5});
  Mapper whole(uncapped_map(kResolution_m), config, 5);
  REQUIRE(whole.integrate(cloud).left_out() == 0);
  const std::span<const ScanPoint> points = whole.integrator().admitted();
  const std::vector<double> effective = effective_distances(points, setting.edge);
  config.work_budget = setting.budget + (free_space ? 3000U : 0U);
  Mapper mapper(uncapped_map(kResolution_m), config, 5);
  const ScanReport report = mapper.integrate(cloud);
  CHECK(report.refused_memory() == 0);
  REQUIRE(report.refused_work > 0);
  REQUIRE(report.admitted > 0);
  // Admitted points keep their order, so the two lists are walked side by side.
  double farthest = 0.0;
  double nearest_refused = 1e9;
  std::size_t next = 0;
  const std::span<const ScanPoint> admitted = mapper.integrator().admitted();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool taken = next < admitted.size() && admitted[next].p_map == points[i].p_map &&
                       admitted[next].component == points[i].component;
    if (taken) {
      farthest = std::max(farthest, effective[i]);
      ++next;
    } else {
      nearest_refused = std::min(nearest_refused, effective[i]);
    }
  }
  REQUIRE(next == admitted.size());
  CHECK(farthest <= nearest_refused * (1.0 + 1e-6));
}

TEST_CASE("admission order: every number once, rays among points by their own distance") {
  const Lattice lattice(kResolution_m);
  const std::array<ScanPoint, 4> points{
      *place_point(lattice, {8.0F, 0.05F, 0.05F}), *place_point(lattice, {8.15F, 0.05F, 0.05F}),
      *place_point(lattice, {3.0F, 0.05F, 0.05F}), *place_point(lattice, {8.25F, 0.05F, 0.05F})};
  const std::array<ScanPoint, 2> rays{*place_point(lattice, {-5.0F, 0.0F, 0.0F}),
                                      *place_point(lattice, {0.0F, 1.0F, 0.0F})};
  std::array<KeyedIndex, 12> sort{};
  const std::span<const KeyedIndex> order =
      order_of_admission({points, rays, Point3d::Zero(), {}, 2, true}, sort);
  // Effective distances: 0.5, 8.15 (the first is in its unit), 0.19, 2.06, and the rays' 5 and 1.
  std::vector<std::uint32_t> numbers;
  for (const KeyedIndex& item : order) numbers.push_back(item.index);
  CHECK(numbers == std::vector<std::uint32_t>{2, 0, 5, 3, 4, 1});
  numbers.clear();
  for (const KeyedIndex& item :
       order_of_admission({points, rays, Point3d::Zero(), {}, 2, false}, sort))
    numbers.push_back(item.index);
  CHECK(numbers == std::vector<std::uint32_t>{5, 2, 4, 0, 1, 3});
}

TEST_CASE("admission order: nothing to order") {
  CHECK(order_of_admission({{}, {}, Point3d::Zero(), {}, 2, true}, {}).empty());
}

TEST_CASE("admission: a quarter of a street's budget keeps more than nearest first or sampling") {
  InferenceConfig config = config_of(InferenceMode::kMultiEntropy, 2, false);
  config.max_range_m = 0.0F;
  config.thinning_m = kResolution_m;
  MapConfig map = uncapped_map(kResolution_m);
  map.storage_bytes = std::size_t{64} << 20U;
  const ScanCapacity capacity{.points = 50000, .tiles = 65536, .ray_blocks = 16};
  Mapper whole(map, config, 3, capacity);
  const ScanReport all = whole.integrate(street_scan());
  REQUIRE(all.left_out() == 0);
  const std::span<const ScanPoint> points = whole.integrator().admitted();
  constexpr std::uint64_t kPerPoint = 7 * 8;
  config.work_budget = kPerPoint * points.size() / 4;
  Mapper mapper(map, config, 3, capacity);
  const ScanReport report = mapper.integrate(street_scan());
  REQUIRE(report.admitted == points.size() / 4);

  config.work_budget = 0;
  config.thinning_m = 0.0;
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return points[a].p_map.squaredNorm() < points[b].p_map.squaredNorm();
  });
  order.resize(report.admitted);
  Mapper nearest_first(map, config, 3, capacity);
  REQUIRE(nearest_first.integrate(cloud_of(points, order)).left_out() == 0);
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = 4 * i;
  Mapper sampled(map, config, 3, capacity);
  REQUIRE(sampled.integrate(cloud_of(points, order)).left_out() == 0);

  const Kept complete = kept_in(whole.map());
  const Kept ours = kept_in(mapper.map());
  const Kept nearest = kept_in(nearest_first.map());
  const Kept uniform = kept_in(sampled.map());
  CAPTURE(complete.near_voxels, ours.near_voxels, nearest.near_voxels, uniform.near_voxels);
  CAPTURE(complete.area, ours.area, nearest.area, uniform.area);
  CHECK(static_cast<double>(ours.near_voxels) > 2.0 * static_cast<double>(nearest.near_voxels));
  CHECK(static_cast<double>(ours.near_voxels) > 1.02 * static_cast<double>(uniform.near_voxels));
  CHECK(static_cast<double>(ours.area) > 4.0 * static_cast<double>(nearest.area));
  CHECK(static_cast<double>(ours.area) > 1.02 * static_cast<double>(uniform.area));
}

}  // namespace tessera::oracle
