// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Directions from which nothing came back: how far they free space, and what they leave.
#include <catch2/catch.hpp>
#include <limits>

#include "laws/image_scenes.hpp"

namespace tessera::oracle {
namespace {

constexpr ScanCapacity kCapacity{.points = 120000, .tiles = 16384, .ray_blocks = 60000};

InferenceConfig clearing(Carving carving, double no_return_m, double max_range_m = 20.0) {
  InferenceConfig config = by_image(max_range_m);
  config.free_space.carving = carving;
  config.no_return_range_m = static_cast<float>(no_return_m);
  return config;
}

/// A scan with a direction for each place where the scene has none, length metres long.
struct Measured {
  Cloud cloud;
  std::vector<std::uint8_t> no_return;
  [[nodiscard]] ScanView view(const Matrix34d& T = Matrix34d::Identity()) const {
    ScanView view = cloud.view(T);
    view.no_return = no_return.data();
    return view;
  }
};
Measured measured(const Scene& scene, double length_m = 1.0) {
  Measured scan;
  const Scene always = [&](double a, double e) {
    const double range_m = scene(a, e);
    scan.no_return.push_back(range_m > 0.0 ? 0 : 1);
    return range_m > 0.0 ? range_m : length_m;
  };
  scan.cloud = scan_of(always, -10.0, 10.0, 0.5, 0.3);
  return scan;
}
double nothing(double /*a*/, double /*e*/) { return 0.0; }
/// A wall 5 m ahead that every third column misses, and every fourth row.
double torn_wall(double a, double e) {
  if (std::abs(a) > 1.0) return 0.0;
  const auto column = static_cast<int>(std::lround(a / (0.3 * kRadians)));
  const auto row = static_cast<int>(std::lround(e / (0.5 * kRadians)));
  return column % 3 == 0 || row % 4 == 0 ? 0.0 : 5.0 / (std::cos(a) * std::cos(e));
}

ScanReport integrate(Mapper& mapper, const ScanView& view) {
  return mapper.integrator().integrate(mapper.map(), view);
}

}  // namespace

TEST_CASE("no return: off, they are counted and the map is that of the returns alone") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const Measured scan = measured(torn_wall);
  Cloud returns;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    const auto at = [&](std::size_t axis) {
      return static_cast<double>(scan.cloud.xyz[3 * i + axis]);
    };
    if (scan.no_return[i] == 0) returns.add(at(0), at(1), at(2), 1);
  }
  Mapper mapper(uncapped_map(0.1), clearing(carving, 0.0), 5, kCapacity);
  Mapper bare(uncapped_map(0.1), clearing(carving, 0.0), 5, kCapacity);
  const ScanReport report = integrate(mapper, scan.view());
  static_cast<void>(bare.integrate(returns));
  CHECK(report.no_return == scan.cloud.size() - returns.size());
  CHECK(report.in_range == returns.size());
  CHECK(same_content(mapper.map(), bare.map()));
}

TEST_CASE("no return: space is free up to the stated range and unknown behind it") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const double max_range_m = GENERATE(20.0, 0.0);
  const double length_m = GENERATE(1e-3, 1.0, 1e6);
  const Measured scan = measured(nothing, length_m);
  Mapper mapper(uncapped_map(0.2), clearing(carving, 8.0, max_range_m), 5, kCapacity);
  const ScanReport report = integrate(mapper, scan.view(pose_at({0.1, 0.1, 0.1})));
  CHECK(report.no_return == scan.cloud.size());
  CHECK(report.in_range == 0);
  CHECK(report.rays == scan.cloud.size());
  for (const auto& [x, y] : {std::pair{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.6, -0.8}}) {
    CAPTURE(x, y);
    for (double at = 2.0; at < 7.0; at += 0.5)
      CHECK(is_free(mapper, {0.1 + at * x, 0.1 + at * y, 0.1}));
    for (double at = 8.5; at < 20.0; at += 0.5)
      CHECK_FALSE(is_free(mapper, {0.1 + at * x, 0.1 + at * y, 0.1}));
  }
  CHECK(mapper.map().usage().label_voxels == 0);
}

TEST_CASE("no return: the range limit is theirs too, as of a return beyond it") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const double no_return_m = GENERATE(20.0, 50.0, 1e6);
  const Measured scan = measured(nothing, 90.0);
  const InferenceConfig config = clearing(carving, no_return_m);
  Mapper mapper(uncapped_map(0.2), config, 5, kCapacity);
  Mapper beyond(uncapped_map(0.2), config, 5, kCapacity);
  CHECK(integrate(mapper, scan.view()).no_return == scan.cloud.size());
  CHECK(beyond.integrate(scan.cloud).beyond_range == scan.cloud.size());
  // The last bits of where a ray ends may differ, so nothing is said of where it ends.
  std::size_t differ = 0;
  const auto others = observed_voxels(beyond.map());
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map()))
    differ += others.contains(voxel) ? 0U : 1U;
  CHECK(others.size() > 50000);
  CHECK(differ < others.size() / 1000);
}

TEST_CASE("no return: a wall that many rays do not come back from stays whole") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  Mapper mapper(uncapped_map(0.1), clearing(carving, 15.0), 5, kCapacity);
  const Measured scan = measured(torn_wall);
  for (int i = 0; i < 30; ++i)
    static_cast<void>(integrate(mapper, scan.view(pose_at({0.05, 0.05, 0.05}))));
  std::size_t hits = 0;
  std::size_t freed = 0;
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    if (evidence.sigma[1] <= 0.0F) continue;
    ++hits;
    freed += evidence.sigma[0] > 0.0F ? 1U : 0U;
  }
  CHECK(hits > 200);
  CHECK(freed == 0);
  // Nor is anything freed behind it; where there is no wall, much is.
  for (double y = -3.0; y < 3.0; y += 0.1) CHECK_FALSE(is_free(mapper, {7.05, y, 0.05}));
  CHECK(is_free(mapper, {-7.05, 0.05, 0.05}));
}

TEST_CASE("no return: far returns behind the stated range are still hits") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const Scene half = [](double a, double) { return a > 0.0 ? 16.0 : 0.0; };
  Mapper mapper(uncapped_map(0.2), clearing(carving, 6.0), 5, kCapacity);
  const Measured scan = measured(half);
  const ScanReport report = integrate(mapper, scan.view(pose_at({0.1, 0.1, 0.1})));
  CHECK(report.in_range + report.no_return == report.points);
  CHECK(is_free(mapper, {0.1, 12.1, 0.1}));
  CHECK(is_free(mapper, {0.1, -5.1, 0.1}));
  CHECK_FALSE(is_free(mapper, {0.1, -7.1, 0.1}));
}

TEST_CASE("no return: a direction that is none is refused and counted") {
  const double no_return_m = GENERATE(0.0, 10.0);
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  Cloud cloud;
  for (const double bad : {nan, -nan, infinity, -infinity}) {
    cloud.add(bad, 0, 1, 1);
    cloud.add(1, bad, 0, 1);
    cloud.add(0, 1, bad, 1);
  }
  cloud.add(0, -0.0, 0, 1);
  const auto bad = static_cast<std::uint32_t>(cloud.size());
  const auto largest = static_cast<double>(std::numeric_limits<float>::max());
  cloud.add(largest, -largest, largest, 1);
  cloud.add(1e-45, 0, 0, 1);
  cloud.add(0, 0, 0.3, 1);  // As near as it likes.
  const std::vector<std::uint8_t> flags(cloud.size(), 255);
  const std::vector<float> weights(cloud.size(), std::numeric_limits<float>::quiet_NaN());
  ScanView view = cloud.view(pose_at({0.05, 0.05, 0.05}));
  view.no_return = flags.data();
  view.weights = weights.data();
  Mapper mapper(uncapped_map(0.1), clearing(carving, no_return_m), 5, kCapacity);
  const ScanReport report = integrate(mapper, view);
  CHECK(report.pose == Status::kOk);
  CHECK(report.non_finite == bad);
  CHECK(report.no_return == 3);
  CHECK(report.rays == (no_return_m > 0.0 ? 3U : 0U));
  CHECK(report.points == report.non_finite + report.no_return);
  CHECK(observed_voxels(mapper.map()).empty() == (no_return_m == 0.0));
}

TEST_CASE("no return: a range that is none is refused") {
  AlignedMemory memory(Integrator::required_bytes(test_capacity(), InferenceConfig{}));
  const auto made = [&](float no_return_m, float min_m) {
    InferenceConfig config;
    config.no_return_range_m = no_return_m;
    config.min_range_m = min_m;
    Arena arena = memory.arena();
    return Integrator::make(arena, config, test_capacity()).ok();
  };
  CHECK(made(0.0F, 0.5F));
  CHECK(made(0.5F, 0.5F));
  CHECK(made(1e6F, 0.5F));
  for (const float bad : {-1.0F, 0.49F, 1.1e6F, std::numeric_limits<float>::infinity(),
                          std::numeric_limits<float>::quiet_NaN()})
    CHECK_FALSE(made(bad, 0.5F));
}

}  // namespace tessera::oracle
