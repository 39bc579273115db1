// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The scanners in front of a plain wall: directions, noise, losses.
#include "simulator/lidar.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace {

using tessera::street::Echo;
using tessera::street::EchoImage;
using tessera::street::Hit;
using tessera::street::LidarModel;
using tessera::street::RawId;
using tessera::street::Ray;
using tessera::street::surface_of;

/// Everything is range_m away and met at the given incidence.
EchoImage in_a_ball(const LidarModel& model, double range_m, double cos_incidence) {
  const auto scene = [&](const Ray&, Hit& hit) {
    if (range_m < hit.range_m) hit = {range_m, cos_incidence, surface_of(RawId::kRoad), 0};
  };
  return sweep(model, Eigen::Isometry3d::Identity(), scene, 99);
}

double share_returned(const EchoImage& image) {
  double returned = 0.0;
  for (const Echo& echo : image.echoes) returned += echo.returned() ? 1.0 : 0.0;
  return returned / static_cast<double>(image.echoes.size());
}

constexpr double kDegree = 3.141592653589793 / 180.0;

}  // namespace

TEST_CASE("LidarModel: 64 beams from +2 to -24.8 degrees, top first") {
  const LidarModel model = tessera::street::lidar_64_beams();
  REQUIRE(model.elevations_rad.size() == 64);
  CHECK(model.elevations_rad.front() == Approx(2.0 * kDegree));
  CHECK(model.elevations_rad.back() == Approx(-24.8 * kDegree));
  for (std::size_t i = 1; i < 64; ++i) CHECK(model.elevations_rad[i] < model.elevations_rad[i - 1]);
}

TEST_CASE("LidarModel: 16 beams from +15 to -15 degrees, top first") {
  const LidarModel model = tessera::street::lidar_16_beams();
  REQUIRE(model.elevations_rad.size() == 16);
  CHECK(model.elevations_rad.front() == Approx(15.0 * kDegree));
  CHECK(model.elevations_rad.back() == Approx(-15.0 * kDegree));
}

TEST_CASE("Lidar: range noise has the model's standard deviation") {
  const LidarModel model = tessera::street::lidar_64_beams();
  const EchoImage image = in_a_ball(model, 10.0, 1.0);
  double sum = 0.0;
  double square = 0.0;
  double count = 0.0;
  for (const Echo& echo : image.echoes) {
    if (!echo.returned()) continue;
    sum += echo.range_m - 10.0;
    square += (echo.range_m - 10.0) * (echo.range_m - 10.0);
    count += 1.0;
  }
  CHECK(std::abs(sum / count) < 0.001);
  CHECK(std::sqrt(square / count) == Approx(model.range_sigma_m).epsilon(0.05));
}

TEST_CASE("Lidar: some echoes are lost at random even nearby") {
  const double share = share_returned(in_a_ball(tessera::street::lidar_16_beams(), 10.0, 1.0));
  CHECK(share < 0.995);
  CHECK(share > 0.9);
}

TEST_CASE("Lidar: more echoes are lost far away") {
  const LidarModel model = tessera::street::lidar_16_beams();
  CHECK(share_returned(in_a_ball(model, 90.0, 0.05)) <
        0.8 * share_returned(in_a_ball(model, 40.0, 0.05)));
}

TEST_CASE("Lidar: more echoes are lost at grazing incidence") {
  const LidarModel model = tessera::street::lidar_16_beams();
  CHECK(share_returned(in_a_ball(model, 60.0, 0.02)) <
        0.8 * share_returned(in_a_ball(model, 60.0, 0.5)));
}

TEST_CASE("Lidar: nothing returns from beyond the model's range") {
  const LidarModel model = tessera::street::lidar_16_beams();
  CHECK(share_returned(in_a_ball(model, model.max_range_m + 0.01, 1.0)) == Approx(0.0));
}
