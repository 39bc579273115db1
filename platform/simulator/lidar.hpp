// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Spinning laser scanners: directions, noise, and lost echoes. A scan is taken at one instant, as
// in data sets that are corrected for motion, or while the vehicle drives, as from the scanner.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "simulator/primitive.hpp"

namespace tessera::street {

struct LidarModel {
  std::vector<double> elevations_rad;  ///< Top beam first.
  int azimuth_steps = 0;
  double max_range_m = 0.0;
  double range_sigma_m = 0.0;
  double height_m = 0.0;  ///< Height of the sensor above the road.
};

/// 64 beams from +2 to -24.8 degrees, denser in the upper half; 2000 steps per turn; 120 m.
LidarModel lidar_64_beams();
/// 16 beams from +15 to -15 degrees; 1800 steps per turn; 100 m.
LidarModel lidar_16_beams();

/// One direction of the scan. range_m is kNoHit without a return.
struct Echo {
  double range_m = kNoHit;
  double cos_incidence = 1.0;
  float intensity = 0.0F;
  std::uint32_t object = 0;
  RawId id = RawId::kUnlabelled;
  Eigen::Vector3d p_street = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_sensor = Eigen::Vector3d::Zero();
  [[nodiscard]] bool returned() const { return range_m < kNoHit; }
};

/// Echoes as an image: a row per beam (top first), a column per azimuth step, from straight ahead
/// turning left.
struct EchoImage {
  int rows = 0;
  int columns = 0;
  bool closes = true;  ///< The last column is next to the first.
  std::vector<Echo> echoes;
  [[nodiscard]] const Echo& at(int row, int column) const {
    return echoes[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(column)];
  }
};

/// Finds what a ray hits first within its range; hit.range_m is the limit on input.
using Scene = std::function<void(const Ray& ray, Hit& hit)>;

/// Poses of the sensor at the times of its columns: one for all, or one per column.
using SweepPoses = std::vector<Eigen::Isometry3d>;
/// As a Scene, at the time of a column.
using MovingScene = std::function<void(int column, const Ray& ray, Hit& hit)>;

/// The sensor moves while it turns: each echo's p_sensor is in the sensor's frame at the echo's own
/// time. Noise and losses as below.
EchoImage sweep(const LidarModel& model, const SweepPoses& T_street_sensor,
                const MovingScene& scene, std::uint64_t noise);

/// Noise and losses are drawn only from `noise` and the beam's place in the image.
EchoImage sweep(const LidarModel& model, const Eigen::Isometry3d& T_street_sensor,
                const Scene& scene, std::uint64_t noise);

}  // namespace tessera::street
