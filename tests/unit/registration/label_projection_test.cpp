// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A point takes the label of the pixel that it projects to, unless the camera does not see it; each
// point of each camera is counted once.
#include "tessera/registration/label_projection.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tessera/registration/camera_pose.hpp"
#include "unit/registration/sample_cameras.hpp"

namespace tessera {
namespace {

using test::Camera;
using test::kClasses;
using test::kUnlabelled;
using test::looking;
using test::Points;
using test::project;
using test::Projected;

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

}  // namespace
}  // namespace tessera
