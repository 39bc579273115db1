// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The cameras of the simulated robots see the street that their scanner sees, and a scan that is
// swept while the robot drives comes out whole when the motion is taken out.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <vector>

#include "scans/dataset_classes.hpp"
#include "simulator/street_simulator.hpp"
#include "support/aligned_memory.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/registration/label_projection.hpp"

namespace tessera {
namespace {

StreetSimulator street(bool sweep = false) {
  SimulatorConfig config;
  config.seed = 5;
  config.scans = 4;
  config.sweep = sweep;
  auto simulator = StreetSimulator::make(config);
  REQUIRE(simulator.ok());
  return std::move(*simulator);
}

Matrix34d matrix(const Eigen::Isometry3d& T) { return T.matrix().topRows<3>(); }

TEST_CASE("street cameras: the same image again, other images of other robots and scans") {
  const StreetSimulator a = street();
  const StreetSimulator b = street();
  (void)b.label_image(1, 2, 3);
  const SimulatedLabelImage image = a.label_image(0, 0, 1);
  CHECK(image.predictions == b.label_image(0, 0, 1).predictions);
  CHECK(image.labels == b.label_image(0, 0, 1).labels);
  CHECK(image.labels != a.label_image(0, 0, 2).labels);
  CHECK(image.labels != a.label_image(1, 0, 1).labels);
}

TEST_CASE("street cameras: images have the model's size, classes 0 to 19, and errors") {
  const StreetSimulator simulator = street();
  const std::vector<SimulatedCamera> cameras = simulator.cameras();
  REQUIRE(cameras.size() == 3);
  for (int camera = 0; camera < 3; ++camera) {
    const CameraModel& model = cameras[static_cast<std::size_t>(camera)].model;
    const SimulatedLabelImage image = simulator.label_image(0, camera, 0);
    CHECK(image.width_px == model.width_px());
    CHECK(image.height_px == model.height_px());
    REQUIRE(image.labels.size() == static_cast<std::size_t>(model.width_px()) *
                                       static_cast<std::size_t>(model.height_px()));
    std::size_t wrong = 0;
    std::size_t known = 0;
    for (std::size_t i = 0; i < image.labels.size(); ++i) {
      REQUIRE(image.labels[i] <= 19);
      REQUIRE(image.predictions[i] <= 19);
      known += image.labels[i] != 0 ? 1U : 0U;
      wrong += image.labels[i] != 0 && image.labels[i] != image.predictions[i] ? 1U : 0U;
    }
    CHECK(known > image.labels.size() / 3);
    CHECK(wrong > known / 50);
    CHECK(wrong < known / 3);
  }
}

TEST_CASE("street cameras: true images give the scan its true labels by projection") {
  const StreetSimulator simulator = street();
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  const std::vector<SimulatedCamera> cameras = simulator.cameras();
  const SimulatedScan scan = simulator.scan(0, 2);
  std::vector<SimulatedLabelImage> images;
  for (int camera = 0; camera < 3; ++camera) images.push_back(simulator.label_image(0, camera, 2));
  std::vector<LabelCamera> views;
  for (std::size_t i = 0; i < 3; ++i) {
    LabelCamera view;
    view.model = cameras[i].model;
    const Eigen::Isometry3d T_map_image = simulator.T_map_sensor_at(0, 0.2 + cameras[i].offset_s);
    view.T_camera_lidar =
        product(matrix(cameras[i].T_camera_sensor),
                product(inverse(matrix(T_map_image)), matrix(simulator.T_map_sensor(0, 2))));
    view.labels = images[i].labels.data();
    view.row_stride_bytes = static_cast<std::size_t>(images[i].width_px);
    views.push_back(view);
  }
  const LabelProjectionCapacity capacity{200000, 640, 480};
  AlignedMemory memory(LabelProjector::required_bytes(capacity, {}));
  Arena arena = memory.arena();
  LabelProjector projector = *LabelProjector::make(arena, {}, capacity);
  std::vector<std::uint8_t> components(scan.points.size());
  const LabelReport report =
      projector.project({scan.points[0].data(), 4, scan.points.size()}, views, 19, components);
  std::size_t right = 0;
  std::size_t judged = 0;
  for (std::size_t i = 0; i < components.size(); ++i) {
    const std::uint8_t truth = classes.component(static_cast<std::uint16_t>(scan.labels[i]));
    if (truth == 20 || components[i] == 20) continue;
    ++judged;
    right += components[i] == truth ? 1U : 0U;
  }
  CHECK(report.labelled > scan.points.size() * 7 / 10);
  CHECK(static_cast<double>(right) > 0.96 * static_cast<double>(judged));
  for (std::size_t i = 0; i < 3; ++i) CHECK(report.cameras[i].labelled > 5000);
}

/// Cells of 0.25 m with a return of what stands still.
using Cells = std::set<std::array<int, 3>>;

std::array<int, 3> cell_of(const Eigen::Vector3d& p) {
  const auto cell = [](double x) { return static_cast<int>(std::floor(x / 0.25)); };
  return {cell(p.x()), cell(p.y()), cell(p.z())};
}

bool stands(std::uint32_t raw_id) { return raw_id == 50 || raw_id == 80 || raw_id == 71; }

TEST_CASE(
    "street sweep: with each point at its time's pose, walls and poles are where they stand") {
  const StreetSimulator frozen = street();
  const StreetSimulator swept = street(true);
  Cells cells;
  for (int index = 1; index <= 3; ++index) {
    const SimulatedScan scan = frozen.scan(0, index);
    CHECK(scan.times_s.empty());
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const auto& p = scan.points[i];
      if (stands(scan.labels[i]))
        cells.insert(cell_of(frozen.T_map_sensor(0, index) *
                             Eigen::Vector3f(p[0], p[1], p[2]).cast<double>()));
    }
  }
  const SimulatedScan scan = swept.scan(0, 2);
  REQUIRE(scan.times_s.size() == scan.points.size());
  double count = 0.0;
  double placed = 0.0;
  double skewed = 0.0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const auto time_s = static_cast<double>(scan.times_s[i]);
    REQUIRE(std::abs(time_s) <= 0.0501);
    const auto& p = scan.points[i];
    // Ahead at the stamp, then to the left.
    REQUIRE(std::abs(std::remainder(
                static_cast<double>(std::atan2(p[1], p[0])) / 62.831853 - time_s, 0.1)) < 1e-4);
    if (!stands(scan.labels[i]) || std::hypot(p[0], p[1]) > 25.0F) continue;
    const Eigen::Vector3d p_sensor = Eigen::Vector3f(p[0], p[1], p[2]).cast<double>();
    ++count;
    placed += cells.count(cell_of(swept.T_map_sensor_at(0, 0.2 + time_s) * p_sensor)) > 0 ? 1 : 0;
    skewed += cells.count(cell_of(swept.T_map_sensor(0, 2) * p_sensor)) > 0 ? 1 : 0;
  }
  CHECK(count > 3000.0);
  CHECK(placed > 0.9 * count);
  CHECK(skewed < placed - 0.1 * count);
}

TEST_CASE("street sweep: the cameras see the same, whether scans are swept or not") {
  CHECK(street().label_image(0, 1, 2).labels == street(true).label_image(0, 1, 2).labels);
}

}  // namespace
}  // namespace tessera
