// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Other robots that say where they are: what returns on them must not do, with rays and with the
// image of the scan.
#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "laws/image_scenes.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/inference/internal/teammate_filter.hpp"

namespace tessera::oracle {
namespace {

const ScanCapacity kScanCapacity{.points = 60000, .tiles = 9000, .ray_blocks = 9000};

InferenceConfig config_of(Carving carving) {
  InferenceConfig config = by_image(20.0);
  config.free_space.carving = carving;
  return config;
}

/// A robot 4 m in front of the sensor, 1.6 m wide, before a wall all around.
double robot_and_wall(double azimuth_rad, double /*elevation_rad*/) {
  return std::abs(azimuth_rad) < 0.2 ? 4.0 / std::cos(azimuth_rad) : 10.0;
}
Cloud seen_by_sensor(const Scene& scene) { return scan_of(scene, -10.0, 10.0, 0.5, 0.3); }

/// Around it: from 3.8 m on.
PlacedBox box_at(const Point3d& low, const Point3d& high) {
  PlacedBox placed;
  for (int i = 0; i < 3; ++i) {
    placed.box.low[static_cast<std::size_t>(i)] = static_cast<float>(low[i]);
    placed.box.high[static_cast<std::size_t>(i)] = static_cast<float>(high[i]);
  }
  return placed;
}
const PlacedBox kRobot = box_at({3.8, -1.0, -1.0}, {6.0, 1.0, 1.0});

ScanReport integrate(Mapper& mapper, const Cloud& cloud, std::span<const PlacedBox> teammates,
                     const std::vector<std::uint8_t>& no_return = {}) {
  ScanView view = cloud.view(pose_at({0.05, 0.05, 0.05}));
  view.teammates = teammates;
  if (!no_return.empty()) view.no_return = no_return.data();
  return mapper.integrator().integrate(mapper.map(), view);
}

}  // namespace

TEST_CASE("teammates: what is met of one is in no map, and nothing in it or behind it is known") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const double thinning_m = GENERATE(0.0, 0.1);
  InferenceConfig config = config_of(carving);
  config.thinning_m = thinning_m;
  Mapper mapper(uncapped_map(0.1), config, 5, kScanCapacity);
  Mapper bare(uncapped_map(0.1), config, 5, kScanCapacity);
  const Cloud cloud = seen_by_sensor(robot_and_wall);
  const ScanReport report = integrate(mapper, cloud, {&kRobot, 1});
  const ScanReport expected = integrate(bare, cloud, {});
  CHECK(report.teammates == 1);
  CHECK(report.on_teammate > 1000);
  CHECK(report.on_teammate + report.in_range == expected.in_range);
  CHECK((expected.on_teammate == 0 && expected.teammates == 0));
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    const Point3d center =
        0.1 * Point3d(static_cast<double>(voxel[0]) + 0.5, static_cast<double>(voxel[1]) + 0.5,
                      static_cast<double>(voxel[2]) + 0.5);
    const bool is_ahead = center.x() > 0.0 && std::abs(center.y()) < 0.15 * center.x();
    if (!is_ahead || std::abs(center.z()) > 0.1 * center.x()) continue;
    CAPTURE(center.x(), center.y(), center.z());
    CHECK(center.x() <= 3.9);
    for (std::size_t i = 1; i < evidence.sigma.size(); ++i) CHECK(evidence.sigma[i] == 0.0F);
  }
  // What was seen before it is free, as beside it.
  CHECK(is_free(mapper, {2.05, 0.05, 0.05}));
  CHECK(is_free(mapper, {3.35, 0.05, 0.05}));
  CHECK(is_free(mapper, {0.05, 5.05, 0.05}));
  CHECK(bare.map().evidence(Point3f(4.05F, 0.05F, 0.05F)).sigma[1] > 0.0F);
}

TEST_CASE("teammates: where there is none, and where no return is on one, maps are as before") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const PlacedBox above = box_at({-20, -20, 5}, {20, 20, 9});
  const PlacedBox behind = box_at({11, -1, -1}, {13, 1, 1});
  const Cloud cloud = seen_by_sensor(robot_and_wall);
  Mapper none(uncapped_map(0.1), config_of(carving), 5, kScanCapacity);
  static_cast<void>(integrate(none, cloud, {}));
  for (const PlacedBox& box : {above, behind}) {
    Mapper mapper(uncapped_map(0.1), config_of(carving), 5, kScanCapacity);
    const ScanReport report = integrate(mapper, cloud, {&box, 1});
    CHECK((report.teammates == 1 && report.on_teammate == 0));
    CHECK(same_content(mapper.map(), none.map()));
  }
}

TEST_CASE(
    "teammates: what is in the map where one comes to stand is neither met nor contradicted") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  Mapper mapper(uncapped_map(0.1), config_of(carving), 5, kScanCapacity);
  const Cloud cloud = seen_by_sensor(robot_and_wall);
  static_cast<void>(integrate(mapper, cloud, {}));
  const Point3f met(4.05F, 0.05F, 0.05F);
  const VoxelEvidence before = mapper.map().evidence(met);
  REQUIRE(before.sigma[1] > 0.0F);
  for (int i = 0; i < 5; ++i) {
    const ScanReport report = integrate(mapper, cloud, {&kRobot, 1});
    CHECK((report.voxels_cleared == 0 && report.voxels_doubted == 0));
  }
  CHECK(mapper.map().evidence(met).sigma == before.sigma);
}

TEST_CASE("teammates: a return beyond the range, and a direction without one, end at it as well") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  InferenceConfig config = config_of(carving);
  config.max_range_m = 6.0F;
  config.no_return_range_m = 5.0F;
  Mapper mapper(uncapped_map(0.1), config, 5, kScanCapacity);
  // Nothing but the wall, which is beyond the range, and half of it came back.
  const Cloud cloud = seen_by_sensor([](double, double) { return 10.0; });
  std::vector<std::uint8_t> no_return(cloud.size());
  for (std::size_t i = 0; i < no_return.size(); ++i) no_return[i] = i % 2 == 0 ? 1 : 0;
  const PlacedBox deep = box_at({3.8, -3.0, -3.0}, {14.0, 3.0, 3.0});
  const ScanReport report = integrate(mapper, cloud, {&deep, 1}, no_return);
  CHECK(report.on_teammate > 1000);
  CHECK(report.beyond_range + report.on_teammate + report.no_return == cloud.size());
  CHECK(is_free(mapper, {3.35, 0.05, 0.05}));
  for (double x = 4.05; x < 6.5; x += 0.1)
    CHECK(mapper.map().evidence(Point3f(static_cast<float>(x), 0.05F, 0.05F)).sigma[0] == 0.0F);
}

TEST_CASE("teammates: boxes that are none, and those that the sensor is in, hide nothing") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  std::vector<PlacedBox> boxes;
  boxes.push_back(box_at({-1, -1, -1}, {7, 1, 1}));
  for (const auto& [low, high] :
       {std::pair{nan, 9.0F}, {1.0F, nan}, {9.0F, 1.0F}, {1.0F, 1.0F}, {-infinity, infinity}}) {
    boxes.push_back(kRobot);
    boxes.back().box.low[0] = low;
    boxes.back().box.high[0] = high;
  }
  boxes.push_back(kRobot);
  boxes.back().T_box_map(0, 0) = std::numeric_limits<double>::quiet_NaN();
  boxes.push_back(kRobot);
  boxes.back().T_box_map(1, 1) = 3.0;
  const Cloud cloud = seen_by_sensor(robot_and_wall);
  Mapper none(uncapped_map(0.1), config_of(Carving::kImage), 5, kScanCapacity);
  static_cast<void>(integrate(none, cloud, {}));
  Mapper mapper(uncapped_map(0.1), config_of(Carving::kImage), 5, kScanCapacity);
  const ScanReport report = integrate(mapper, cloud, boxes);
  CHECK((report.teammates == 0 && report.on_teammate == 0));
  CHECK(same_content(mapper.map(), none.map()));
  // Of more than there is room for, the first count.
  boxes.assign(TeammateFilter::kMost, box_at({50, 50, 50}, {51, 51, 51}));
  boxes.push_back(kRobot);
  CHECK(integrate(mapper, cloud, boxes).on_teammate == 0);
  std::swap(boxes.front(), boxes.back());
  CHECK(integrate(mapper, cloud, boxes).on_teammate > 1000);
}

TEST_CASE("TeammateFilter: the look-up from above gives what the boxes give") {
  Random random(83);
  const auto drawn = [&](double reach) { return random.uniform(-reach, reach); };
  int inside = 0;
  for (int i = 0; i < 300; ++i) {
    const Point3d middle{drawn(2000.0), drawn(2000.0), drawn(5.0)};
    std::vector<PlacedBox> boxes;
    for (int k = 0; k < 4; ++k) {
      Matrix34d T = Matrix34d::Identity();
      T.leftCols<3>() =
          Eigen::AngleAxisd(drawn(3.0), Eigen::Vector3d(drawn(1.0), drawn(1.0), 1.0).normalized())
              .toRotationMatrix();
      T.col(3) = middle + Point3d(drawn(40.0), drawn(40.0), drawn(3.0));
      // Sides on the borders of cells.
      if (i % 3 == 0) T.leftCols<3>().setIdentity();
      if (i % 3 == 0) T.col(3) = T.col(3).array().round();
      const double length_m = i % 3 == 0 ? 1.0 + k : random.uniform(0.1, 9.0);
      boxes.push_back(box_at({-length_m, -2, -1}, {length_m, 2, 1}));
      boxes.back().T_box_map = inverse(T);
    }
    const Point3d origin = middle + Point3d(0, 0, 20);
    const TeammateFilter filter(boxes, origin);
    REQUIRE(filter.count() == 4);
    for (int k = 0; k < 300; ++k) {
      const Point3d near = apply(inverse(boxes[static_cast<std::size_t>(k % 4)].T_box_map),
                                 {drawn(10.0), drawn(3.0), drawn(1.5)});
      const Point3f p = round_to_float(near);
      const auto holds = [&](const PlacedBox& one) {
        return one.box.holds(apply(one.T_box_map, p.cast<double>()));
      };
      const bool is_held = std::any_of(boxes.begin(), boxes.end(), holds);
      const std::optional<double> share = filter.share_before(p);
      REQUIRE(share.has_value() == is_held);
      inside += is_held ? 1 : 0;
      if (!share) continue;
      REQUIRE((*share >= 0.0 && *share <= 1.0));
      // Just before it no box of those that the return is in has the ray, just behind it one has.
      const Point3d ray = p.cast<double>() - origin;
      const auto is_in = [&](double part) {
        return std::any_of(boxes.begin(), boxes.end(), [&](const PlacedBox& one) {
          return holds(one) && one.box.holds(apply(one.T_box_map, origin + ray * part));
        });
      };
      CHECK_FALSE(is_in(*share - 1e-6));
      CHECK(is_in(std::min(*share + 1e-9, 1.0)));
    }
  }
  CHECK(inside > 5000);
  CHECK_FALSE(TeammateFilter().share_before({0, 0, 0}));
}

}  // namespace tessera::oracle
