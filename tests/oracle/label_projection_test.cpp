// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Label projection against the rule applied to every pair of points, and against geometry: what a
// plate hides from the camera while the scanner sees it.
#include "tessera/registration/label_projection.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera::oracle {
namespace {

constexpr int kClasses = 19;

struct Scene {
  std::vector<std::array<float, 4>> points;
  std::vector<std::vector<std::uint8_t>> images;
  std::vector<LabelCamera> cameras;
};

CameraIntrinsics intrinsics_of(int camera) {
  if (camera == 2)
    return {CameraKind::kFisheye, 160, 120, 48.0, 48.5, 81.0, 58.0, {-0.02, 0.003, 0.0, 0.0, 0.0}};
  return {
      CameraKind::kPinhole, 160, 96, 130.0, 128.0, 78.0, 47.0, {-0.2, 0.05, 0.001, -0.0007, 0.0}};
}

/// Basic arithmetic only, so that every machine draws the same. Three cameras around the scanner
/// and a cloud with near and far things in front of each other.
Scene drawn_scene(std::uint64_t seed, int count) {
  Random random(seed);
  Scene scene;
  for (int i = 0; i < count; ++i) {
    const double along = random.uniform(0.02, 1.0);
    const double far = random.below(3) == 0 ? 30.0 : 8.0;
    const double x = (random.below(4) == 0 ? -1.0 : 1.0) * far * along;
    const double y = random.uniform(-1.0, 1.0) * far;
    const double z = random.uniform(-0.3, 0.3) * far;
    scene.points.push_back(
        {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z), 0.5F});
  }
  for (int camera = 0; camera < 3; ++camera) {
    const CameraIntrinsics c = intrinsics_of(camera);
    std::vector<std::uint8_t> image(static_cast<std::size_t>(c.width_px * c.height_px));
    for (std::uint8_t& pixel : image) pixel = static_cast<std::uint8_t>(random.below(24));
    scene.images.push_back(std::move(image));
    // Turns by angles of the 3-4-5 and the 5-12-13 triangle, and backwards.
    const double cosine = camera == 0 ? 0.8 : camera == 1 ? 12.0 / 13.0 : -1.0;
    const double sine = camera == 0 ? 0.6 : camera == 1 ? -5.0 / 13.0 : 0.0;
    LabelCamera view;
    view.model = *CameraModel::make(c);
    view.T_camera_lidar << sine, -cosine, 0.0, 0.3, 0.0, 0.0, -1.0, -0.2, cosine, sine, 0.0, -0.4;
    view.row_stride_bytes = static_cast<std::size_t>(c.width_px);
    scene.cameras.push_back(view);
  }
  for (std::size_t i = 0; i < 3; ++i) scene.cameras[i].labels = scene.images[i].data();
  return scene;
}

struct Seen {
  bool seen = false;
  int column = 0;
  int row = 0;
  float range_m = 0.0F;
  float cosine = 0.0F;
};

/// Projection by the formulas, written again.
Seen see(const LabelCamera& camera, const std::array<float, 4>& point) {
  const CameraIntrinsics& c = camera.model.intrinsics();
  const Eigen::Vector3d p =
      camera.T_camera_lidar * Eigen::Vector4d(static_cast<double>(point[0]),
                                              static_cast<double>(point[1]),
                                              static_cast<double>(point[2]), 1.0);
  const auto& k = c.distortion;
  double x = 0.0;
  double y = 0.0;
  if (c.kind == CameraKind::kPinhole) {
    if (p.z() <= 0.0) return {};
    const double u = p.x() / p.z();
    const double v = p.y() / p.z();
    if (std::hypot(u, v) > camera.model.limit()) return {};
    const double s = u * u + v * v;
    const double q = 1.0 + k[0] * s + k[1] * s * s;
    x = u * q + 2.0 * k[2] * u * v + k[3] * (s + 2.0 * u * u);
    y = v * q + k[2] * (s + 2.0 * v * v) + 2.0 * k[3] * u * v;
  } else {
    const double t = std::atan2(std::hypot(p.x(), p.y()), p.z());
    if (t > camera.model.limit()) return {};
    const double d = t * (1.0 + k[0] * t * t + k[1] * t * t * t * t);
    x = d * p.x() / std::hypot(p.x(), p.y());
    y = d * p.y() / std::hypot(p.x(), p.y());
  }
  const double column = std::floor(c.focal_x_px * x + c.centre_x_px + 0.5);
  const double row = std::floor(c.focal_y_px * y + c.centre_y_px + 0.5);
  if (column < 0 || column >= c.width_px || row < 0 || row >= c.height_px) return {};
  return {true, static_cast<int>(column), static_cast<int>(row), static_cast<float>(p.norm()),
          static_cast<float>(p.z() / p.norm())};
}

/// The rule of the header for one point, by looking at all others.
bool occluded(const std::vector<Seen>& all, const Seen& own, const LabelProjectionConfig& config) {
  const float nearer_than =
      own.range_m - (config.tolerance_m + config.tolerance_share * own.range_m);
  std::array<bool, 8> sides{};
  for (const Seen& other : all) {
    if (!other.seen || !(other.range_m < nearer_than)) continue;
    const int dc = other.column / config.cell_px - own.column / config.cell_px;
    const int dr = other.row / config.cell_px - own.row / config.cell_px;
    if (dc == 0 && dr == 0) return true;
    const bool straight = dc == 0 || dr == 0 || std::abs(dc) == std::abs(dr);
    if (!straight || std::max(std::abs(dc), std::abs(dr)) > config.reach_cells) continue;
    const auto sign = [](int n) { return (n > 0) - (n < 0); };
    constexpr std::array<std::array<int, 2>, 8> kSides{
        {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};
    for (std::size_t i = 0; i < 8; ++i)
      if (kSides[i] == std::array<int, 2>{sign(dc), sign(dr)}) sides[i] = true;
  }
  for (std::size_t i = 0; i < 8; i += 2)
    if (sides[i] && sides[i + 1]) return true;
  return false;
}

std::vector<std::uint8_t> labels_by_rule(const Scene& scene, const LabelProjectionConfig& config) {
  std::vector<std::uint8_t> labels(scene.points.size(), kClasses + 1);
  std::vector<float> best(scene.points.size(), -2.0F);
  for (std::size_t camera = 0; camera < scene.cameras.size(); ++camera) {
    std::vector<Seen> all;
    for (const auto& point : scene.points) all.push_back(see(scene.cameras[camera], point));
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!all[i].seen || occluded(all, all[i], config)) continue;
      const int width = scene.cameras[camera].model.width_px();
      const std::uint8_t label =
          scene.images[camera][static_cast<std::size_t>(all[i].row * width + all[i].column)];
      if (label < 1 || label > kClasses || all[i].cosine <= best[i]) continue;
      best[i] = all[i].cosine;
      labels[i] = label;
    }
  }
  return labels;
}

struct Projection {
  LabelReport report;
  std::vector<std::uint8_t> labels;
};

Projection project(const Scene& scene, const LabelProjectionConfig& config) {
  const LabelProjectionCapacity capacity{100000, 400, 400};
  AlignedMemory memory(LabelProjector::required_bytes(capacity, config));
  Arena arena = memory.arena();
  Result<LabelProjector> projector = LabelProjector::make(arena, config, capacity);
  REQUIRE(projector.ok());
  Projection result;
  result.labels.assign(scene.points.size(), 0);
  result.report = projector->project({scene.points[0].data(), 4, scene.points.size()},
                                     scene.cameras, kClasses, result.labels);
  REQUIRE(result.report.status == Status::kOk);
  return result;
}

TEST_CASE("label projection oracle: equals the rule applied to every pair of points") {
  const std::array<LabelProjectionConfig, 4> configs{
      {{2, 4, 0.3F, 0.05F}, {1, 0, 0.0F, 0.0F}, {5, 2, 1.0F, 0.0F}, {3, 16, 0.1F, 0.2F}}};
  for (std::uint64_t seed = 400; seed < 412; ++seed) {
    const Scene scene = drawn_scene(seed, 1500);
    const LabelProjectionConfig& config = configs[seed % configs.size()];
    INFO("seed " << seed);
    const Projection got = project(scene, config);
    CHECK(got.labels == labels_by_rule(scene, config));
    CHECK(got.report.labelled > 30);
    CHECK(got.report.cameras[0].occluded + got.report.cameras[2].occluded > 10);
  }
}

TEST_CASE("label projection oracle: what a plate hides from the camera alone gets no label of it") {
  // A scanner at the origin, a camera 0.8 m to its right, a plate 4 m ahead, a wall at 12 m.
  Scene scene;
  LabelCamera view;
  view.model = *CameraModel::make({CameraKind::kPinhole, 400, 240, 300.0, 300.0, 200, 120, {}});
  view.T_camera_lidar << 0, -1, 0, -0.8, 0, 0, -1, 0, 1, 0, 0, 0;
  const auto on_plate = [](double y, double z) { return std::abs(y) < 0.6 && std::abs(z) < 0.7; };
  std::vector<bool> hidden;
  std::vector<bool> visible;
  for (int beam = -40; beam <= 40; ++beam) {
    for (int step = -150; step <= 150; ++step) {
      const double up = 0.006 * beam;
      const double left = 0.003 * step;
      const bool plate = on_plate(4.0 * left, 4.0 * up);
      const double x = plate ? 4.0 : 12.0;
      scene.points.push_back(
          {static_cast<float>(x), static_cast<float>(x * left), static_cast<float>(x * up), 0.0F});
      // Where the camera's ray to a point of the wall passes the plate's plane.
      const double y_at_plate = -0.8 + (x * left + 0.8) * 4.0 / 12.0;
      const double z_at_plate = x * up * 4.0 / 12.0;
      const double edge_y = std::abs(y_at_plate) - 0.6;
      const double edge_z = std::abs(z_at_plate) - 0.7;
      constexpr double kSample_m = 0.05;  // between returns of the plate, and a little
      hidden.push_back(!plate && edge_y < -kSample_m && edge_z < -kSample_m);
      visible.push_back(!plate && (edge_y > kSample_m || edge_z > kSample_m));
    }
  }
  // The camera's image: the plate 1, the wall 2.
  std::vector<std::uint8_t> image(400 * 240, 2);
  for (int row = 0; row < 240; ++row) {
    for (int column = 0; column < 400; ++column) {
      const double y = -0.8 - (column - 200) / 300.0 * 4.0;
      const double z = -(row - 120) / 300.0 * 4.0;
      if (on_plate(y, z)) image[static_cast<std::size_t>(row * 400 + column)] = 1;
    }
  }
  scene.images.push_back(image);
  view.labels = scene.images[0].data();
  view.row_stride_bytes = 400;
  scene.cameras.push_back(view);

  const Projection got = project(scene, {});
  int hidden_count = 0;
  int visible_in_image = 0;
  int lost = 0;
  for (std::size_t i = 0; i < got.labels.size(); ++i) {
    if (hidden[i]) {
      ++hidden_count;
      REQUIRE(got.labels[i] == kClasses + 1);
    }
    if (!visible[i] || !see(view, scene.points[i]).seen) continue;
    ++visible_in_image;
    REQUIRE(got.labels[i] != 1);
    lost += got.labels[i] == 2 ? 0 : 1;
  }
  CHECK(hidden_count > 500);
  CHECK(visible_in_image > 5000);
  CHECK(lost == 0);
}

TEST_CASE("golden digest: labels projected are the same on every machine") {
  Digest digest;
  for (std::uint64_t seed = 500; seed < 503; ++seed) {
    const Projection got = project(drawn_scene(seed, 40000), {});
    for (const std::uint8_t label : got.labels) digest.add(label);
    digest.add(got.report.cells_read);
  }
  CHECK(digest.value() == 0xceea4bd82e1eae23U);
}

}  // namespace
}  // namespace tessera::oracle
