// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Depth images become points on their pixels' rays, without those that hang between two surfaces.
#include "tessera/registration/depth_image.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "support/aligned_memory.hpp"

namespace tessera {
namespace {

constexpr int kWidth = 64;
constexpr int kHeight = 48;
constexpr int kClasses = 5;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

CameraModel camera_model() {
  return *CameraModel::make({CameraKind::kPinhole,
                             kWidth,
                             kHeight,
                             60.0,
                             61.0,
                             31.0,
                             24.0,
                             {-0.1, 0.02, 0.001, -0.001, 0.0}});
}

struct Given {
  std::vector<float> metres = std::vector<float>(kWidth * kHeight, 2.0F);
  std::vector<std::uint8_t> labels = std::vector<std::uint8_t>(kWidth * kHeight, 3);
  float& at(int column, int row) { return metres[static_cast<std::size_t>(row * kWidth + column)]; }
  [[nodiscard]] DepthImage image() const {
    return {nullptr, metres.data(), kWidth, labels.data(), kWidth};
  }
};

struct Got {
  DepthReport report;
  std::vector<float> points;
  std::vector<std::uint8_t> components;
};

DepthConfig every_pixel() {
  DepthConfig config;
  config.step_px = 1;
  return config;
}

Got to_points(const DepthImage& image, const DepthConfig& config = every_pixel(),
              const CameraModel& model = camera_model()) {
  AlignedMemory memory(
      DepthCamera::required_bytes(model.width_px(), model.height_px(), config.step_px));
  Arena arena = memory.arena();
  const Result<DepthCamera> camera = DepthCamera::make(arena, model, config);
  REQUIRE(camera.ok());
  Got got;
  got.points.resize(3 * camera->most_points());
  got.components.resize(camera->most_points());
  got.report = camera->to_points(image, kClasses, got.points, got.components);
  const DepthReport& r = got.report;
  if (r.status == Status::kOk)
    CHECK(r.points + r.no_depth + r.too_near + r.too_far + r.flying + r.no_ray ==
          camera->most_points());
  return got;
}

TEST_CASE("depth image: each point is at its depth and projects to its pixel, with its label") {
  Given given;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      given.at(column, row) = 1.0F + 0.01F * static_cast<float>(column + row);
      given.labels[static_cast<std::size_t>(row * kWidth + column)] =
          static_cast<std::uint8_t>((column + 3 * row) % 7);
    }
  }
  const CameraModel model = camera_model();
  for (const DepthAlong along : {DepthAlong::kAxis, DepthAlong::kRay}) {
    DepthConfig config = every_pixel();
    config.along = along;
    const Got got = to_points(given.image(), config);
    REQUIRE(got.report.points == kWidth * kHeight);
    for (std::size_t i = 0; i < kWidth * kHeight; ++i) {
      const Point3d p(static_cast<double>(got.points[3 * i]),
                      static_cast<double>(got.points[3 * i + 1]),
                      static_cast<double>(got.points[3 * i + 2]));
      const double depth_m = along == DepthAlong::kAxis ? p.z() : p.norm();
      REQUIRE(depth_m == Approx(static_cast<double>(given.metres[i])).epsilon(1e-6));
      Pixel pixel;
      REQUIRE(model.project(p, pixel) == Sight::kSeen);
      REQUIRE(std::abs(pixel.column - static_cast<double>(i % kWidth)) < 1e-4);
      REQUIRE(std::abs(pixel.row - static_cast<double>(i / kWidth)) < 1e-4);
      const int label = given.labels[i];
      REQUIRE(got.components[i] == (label >= 1 && label <= kClasses ? label : kClasses + 1));
    }
  }
}

TEST_CASE("depth image: whole millimetres say the same as metres") {
  Given given;
  std::vector<std::uint16_t> millimetres(kWidth * kHeight);
  for (std::size_t i = 0; i < millimetres.size(); ++i) {
    millimetres[i] = static_cast<std::uint16_t>(i % 3 == 0 ? 0 : 1500 + i % 40);
    given.metres[i] = static_cast<float>(millimetres[i]) * 0.001F;
  }
  DepthImage image = given.image();
  const Got metres = to_points(image);
  image.metres = nullptr;
  image.millimetres = millimetres.data();
  const Got whole = to_points(image);
  CHECK(whole.points == metres.points);
  CHECK(whole.report.no_depth == kWidth * kHeight / 3);
}

TEST_CASE("depth image: no depth, too near, too far and NaN are counted and give no point") {
  Given given;
  given.at(1, 1) = 0.0F;
  given.at(5, 5) = kNaN;
  given.at(9, 9) = std::numeric_limits<float>::infinity();
  given.at(13, 13) = -1.0F;
  given.at(17, 17) = 0.19F;
  given.at(21, 21) = 10.1F;
  const Got got = to_points(given.image());
  CHECK(got.report.no_depth == 4);
  CHECK(got.report.too_near == 1);
  CHECK(got.report.too_far == 1);
  CHECK(got.report.flying == 0);
  CHECK(got.report.points == kWidth * kHeight - 6);
}

TEST_CASE("depth image: pixels between two surfaces are flying, those on either side are not") {
  Given given;  // 2 m, and from column 30 on 5 m; two columns in between are mixed.
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 28; column < kWidth; ++column)
      given.at(column, row) = column == 28 ? 3.0F : column == 29 ? 4.1F : 5.0F;
  }
  Got got = to_points(given.image());
  CHECK(got.report.flying == 2 * kHeight);
  for (std::size_t i = 0; i < got.report.points; ++i) {
    const float z = got.points[3 * i + 2];
    REQUIRE((std::abs(z - 2.0F) < 1e-5F || std::abs(z - 5.0F) < 1e-5F));
  }
  // The same upright.
  Given lying;
  for (int row = 20; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) lying.at(column, row) = row == 20 ? 3.5F : 5.0F;
  CHECK(to_points(lying.image()).report.flying == kWidth);
  DepthConfig off = every_pixel();
  off.edge_m = std::numeric_limits<float>::infinity();
  CHECK(to_points(given.image(), off).report.flying == 0);
}

TEST_CASE("depth image: a slope within the tolerance is no edge") {
  Given given;  // 2 % a pixel
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column)
      given.at(column, row) = static_cast<float>(std::pow(1.02, column));
  CHECK(to_points(given.image()).report.flying == 0);
}

TEST_CASE("depth image: every third pixel of every third row") {
  Given given;
  DepthConfig config = every_pixel();
  config.step_px = 3;
  const Got got = to_points(given.image(), config);
  CHECK(got.report.points == 22 * 16);
  const Got all = to_points(given.image());
  CHECK(got.points[3] == all.points[9]);
  CHECK(got.points[3 * 22 + 1] == all.points[3 * 3 * kWidth + 1]);
}

TEST_CASE("depth image: rows with padding, and no labels") {
  std::vector<float> padded(kHeight * 80, 9.0F);
  for (std::size_t row = 0; row < kHeight; ++row)
    for (std::size_t column = 0; column < kWidth; ++column) padded[row * 80 + column] = 2.0F;
  const Got got = to_points({nullptr, padded.data(), 80, nullptr, 0});
  CHECK(got.report.points == kWidth * kHeight);
  CHECK(got.report.unlabelled == kWidth * kHeight);
  CHECK(got.components[7] == kClasses + 1);
  CHECK(got.points == to_points(Given().image()).points);
}

TEST_CASE("depth image: where the lens sees nothing there is no ray") {
  const CameraModel model =
      *CameraModel::make({CameraKind::kFisheye, kWidth, kHeight, 14.0, 14.0, 31.5, 23.5, {}});
  DepthConfig config = every_pixel();
  const Got along_axis = to_points(Given().image(), config, model);
  CHECK(along_axis.report.no_ray > 100);  // beyond 89.4 degrees
  config.along = DepthAlong::kRay;
  CHECK(to_points(Given().image(), config, model).report.no_ray == 0);
}

TEST_CASE("depth image: arguments out of range do nothing") {
  const Given given;
  const auto status_with = [&](auto change) {
    DepthImage image = given.image();
    change(image);
    return to_points(image).report.status;
  };
  const std::vector<std::uint16_t> millimetres(kWidth * kHeight, 1000);
  CHECK(status_with([](DepthImage& i) { i.metres = nullptr; }) == Status::kInvalidArgument);
  CHECK(status_with([&](DepthImage& i) { i.millimetres = millimetres.data(); }) ==
        Status::kInvalidArgument);
  CHECK(status_with([](DepthImage& i) { i.stride_pixels = kWidth - 1; }) ==
        Status::kInvalidArgument);
  CHECK(status_with([](DepthImage& i) { i.label_stride_bytes = 0; }) == Status::kInvalidArgument);
  std::vector<float> points(10);
  std::vector<std::uint8_t> components(kWidth * kHeight);
  CHECK(DepthCamera().to_points(given.image(), kClasses, points, components).status ==
        Status::kResourceExhausted);
  AlignedMemory memory(DepthCamera::required_bytes(kWidth, kHeight, 1));
  Arena arena = memory.arena();
  const DepthCamera camera = *DepthCamera::make(arena, camera_model(), every_pixel());
  CHECK(camera.to_points(given.image(), kClasses, points, components).status ==
        Status::kInvalidArgument);
  points.resize(3 * camera.most_points());
  CHECK(camera.to_points(given.image(), 0, points, components).status == Status::kInvalidArgument);
  CHECK(camera.to_points(given.image(), 63, points, components).status == Status::kInvalidArgument);
  CHECK(DepthCamera::make(arena, camera_model(), {}).status() == Status::kResourceExhausted);
  const auto refused = [&](auto change) {
    DepthConfig config;
    change(config);
    return DepthCamera::make(arena, camera_model(), config).status() == Status::kInvalidArgument;
  };
  CHECK(refused([](DepthConfig& c) { c.step_px = 0; }));
  CHECK(refused([](DepthConfig& c) { c.step_px = 65; }));
  CHECK(refused([](DepthConfig& c) { c.min_depth_m = 11.0F; }));
  CHECK(refused([](DepthConfig& c) { c.max_depth_m = 1001.0F; }));
  CHECK(refused([](DepthConfig& c) { c.edge_m = kNaN; }));
  CHECK(refused([](DepthConfig& c) { c.edge_share = -0.1F; }));
  CHECK(DepthCamera::make(arena, CameraModel(), {}).status() == Status::kInvalidArgument);
}

}  // namespace
}  // namespace tessera
