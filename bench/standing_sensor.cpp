// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "standing_sensor.hpp"

#include <algorithm>
#include <numbers>

#include "scans/dataset_classes.hpp"
#include "simulator/assembly.hpp"
#include "simulator/label_noise.hpp"
#include "simulator/lidar.hpp"
#include "simulator/random.hpp"
#include "simulator/solid_tree.hpp"
#include "simulator/street_plan.hpp"

namespace tessera::bench {

namespace {

constexpr double kHalfStreet_m = 80.0;
constexpr double kLane_m = -1.75;

/// Upright bars, 3 cm deep and 1.5 m high, over `length_m` to both sides of a place.
void add_fence(std::vector<street::Primitive>& solids, const street::Ground& ground, double x,
               double y, double yaw, double length_m, double period_m, std::uint32_t object) {
  street::Assembly fence(solids, {{x, y, ground.height(x, y)}, yaw}, object);
  const int bars = static_cast<int>(length_m / period_m);
  for (int bar = -bars; bar <= bars; ++bar)
    fence.box({bar * period_m, 0.0, 0.0}, {0.25 * period_m, 0.015}, 1.5,
              street::surface_of(street::RawId::kFence));
}

}  // namespace

StandingScene standing_scene(const StandingOptions& options) {
  const street::Ground ground(options.seed, kHalfStreet_m);
  std::vector<street::Primitive> solids =
      street::lay_out_street(options.seed, ground, kHalfStreet_m);
  // Along the street, across it, and slanted to the lattice.
  add_fence(solids, ground, 0.0, 2.5, 0.0, 6.0, options.period_m, 1000001);
  add_fence(solids, ground, 14.0, kLane_m, 0.5 * std::numbers::pi, 3.0, options.period_m, 1000002);
  add_fence(solids, ground, -8.0, kLane_m, 1.1, 2.5, options.period_m, 1000003);
  const street::SolidTree tree(std::move(solids));
  const street::LidarModel model = street::lidar_64_beams();
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  const double step_rad = 2.0 * std::numbers::pi / model.azimuth_steps;

  StandingScene result;
  result.scene.classes = classes.table();
  for (int index = 0; index < options.scans; ++index) {
    const std::uint64_t noise = street::hash_of(options.seed, street::Stream::kBeam, 0, index);
    const double yaw = step_rad * (street::unit_of(noise) - 0.5);
    Eigen::Isometry3d T_street_sensor = Eigen::Isometry3d::Identity();
    T_street_sensor.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    T_street_sensor.translation() << 0.0, kLane_m, ground.road_height(0.0) + model.height_m;
    const street::EchoImage image = street::sweep(
        model, T_street_sensor,
        [&](const street::Ray& ray, street::Hit& hit) {
          ground.meet(ray, hit);
          tree.meet(ray, hit);
        },
        noise);
    const auto said = street::predict_labels(options.seed, {0, 0.0, index}, image);
    Scan scan;
    scan.T_map_sensor = T_street_sensor.matrix().topRows<3>();
    result.ids.emplace_back();
    for (std::size_t i = 0; i < image.echoes.size(); ++i) {
      const street::Echo& echo = image.echoes[i];
      if (!echo.returned()) continue;
      const auto id = static_cast<std::uint16_t>(echo.id);
      for (int axis = 0; axis < 3; ++axis)
        scan.points_xyzi.push_back(static_cast<float>(echo.p_sensor[axis]));
      scan.points_xyzi.push_back(echo.intensity);
      scan.components.push_back(classes.component(options.true_labels ? id : said[i]));
      result.ids.back().push_back(id);
    }
    result.scene.max_points = std::max(result.scene.max_points, scan.components.size());
    result.scene.scans.push_back(std::move(scan));
  }
  return result;
}

}  // namespace tessera::bench
