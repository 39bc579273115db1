// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Points and cameras that cannot be used are counted and told; the work stays within its bound.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tessera/registration/label_projection.hpp"
#include "unit/registration/sample_cameras.hpp"

namespace tessera {
namespace {

using test::Camera;
using test::kNaN;
using test::kUnlabelled;
using test::looking;
using test::Points;
using test::project;
using test::Projected;

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

TEST_CASE("label projection: a place just before the end of a pixel is in that pixel") {
  // 0.5 more is 1 when rounded, which would be the next pixel.
  const double most = std::nextafter(0.5, 0.0);
  REQUIRE(most + 0.5 == 1.0);
  Camera camera(1, 1, most, 4, looking(0.0));
  camera.pixels.push_back(7);  // Behind the image.
  camera.view.labels = camera.pixels.data();
  const Projected got = project({{1, -1, 0}, {1, 0, -1}, {1, -1, -1}}, {camera.view});
  CHECK(got.report.labelled == 3);
  CHECK(got.components == std::vector<std::uint8_t>{4, 4, 4});
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
