// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "teammate_scenes.hpp"

#include <cstdio>

#include "harness.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/inference/internal/teammate_filter.hpp"
#include "thread_time.hpp"

namespace tessera::bench {

namespace {

constexpr double kResolution_m = 0.1;
constexpr float kRange_m = 40.0F;
constexpr std::uint32_t kMovingCar = 252;

Matrix34d matrix_of(const Eigen::Isometry3d& T) { return T.matrix().topRows<3>(); }

}  // namespace

ScanView StreetScan::view() const {
  return {.T_map_sensor = T_map_sensor,
          .points = xyz.data(),
          .stride_floats = 3,
          .count = components.size(),
          .components = components.data()};
}

ClassTable street_classes() {
  ClassTable classes;
  static_cast<void>(classes.add("thing", {200, 200, 200}));
  return classes;
}

/// None has the sensor in it; around all is one that has.
RobotBody street_body() {
  RobotBody body;
  body.boxes[body.count++] = {{-2.8F, -1.1F, -2.0F}, {2.8F, 1.1F, -0.1F}};
  body.boxes[body.count++] = {{-2.8F, -1.1F, -0.1F}, {-0.2F, 1.1F, 0.5F}};
  body.boxes[body.count++] = {{0.2F, -1.1F, -0.1F}, {2.8F, 1.1F, 0.5F}};
  return body;
}

RobotConfig street_robot(std::uint32_t number, bool has_body) {
  RobotConfig config;
  config.map.resolution_m = kResolution_m;
  config.map.storage_bytes = std::size_t{96} << 20U;
  config.inference.max_range_m = kRange_m;
  config.inference.free_space.carving = Carving::kImage;
  if (has_body) config.inference.body = street_body();
  config.scan.points = 140'000;
  config.exchange.robot = number;
  config.exchange.resolution_m = kResolution_m;
  config.exchange.peers = 16;
  config.global.map.resolution_m = kResolution_m;
  config.global.map.storage_bytes = std::size_t{1} << 20U;
  config.global.replicas = {
      .segments = 1024, .blocks = 256, .contributions = 64, .robot_segments = 1024};
  config.global.blocks = 256;
  config.global.sum_segments = 1024;
  config.global.staged_bytes = std::size_t{1} << 20U;
  config.exchange.records = 256;
  return config;
}

std::vector<RobotScans> street_scans(const StreetSimulator& street, int robots, int scans) {
  std::vector<RobotScans> all(static_cast<std::size_t>(robots));
  const Lattice lattice(kResolution_m);
  for (int i = 0; i < robots; ++i) {
    RobotScans& of_robot = all[static_cast<std::size_t>(i)];
    of_robot.T_global_map = matrix_of(street.T_global_map(i));
    for (int k = 10; k > 0; --k)
      of_robot.T_map_before.push_back(matrix_of(street.T_map_sensor_at(i, -0.1 * k)));
    for (int k = 0; k < scans; ++k) {
      const SimulatedScan from = street.scan(i, k);
      StreetScan scan;
      scan.T_map_sensor = matrix_of(street.T_map_sensor(i, k));
      std::vector<PlacedBox> others;
      for (int other = 0; other < robots; ++other) {
        if (other == i) continue;
        const Matrix34d T_sensor_other = product(inverse(matrix_of(street.T_global_sensor(i, k))),
                                                 matrix_of(street.T_global_sensor(other, k)));
        others.push_back({inverse(T_sensor_other), *street_body().hull()});
      }
      for (std::size_t p = 0; p < from.points.size(); ++p) {
        const Point3d p_sensor{static_cast<double>(from.points[p][0]),
                               static_cast<double>(from.points[p][1]),
                               static_cast<double>(from.points[p][2])};
        bool is_on_other = false;
        for (const PlacedBox& other : others)
          is_on_other = is_on_other || (from.labels[p] == kMovingCar &&
                                        other.box.holds(apply(other.T_box_map, p_sensor)));
        if (is_on_other) scan.on_others.push_back(scan.components.size());
        for (std::size_t axis = 0; axis < 3; ++axis) scan.xyz.push_back(from.points[p][axis]);
        scan.components.push_back(1);
        if (is_on_other || norm(p_sensor) > static_cast<double>(kRange_m)) continue;
        const Result<VoxelCoord> voxel =
            lattice.voxel_of(transform(scan.T_map_sensor, from.points[p].data()));
        if (voxel.ok()) of_robot.others.insert({voxel->x, voxel->y, voxel->z});
      }
      of_robot.scans.push_back(std::move(scan));
    }
  }
  return all;
}

double compare_ms(const StreetScan& scan, std::span<const PlacedBox> boxes) {
  std::vector<Point3f> points;
  for (std::size_t p = 0; p < scan.components.size(); ++p)
    points.push_back(transform(scan.T_map_sensor, scan.xyz.data() + 3 * p));
  std::vector<double> times;
  std::size_t met = 0;
  for (int run = 0; run < 21; ++run) {
    const double before = thread_cpu_ms();
    const TeammateFilter filter(boxes, scan.T_map_sensor.col(3));
    for (const Point3f& p : points) met += filter.share_before(p) ? 1U : 0U;
    times.push_back(thread_cpu_ms() - before);
  }
  std::printf("(%zu returns met)\n", met / times.size());
  return median(times);
}

}  // namespace tessera::bench
