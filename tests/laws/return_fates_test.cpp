// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Each return of a scan is classified once, and what is reported as admitted is in the map: returns
// that drivers give for "no return", and hits that lie exactly on borders of blocks.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

constexpr auto kLargest = static_cast<double>(std::numeric_limits<float>::max());

/// A turn about an axis that is none of the grid's, so that a large coordinate overflows a float.
Matrix34d turned_pose() {
  const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 2.0, 3.0).normalized();
  Matrix34d T = Matrix34d::Identity();
  T.leftCols<3>() = Eigen::AngleAxisd(0.7, axis).toRotationMatrix();
  T.col(3) = Eigen::Vector3d(0.31, -0.17, 1.7);
  return T;
}

/// Returns beyond the range, all around the sensor.
Cloud far_returns(int beams, int turn) {
  Cloud cloud;
  for (int beam = 0; beam < beams; ++beam) {
    const double elevation = 0.5 * (beam + 0.5) / beams - 0.25;
    for (int i = 0; i < turn; ++i) {
      const double azimuth = 6.283185307179586 * (i + 0.3) / turn;
      cloud.add(60.0 * std::cos(azimuth), 60.0 * std::sin(azimuth), 60.0 * elevation, 1);
    }
  }
  return cloud;
}

std::uint32_t returns_counted(const ScanReport& report) {
  return report.non_finite + report.too_near + report.on_body + report.on_teammate +
         report.no_return + report.beyond_range + report.out_of_grid + report.over_capacity +
         report.in_range + report.returns_cut;
}

std::uint32_t points_counted(const ScanReport& report) {
  return report.admitted + report.refused_storage + report.refused_tiles +
         report.refused_ray_blocks + report.refused_work + report.refused_deadline;
}

/// Admitted points whose voxel has no label evidence.
std::size_t not_in_map(const Mapper& mapper) {
  std::size_t missing = 0;
  for (const ScanPoint& point : mapper.integrator().admitted()) {
    const VoxelEvidence evidence = mapper.map().evidence(point.p_map);
    float labels = 0.0F;
    for (std::size_t l = 1; l < evidence.sigma.size(); ++l) labels += evidence.sigma[l];
    missing += labels > 0.0F ? 0U : 1U;
  }
  return missing;
}

/// Counts, unthinned, to 100 m.
InferenceConfig counting_config() {
  InferenceConfig config;
  config.mode = InferenceMode::kCounting;
  config.max_range_m = 100.0F;
  config.thinning_m = 0.0;
  return config;
}

/// A sensor on no border.
Matrix34d shifted_pose() {
  Matrix34d T = Matrix34d::Identity();
  T.col(3) = Eigen::Vector3d(0.1, 0.3, 0.7);
  return T;
}

}  // namespace

TEST_CASE("returns: the largest float among far returns changes nothing of what they free") {
  // With thinning, where a place that is no number mixes up all cells; and one by one.
  const double thinning_m = GENERATE(0.1, 0.0);
  const std::uint32_t ray_blocks = GENERATE(30000U, 3000U);
  InferenceConfig config;
  config.thinning_m = thinning_m;
  const ScanCapacity capacity{.points = 20000, .tiles = 8192, .ray_blocks = ray_blocks};
  const Cloud real = far_returns(4, 60);
  CAPTURE(thinning_m, ray_blocks);
  Mapper reference(uncapped_map(0.1), config, 5, capacity);
  const ScanReport expected = reference.integrate(real, turned_pose());
  REQUIRE(expected.rays > 20);
  for (const auto& [x, y, z] : std::vector<std::array<double, 3>>{{kLargest, kLargest, kLargest},
                                                                  {kLargest, 0, 0},
                                                                  {-kLargest, kLargest, 1},
                                                                  {1e30, 0, 0}}) {
    for (const bool is_first : {false, true}) {
      CAPTURE(x, y, z, is_first);
      Mapper mapper(uncapped_map(0.1), config, 5, capacity);
      Cloud cloud;
      if (is_first) cloud.add(x, y, z, 1);
      for (std::size_t i = 0; i < real.size(); ++i)
        cloud.add(static_cast<double>(real.xyz[3 * i]), static_cast<double>(real.xyz[3 * i + 1]),
                  static_cast<double>(real.xyz[3 * i + 2]), 1);
      if (!is_first) cloud.add(x, y, z, 1);
      const ScanReport report = mapper.integrate(cloud, turned_pose());
      CHECK(report.rays == expected.rays);
      CHECK(report.beyond_range == expected.beyond_range);
      CHECK(report.out_of_grid == 1);
      CHECK(returns_counted(report) == report.points);
      CHECK(same_content(mapper.map(), reference.map()));
    }
  }
}

TEST_CASE("returns: each is counted once") {
  InferenceConfig config;
  config.max_range_m = GENERATE(0.0F, 6.0F);
  config.free_space.enabled = GENERATE(false, true);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const std::array<double, 12> values{0.0, -0.0, 1e-45,    0.3,      2.5,  -7.0,
                                      1e6, -1e9, kLargest, infinity, -nan, nan};
  Cloud cloud;
  for (const double x : values) {
    for (const double y : values) {
      for (const double z : values) cloud.add(x, y, z, 1);
    }
  }
  Mapper mapper(uncapped_map(0.1), config, 5,
                {.points = GENERATE(1000U, 20000U), .tiles = 8192, .ray_blocks = 16384});
  const ScanReport report = mapper.integrate(cloud, turned_pose());
  REQUIRE(report.points == cloud.size());
  CHECK(returns_counted(report) == report.points);
  CHECK(points_counted(report) == report.thinned);
  CHECK(report.in_range > 0);
  CHECK(report.write_faults == 0);
}

TEST_CASE("hits on borders: one where blocks meet is in the map as soon as it is admitted") {
  // 0.5 m: multiples of a block's edge of 4 m are floats.
  const InferenceConfig config = counting_config();
  const Matrix34d T = shifted_pose();
  int admitted = 0;
  for (int y = 1; y < 9; ++y) {
    for (std::uint32_t ray_blocks = 8; ray_blocks < 24; ++ray_blocks) {
      CAPTURE(y, ray_blocks);
      Cloud cloud;
      cloud.add(39.9, 4.0 * y - 0.3, 3.3, 1);
      Mapper mapper(uncapped_map(0.5), config, 5,
                    {.points = 10, .tiles = 64, .ray_blocks = ray_blocks});
      const ScanReport report = mapper.integrate(cloud, T);
      admitted += static_cast<int>(report.admitted);
      CHECK(points_counted(report) == report.thinned);
      CHECK(not_in_map(mapper) == 0);
      CHECK(report.write_faults == 0);
    }
  }
  CHECK(admitted > 20);
}

TEST_CASE("hits on borders: a wall on the lattice, and scarce ray blocks") {
  const InferenceConfig config = counting_config();
  const Matrix34d T = shifted_pose();
  for (const double side : {-1.0, 1.0}) {
    Cloud wall;
    for (int y = -16; y <= 16; ++y) {
      for (int z = -8; z <= 8; ++z) wall.add(side * 20.0 - 0.1, 0.5 * y - 0.3, 0.5 * z - 0.7, 1);
    }
    for (std::uint32_t ray_blocks = 1; ray_blocks < 200; ++ray_blocks) {
      CAPTURE(side, ray_blocks);
      Mapper mapper(uncapped_map(0.5), config, 5,
                    {.points = 1000, .tiles = 256, .ray_blocks = ray_blocks});
      const ScanReport report = mapper.integrate(wall, T);
      REQUIRE(report.admitted == mapper.integrator().admitted().size());
      REQUIRE(points_counted(report) == report.thinned);
      REQUIRE(not_in_map(mapper) == 0);
      REQUIRE(report.write_faults == 0);
      if (report.admitted == report.thinned) break;
    }
  }
}

TEST_CASE("returns: a hit and a return beyond the range on the grid's lower face are kept") {
  // The grid is half open: its lower face is inside. Nothing is scarce, so nothing is refused.
  constexpr double kVoxel_m = 0.125;
  constexpr double kFace_m = -kVoxelLimit * kVoxel_m;
  const InferenceConfig config = [] {
    InferenceConfig made = counting_config();
    made.max_range_m = 7.0F;  // the length of (-2, 6, 3)
    made.free_space.neighbour_angle_rad = 0.0F;
    made.free_space.margin_voxels = 0.0F;
    return made;
  }();
  const bool is_far = GENERATE(false, true);
  Mapper mapper(uncapped_map(kVoxel_m), config, 5);
  std::uint32_t kept = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 200; ++i) {
      CAPTURE(is_far, axis, i);
      // A ray that ends on the face and on a border of voxels; far: at the range limit.
      Matrix34d T = Matrix34d::Identity();
      T(axis, 3) = kFace_m + (is_far ? 2.0 : 0.03125 * (1 + i));
      const int other = (axis + 1 + i % 2) % 3;
      const int last = 3 - axis - other;
      T(last, 3) = 0.03125 * i;
      Eigen::Vector3d p;
      p[axis] = kFace_m - T(axis, 3);
      p[other] = 6.0;
      p[last] = i % 3 == 0 ? -3.0 : 3.0;
      if (is_far) p *= 2.0;
      if (p.norm() >= 7.0 && !is_far) continue;
      Cloud cloud;
      cloud.add(p.x(), p.y(), p.z(), 1);
      const ScanReport report = mapper.integrate(cloud, T);
      CHECK(report.left_out() == 0);
      CHECK(report.beyond_range == (is_far ? 1U : 0U));
      CHECK(report.rays == 1);
      CHECK(not_in_map(mapper) == 0);
      kept += report.rays;
    }
  }
  CHECK(kept > 100);
}

}  // namespace tessera::oracle
