// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Losses follow the returned power: reflectivity times the cosine of incidence over the squared
// range. So far asphalt is lost while far walls are measured.
#include "simulator/lidar.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulator/random.hpp"

namespace tessera::street {
namespace {

constexpr double kMinRange_m = 0.9;
/// Power (1/m^2) at which there is an echo in 63 % of the cases.
constexpr double kPowerScale = 1.6e-6;

double radians(double degrees) { return degrees * (2.0 * std::numbers::pi) / 360.0; }

bool comes_back(const Hit& hit, Random& random) {
  const double power = hit.surface.reflectivity * hit.cos_incidence / (hit.range_m * hit.range_m);
  const bool detected = random.chance(-std::expm1(-power / kPowerScale));
  return !random.chance(hit.surface.loss) && detected;
}

Echo measure(const Hit& hit, const Ray& ray, const LidarModel& model, Random& random) {
  Echo echo;
  echo.range_m =
      std::min(hit.range_m + model.range_sigma_m * std::clamp(random.gaussian(), -4.0, 4.0),
               model.max_range_m);
  echo.cos_incidence = hit.cos_incidence;
  echo.object = hit.object;
  echo.id = hit.surface.id;
  echo.p_street = ray.origin + echo.range_m * ray.direction;
  const double bright =
      hit.surface.reflectivity * (0.75 + 0.35 * hit.cos_incidence) + 0.04 * random.gaussian();
  echo.intensity = static_cast<float>(std::clamp(bright, 0.0, 0.99));
  return echo;
}

}  // namespace

LidarModel lidar_64_beams() {
  LidarModel model;
  for (int i = 0; i < 32; ++i) model.elevations_rad.push_back(radians(2.0 - i / 3.0));
  for (int i = 0; i < 32; ++i)
    model.elevations_rad.push_back(radians(-8.83 - i * (24.8 - 8.83) / 31.0));
  model.azimuth_steps = 2000;
  model.max_range_m = 120.0;
  model.range_sigma_m = 0.02;
  model.height_m = 1.73;
  return model;
}

LidarModel lidar_16_beams() {
  LidarModel model;
  for (int i = 0; i < 16; ++i) model.elevations_rad.push_back(radians(15.0 - 2.0 * i));
  model.azimuth_steps = 1800;
  model.max_range_m = 100.0;
  model.range_sigma_m = 0.025;
  model.height_m = 1.85;
  return model;
}

EchoImage sweep(const LidarModel& model, const Eigen::Isometry3d& T_street_sensor,
                const Scene& scene, std::uint64_t noise) {
  return sweep(
      model, SweepPoses{T_street_sensor},
      [&scene](int, const Ray& ray, Hit& hit) { scene(ray, hit); }, noise);
}

EchoImage sweep(const LidarModel& model, const SweepPoses& T_street_sensor,
                const MovingScene& scene, std::uint64_t noise) {
  EchoImage image;
  image.rows = static_cast<int>(model.elevations_rad.size());
  image.columns = model.azimuth_steps;
  image.echoes.resize(model.elevations_rad.size() * static_cast<std::size_t>(model.azimuth_steps));
  std::size_t pixel = 0;
  for (const double elevation : model.elevations_rad) {
    for (int column = 0; column < image.columns; ++column, ++pixel) {
      const double azimuth = (2.0 * std::numbers::pi) * column / image.columns;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const Eigen::Isometry3d& pose =
          T_street_sensor[T_street_sensor.size() == 1 ? 0 : static_cast<std::size_t>(column)];
      const Ray ray{pose.translation(), pose.linear() * direction};
      Hit hit;
      hit.range_m = model.max_range_m;
      scene(column, ray, hit);
      if (hit.range_m >= model.max_range_m || hit.range_m < kMinRange_m) continue;
      Random random(hash_of(noise, Stream::kBeam, pixel));
      if (!comes_back(hit, random)) continue;
      Echo& echo = image.echoes[pixel];
      echo = measure(hit, ray, model, random);
      echo.p_sensor = echo.range_m * direction;
    }
  }
  return image;
}

}  // namespace tessera::street
