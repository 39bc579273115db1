// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the neighbour rule of carving is for, in scenes driven past: what is thin or grazed stays,
// and what has left still fades.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <iostream>
#include <set>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

constexpr double kResolution_m = 0.1;
constexpr double kPi = 3.14159265358979;

/// Most of a voxel's height is above the ground, so a ray that grazes it crosses many voxels of the
/// ground's own layer before its hit.
constexpr double kGround_m = -1.79;

/// What a ray from the sensor at x_sensor meets first: its range, and its label.
struct Meets {
  double range_m = 1e9;
  int label = 0;
};

using Things = std::function<void(double x_sensor, const Eigen::Vector3d& u, Meets& meets)>;

/// A fence of round bars of 3 cm, 16 cm apart, along y at 9 m.
void meet_fence(double x_sensor, const Eigen::Vector3d& u, Meets& meets) {
  for (int i = -25; i <= 25; ++i) {
    const Eigen::Vector2d bar(9.05 - x_sensor, 0.16 * i);
    const Eigen::Vector2d way(u.x(), u.y());
    const double along = bar.dot(way) / way.squaredNorm();
    if (along <= 0.0 || (along * way - bar).norm() > 0.015) continue;
    if (along < meets.range_m && along * u.z() < 0.4) meets = {along, 2};
  }
}

/// One turn of a spinning sensor over flat ground and what else is there.
Cloud turn(double x_sensor, Random& random, const Things& things) {
  Cloud cloud;
  constexpr int kBeams = 48;
  constexpr int kSteps = 720;
  for (int beam = 0; beam < kBeams; ++beam) {
    const double elevation = (-22.0 + 22.0 * beam / (kBeams - 1)) * kPi / 180.0;
    for (int i = 0; i < kSteps; ++i) {
      const double azimuth = 2.0 * kPi * (i + random.uniform()) / kSteps;
      const Eigen::Vector3d u(std::cos(elevation) * std::cos(azimuth),
                              std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      Meets meets;
      if (u.z() < 0.0) meets = {kGround_m / u.z(), 1};
      things(x_sensor, u, meets);
      if (meets.range_m > 35.0) continue;
      const Eigen::Vector3d p = (meets.range_m + random.uniform(-0.01, 0.01)) * u;
      cloud.add(p.x(), p.y(), p.z(), meets.label);
    }
  }
  return cloud;
}

Matrix34d pose_at(double x_sensor) {
  Matrix34d T = Matrix34d::Identity();
  T(0, 3) = x_sensor;
  return T;
}

Voxel voxel_of(const ScanPoint& point) {
  const Point3d p = point.p_map.cast<double>();
  return cell_of({p.x(), p.y(), p.z()}, kResolution_m);
}

Mapper street_mapper(const FreeSpaceConfig& free_space) {
  MapConfig map_config;
  map_config.storage_bytes = std::size_t{256} << 20U;
  InferenceConfig config;
  config.mode = InferenceMode::kCounting;
  config.free_space = free_space;
  config.free_space.carving = Carving::kRays;
  return Mapper(map_config, config, 5, {.points = 40000, .tiles = 40000, .ray_blocks = 131072});
}

/// The voxels that hold an admitted point of the label, over scans moving along x; each scan is
/// integrated.
std::set<Voxel> drive(Mapper& mapper, int scans, Random& random, int label, const Things& things) {
  std::set<Voxel> hits;
  for (int scan = 0; scan < scans; ++scan) {
    const double x_sensor = 0.11 * scan;
    const ScanReport report = mapper.integrate(turn(x_sensor, random, things), pose_at(x_sensor));
    REQUIRE(report.left_out() == 0);
    for (const ScanPoint& point : mapper.integrator().admitted()) {
      if (point.component == label) hits.insert(voxel_of(point));
    }
  }
  return hits;
}

double share(const Mapper& mapper, const std::set<Voxel>& voxels, VoxelState state) {
  std::size_t n = 0;
  for (const Voxel& v : voxels) {
    const VoxelCoord at{static_cast<int>(v[0]), static_cast<int>(v[1]), static_cast<int>(v[2])};
    n += mapper.map().query(at).state == state ? 1U : 0U;
  }
  return static_cast<double>(n) / static_cast<double>(voxels.size());
}

}  // namespace

TEST_CASE("neighbour rule: a fence and grazed ground stay with it, and are holed without it") {
  const int label = GENERATE(1, 2);
  CAPTURE(label);
  std::array<double, 2> stays{};
  for (const bool with_rule : {false, true}) {
    FreeSpaceConfig free_space;
    if (!with_rule) free_space.neighbour_angle_rad = 0.0F;
    Mapper mapper = street_mapper(free_space);
    Random random(45);
    const std::set<Voxel> hits = drive(mapper, 12, random, label, meet_fence);
    REQUIRE(hits.size() > 500);
    stays[with_rule ? 1 : 0] = share(mapper, hits, VoxelState::kOccupied);
  }
  std::cout << "label " << label << ": " << stays[1] << " of the voxels stay with the rule, "
            << stays[0] << " without\n";
  CHECK(stays[1] >= 0.99);
  CHECK(stays[0] < 0.9);
}

namespace {

/// A wall at 30 m, and before it an upright plate of the width, 1.5 m high, if there is one.
Things plate_before_wall(double x_plate, double width_m) {
  return [=](double x_sensor, const Eigen::Vector3d& u, Meets& meets) {
    if (u.x() <= 0.0) return;
    const double to_wall_m = (30.05 - x_sensor) / u.x();
    if (to_wall_m < meets.range_m && to_wall_m * u.z() < 2.0) meets = {to_wall_m, 2};
    const double to_plate_m = (x_plate - x_sensor) / u.x();
    if (to_plate_m < meets.range_m && std::abs(to_plate_m * u.y()) < 0.5 * width_m &&
        to_plate_m * u.z() < kGround_m + 1.5)
      meets = {to_plate_m, 3};
  };
}

/// The part of the plate as mapped in 10 scans, above the lowest off_ground_m, that is free after
/// 30 more without it.
double faded(const FreeSpaceConfig& free_space, double x_plate, double width_m,
             double off_ground_m) {
  Mapper mapper = street_mapper(free_space);
  Random random(46);
  std::set<Voxel> hits = drive(mapper, 10, random, 3, plate_before_wall(x_plate, width_m));
  std::erase_if(hits, [&](const Voxel& v) {
    return static_cast<double>(v[2]) * kResolution_m < kGround_m + off_ground_m ||
           share(mapper, {v}, VoxelState::kOccupied) < 1.0;
  });
  REQUIRE(hits.size() > 20);
  drive(mapper, 30, random, 3, plate_before_wall(x_plate, 0.0));
  return share(mapper, hits, VoxelState::kFree);
}

}  // namespace

TEST_CASE("neighbour rule: a car and a person that have left fade with it as they do without") {
  const bool car = GENERATE(true, false);
  CAPTURE(car);
  const double with_rule = car ? faded({}, 9.05, 1.8, 0.2) : faded({}, 15.05, 0.5, 0.5);
  const FreeSpaceConfig own_only{.neighbour_angle_rad = 0.0F};
  const double without = car ? faded(own_only, 9.05, 1.8, 0.2) : faded(own_only, 15.05, 0.5, 0.5);
  std::cout << with_rule << " fades with the rule, " << without << " without\n";
  CHECK(without > 0.8);
  CHECK(with_rule >= 0.95 * without);
}

}  // namespace tessera::oracle
