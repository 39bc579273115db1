// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A point takes the label of the pixel that it projects to, unless the camera does not see it; each
// point of each camera is counted once.
#include "tessera/registration/label_projection.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tessera/registration/camera_pose.hpp"
#include "unit/registration/arena_memory.hpp"

namespace tessera {
namespace {

constexpr int kClasses = 9;
constexpr std::uint8_t kUnlabelled = kClasses + 1;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// The scanner's x forward, y left, z up to the camera's x right, y down, z forward; the camera at
/// p_lidar, turned to the left by yaw.
Matrix34d looking(double yaw_rad, const Eigen::Vector3d& p_lidar = Eigen::Vector3d::Zero()) {
  Eigen::Matrix3d R;
  R << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  R = R * Eigen::AngleAxisd(-yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Matrix34d T;
  T << R, -R * p_lidar;
  return T;
}

/// A camera whose image has one label throughout.
struct Camera {
  Camera(int width, int height, double focal, std::uint8_t label, const Matrix34d& T)
      : pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), label) {
    view.model = *CameraModel::make({CameraKind::kPinhole,
                                     width,
                                     height,
                                     focal,
                                     focal,
                                     0.5 * (width - 1),
                                     0.5 * (height - 1),
                                     {}});
    view.T_camera_lidar = T;
    view.labels = pixels.data();
    view.row_stride_bytes = static_cast<std::size_t>(width);
  }
  std::vector<std::uint8_t> pixels;
  LabelCamera view;
};

using Points = std::vector<std::array<float, 3>>;

struct Projected {
  LabelReport report;
  std::vector<std::uint8_t> components;
};

Projected project(const Points& points, const std::vector<LabelCamera>& cameras,
                  const LabelProjectionConfig& config = {}) {
  const LabelProjectionCapacity capacity{5000, 640, 480};
  AlignedMemory memory(LabelProjector::required_bytes(capacity, config));
  Arena arena = memory.arena();
  Result<LabelProjector> projector = LabelProjector::make(arena, config, capacity);
  REQUIRE(projector.ok());
  CHECK(arena.remaining_bytes() < 2 * kArenaAlignment);
  Projected result;
  result.components.assign(points.size(), 0);
  const float* const first = points.empty() ? nullptr : points[0].data();
  result.report =
      projector->project({first, 3, points.size()}, cameras, kClasses, result.components);
  const LabelReport& report = result.report;
  for (std::size_t i = 0; i < cameras.size() && report.status == Status::kOk; ++i) {
    const LabelCameraReport& c = report.cameras[i];
    if (c.status != Status::kOk) continue;
    const std::uint32_t counted =
        c.behind + c.outside + c.masked + c.occluded + c.unknown + c.better_other + c.labelled;
    CHECK(counted + report.non_finite + report.over_capacity == report.points);
  }
  return result;
}

TEST_CASE("label projection: left of the axis is left in the image, above is above") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  const auto at = [&](int column, int row) -> std::uint8_t& {
    return camera.pixels[static_cast<std::size_t>(row * 101 + column)];
  };
  at(50 - 20, 40) = 2;  // 2 m to the left, 10 m ahead
  at(50, 40 - 30) = 3;  // 3 m up
  const Projected got =
      project({{10.0F, 0.0F, 0.0F}, {10.0F, 2.0F, 0.0F}, {10.0F, 0.0F, 3.0F}}, {camera.view});
  CHECK(got.components == std::vector<std::uint8_t>{1, 2, 3});
  CHECK(got.report.labelled == 3);
}

TEST_CASE("label projection: behind, beside, masked, unknown values and no camera: unlabelled") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  const Points points{{-5.0F, 0.0F, 0.0F}, {1.0F, 9.0F, 0.0F}, {9.0F, 0.0F, 0.0F}};
  Projected got = project(points, {camera.view});
  CHECK(got.components == std::vector<std::uint8_t>{kUnlabelled, kUnlabelled, 1});
  CHECK(got.report.cameras[0].behind == 1);
  CHECK(got.report.cameras[0].outside == 1);
  for (const int value : {0, kClasses + 1, 255}) {
    std::fill(camera.pixels.begin(), camera.pixels.end(), static_cast<std::uint8_t>(value));
    got = project(points, {camera.view});
    CHECK(got.components == std::vector<std::uint8_t>(3, kUnlabelled));
    CHECK(got.report.cameras[0].unknown == 1);
  }
  std::vector<std::uint8_t> mask(camera.pixels.size(), 0);
  camera.view.mask = mask.data();
  camera.view.mask_stride_bytes = 101;
  got = project(points, {camera.view});
  CHECK(got.report.cameras[0].masked == 1);
  got = project(points, {});
  CHECK(got.components == std::vector<std::uint8_t>(3, kUnlabelled));
  CHECK(got.report.labelled == 0);
}

TEST_CASE("label projection: a padded image is read by its stride") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  std::vector<std::uint8_t> padded(81 * 128, 7);
  for (std::size_t row = 0; row < 81; ++row) {
    for (std::size_t column = 0; column < 101; ++column) padded[row * 128 + column] = 4;
  }
  camera.view.labels = padded.data();
  camera.view.row_stride_bytes = 128;
  const Projected got =
      project({{10.0F, -4.9F, -3.9F}, {10.0F, 4.9F, 3.9F}, {10.0F, -4.9F, 3.9F}}, {camera.view});
  CHECK(got.components == std::vector<std::uint8_t>(3, 4));
}

TEST_CASE("label projection: the nearer of two points in a pixel hides the other") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  const Projected got =
      project({{20.0F, 0.0F, 0.0F}, {10.0F, 0.0F, 0.0F}, {10.2F, 0.0F, 0.0F}}, {camera.view});
  CHECK(got.components == std::vector<std::uint8_t>{kUnlabelled, 1, 1});
  CHECK(got.report.cameras[0].occluded == 1);
}

TEST_CASE("label projection: tolerance is tolerance_m plus a share of the range") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  const LabelProjectionConfig config{2, 2, 0.5F, 0.1F};
  // Hidden from 10 m on by what is nearer than d - 0.5 - 0.1 d: d > 11.67.
  CHECK(project({{10.0F, 0, 0}, {11.6F, 0, 0}}, {camera.view}, config).report.labelled == 2);
  CHECK(project({{10.0F, 0, 0}, {11.7F, 0, 0}}, {camera.view}, config).report.labelled == 1);
}

TEST_CASE("label projection: between two nearer points is hidden, beside them is not") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  const LabelProjectionConfig config{2, 3, 0.3F, 0.05F};
  // At 10 m 0.1 m is a pixel, at 20 m 0.2 m: 4 px to both sides.
  const std::array<float, 3> left{10.0F, 0.4F, 0.0F};
  const std::array<float, 3> right{10.0F, -0.4F, 0.0F};
  const std::array<float, 3> above{10.0F, 0.0F, 0.4F};
  const std::array<float, 3> below{10.0F, 0.0F, -0.4F};
  const std::array<float, 3> far{20.0F, 0.0F, 0.0F};
  const auto seen = [&](const Points& points) {
    return project(points, {camera.view}, config).components.back() == 1;
  };
  CHECK_FALSE(seen({left, right, far}));
  CHECK_FALSE(seen({above, below, far}));
  CHECK_FALSE(seen({{10.0F, 0.4F, 0.4F}, {10.0F, -0.4F, -0.4F}, far}));
  CHECK_FALSE(seen({{10.0F, -0.4F, 0.4F}, {10.0F, 0.4F, -0.4F}, far}));
  CHECK(seen({left, far}));
  CHECK(seen({right, far}));
  CHECK(seen({left, above, far}));
  CHECK(seen({{10.0F, 0.9F, 0.0F}, {10.0F, -0.9F, 0.0F}, far}));
}

TEST_CASE("label projection: flat ground hides nothing of itself, however flat it is seen") {
  Camera camera(401, 301, 400.0, 1, looking(0.0));
  Points points;
  // Beams a third of a degree apart, 1.7 m above the ground.
  for (int beam = 1; beam < 60; ++beam) {
    const double down = 0.0058 * beam;
    for (int step = -60; step <= 60; ++step) {
      const double range = 1.7 / std::sin(down);
      const double turn = 0.004 * step;
      if (range > 60.0) continue;
      points.push_back({static_cast<float>(range * std::cos(down) * std::cos(turn)),
                        static_cast<float>(range * std::cos(down) * std::sin(turn)), -1.7F});
    }
  }
  const Projected got = project(points, {camera.view});
  CHECK(got.report.cameras[0].occluded == 0);
  CHECK(got.report.labelled > points.size() / 2);
}

TEST_CASE("label projection: of two cameras the one nearer to its axis labels, else the first") {
  const Camera ahead(101, 81, 60.0, 1, looking(0.0));
  const Camera aside(101, 81, 60.0, 2, looking(0.5));
  const auto label = [&](double yaw) {
    const std::array<float, 3> p{static_cast<float>(10 * std::cos(yaw)),
                                 static_cast<float>(10 * std::sin(yaw)), 0.0F};
    return project({p}, {ahead.view, aside.view}).components[0];
  };
  CHECK(label(0.1) == 1);
  CHECK(label(0.4) == 2);
  const Camera twin(101, 81, 60.0, 3, looking(0.0));
  const Projected same = project({{10.0F, 1.0F, 0.5F}}, {twin.view, ahead.view});
  CHECK(same.components[0] == 3);
  CHECK(same.report.cameras[1].better_other == 1);
  const Projected later = project({{8.7F, 4.8F, 0.0F}}, {ahead.view, aside.view});
  CHECK(later.components[0] == 2);
  CHECK(later.report.cameras[0].better_other == 1);
  CHECK(later.report.cameras[0].labelled == 0);
  CHECK(later.report.cameras[1].labelled == 1);
}

TEST_CASE("label projection: a camera without an answer leaves it to another that has one") {
  const Camera nearer(101, 81, 60.0, 0, looking(0.0));
  const Camera aside(101, 81, 60.0, 2, looking(0.5));
  CHECK(project({{10.0F, 0.5F, 0.0F}}, {nearer.view, aside.view}).components[0] == 2);
}

TEST_CASE("label projection: an image of another time is met where the camera was then") {
  // The robot drives 1 m ahead between the scan and the image.
  AlignedMemory memory(PoseTrack::required_bytes(4));
  Arena arena = memory.arena();
  PoseTrack track = *PoseTrack::make(4, arena);
  Matrix34d T = Matrix34d::Identity();
  REQUIRE(track.add({1'000'000, T}) == Status::kOk);
  T(0, 3) = 2.0;
  REQUIRE(track.add({1'100'000, T}) == Status::kOk);
  const CameraMount mount{looking(0.0), Matrix34d::Identity()};
  const Result<Matrix34d> T_camera_lidar =
      camera_from_lidar(track, mount, 1'050'000, 1'000'000, 200'000);
  REQUIRE(T_camera_lidar.ok());
  CHECK(
      (*T_camera_lidar * Eigen::Vector4d(10.0, 0.0, 0.0, 1.0) - Eigen::Vector3d(0, 0, 9.0)).norm() <
      1e-12);
  CHECK(*camera_from_lidar(track, mount, 5, 5, 0) == looking(0.0));
  CHECK(camera_from_lidar(track, mount, 1'000'000, 900'000, 200'000).status() ==
        Status::kOutOfRange);
  CHECK(camera_from_lidar(track, mount, 1'100'001, 1'000'000, 200'000).status() ==
        Status::kOutOfRange);
}

TEST_CASE(
    "label projection: points that are not finite or at the camera's centre stay unlabelled") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  const float inf = std::numeric_limits<float>::infinity();
  const float most = std::numeric_limits<float>::max();
  const Projected got =
      project({{kNaN, 0, 0}, {0, inf, 0}, {0, 0, -inf}, {0, 0, 0}, {most, most, most}, {9, 0, 0}},
              {camera.view});
  CHECK(got.report.non_finite == 3);
  CHECK(got.report.labelled == 1);
  CHECK(got.components[5] == 1);
}

TEST_CASE("label projection: a thousand points in one cell leave the nearest within tolerance") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  Points points;
  for (int i = 0; i < 1000; ++i) points.push_back({5.0F + 0.01F * static_cast<float>(i), 0, 0});
  const Projected got = project(points, {camera.view});
  // Nearer than 5 + 0.3 + 0.05 d: d up to 5.579.
  CHECK(got.report.labelled == 58);
  CHECK(got.report.cameras[0].occluded == 942);
}

TEST_CASE("label projection: the cells read stay under the stated bound") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  Points points;
  for (int i = 0; i < 3000; ++i) {
    points.push_back({10.0F + static_cast<float>(i % 7), static_cast<float>(i % 61) * 0.1F - 3.0F,
                      static_cast<float>(i % 47) * 0.1F - 2.5F});
  }
  for (const int reach : {0, 1, 5, LabelProjector::kMostReach}) {
    const Projected got =
        project(points, {camera.view, camera.view}, LabelProjectionConfig{2, reach, 0.3F, 0.05F});
    CHECK(got.report.cells_read <= 2 * points.size() * static_cast<std::size_t>(1 + 8 * reach));
    CHECK(got.report.cells_read > 0);
  }
}

TEST_CASE("label projection: a camera that cannot be used is left out and says why") {
  Camera good(101, 81, 100.0, 1, looking(0.0));
  const Points points{{10.0F, 0, 0}};
  const auto status_with = [&](auto change) {
    LabelCamera bad = good.view;
    change(bad);
    const Projected got = project(points, {bad, good.view});
    CHECK(got.components[0] == 1);
    return got.report.cameras[0].status;
  };
  CHECK(status_with([](LabelCamera& c) { c.labels = nullptr; }) == Status::kInvalidArgument);
  CHECK(status_with([](LabelCamera& c) { c.model = CameraModel(); }) == Status::kInvalidArgument);
  CHECK(status_with([](LabelCamera& c) { c.row_stride_bytes = 100; }) == Status::kInvalidArgument);
  CHECK(status_with([](LabelCamera& c) { c.mask = c.labels; }) == Status::kInvalidArgument);
  CHECK(status_with([](LabelCamera& c) { c.T_camera_lidar.setZero(); }) ==
        Status::kInvalidArgument);
  const Camera large(641, 482, 100.0, 1, looking(0.0));
  CHECK(status_with([&](LabelCamera& c) { c = large.view; }) == Status::kResourceExhausted);
}

TEST_CASE("label projection: points beyond the capacity stay unlabelled and are counted") {
  Camera camera(101, 81, 100.0, 1, looking(0.0));
  const Points points(5003, {10.0F, 0, 0});
  const Projected got = project(points, {camera.view});
  CHECK(got.report.over_capacity == 3);
  CHECK(got.report.labelled == 5000);
  CHECK(got.components[5000] == kUnlabelled);
}

TEST_CASE("label projection: arguments out of range do nothing") {
  LabelProjector projector;
  std::vector<std::uint8_t> components(2, 77);
  const std::vector<float> points(6, 1.0F);
  const std::vector<LabelCamera> many(kMostCameras + 1);
  CHECK(projector.project({points.data(), 3, 2}, many, 5, components).status ==
        Status::kInvalidArgument);
  CHECK(projector.project({points.data(), 3, 2}, {}, 0, components).status ==
        Status::kInvalidArgument);
  CHECK(projector.project({points.data(), 3, 2}, {}, 63, components).status ==
        Status::kInvalidArgument);
  CHECK(projector.project({points.data(), 2, 2}, {}, 5, components).status ==
        Status::kInvalidArgument);
  CHECK(projector.project({points.data(), 3, 3}, {}, 5, components).status ==
        Status::kInvalidArgument);
  CHECK(components[0] == 77);
  const auto refused = [](const LabelProjectionConfig& config,
                          const LabelProjectionCapacity& capacity) {
    Arena none(std::span<std::byte>{});
    return LabelProjector::make(none, config, capacity).status() == Status::kInvalidArgument;
  };
  CHECK(refused({0, 1, 0.1F, 0.1F}, {}));
  CHECK(refused({65, 1, 0.1F, 0.1F}, {}));
  CHECK(refused({2, -1, 0.1F, 0.1F}, {}));
  CHECK(refused({2, 17, 0.1F, 0.1F}, {}));
  CHECK(refused({2, 1, kNaN, 0.1F}, {}));
  CHECK(refused({2, 1, 0.1F, 1.1F}, {}));
  CHECK(refused({}, {0, 10, 10}));
  CHECK(refused({}, {10, 0, 10}));
  CHECK(refused({}, {10, 10, CameraModel::kMostPixels + 1}));
  Arena none(std::span<std::byte>{});
  CHECK(LabelProjector::make(none, {}, {}).status() == Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
