// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Cameras with one label throughout, and a projector for a few points.
#pragma once

#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <limits>
#include <vector>

#include "support/aligned_memory.hpp"
#include "tessera/registration/label_projection.hpp"

namespace tessera::test {

inline constexpr int kClasses = 9;
inline constexpr std::uint8_t kUnlabelled = kClasses + 1;
inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// The scanner's x forward, y left, z up to the camera's x right, y down, z forward; the camera at
/// p_lidar, turned to the left by yaw.
inline Matrix34d looking(double yaw_rad, const Eigen::Vector3d& p_lidar = Eigen::Vector3d::Zero()) {
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

inline Projected project(const Points& points, const std::vector<LabelCamera>& cameras,
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

}  // namespace tessera::test
