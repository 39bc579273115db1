// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "simulator/street_cameras.hpp"

#include <utility>

namespace tessera::street {
namespace {

constexpr double kDegree = 3.141592653589793 / 180.0;
constexpr double kMaxRange_m = 200.0;

/// Pose of a camera on the scanner (x forward, y left, z up), turned to the left by yaw, down by
/// pitch.
struct Mount {
  Eigen::Vector3d place_m;
  double yaw_deg = 0.0;
  double pitch_deg = 0.0;
};

Eigen::Isometry3d T_camera_sensor(const Mount& mount) {
  Eigen::Matrix3d axes;  // the camera's x right, y down, z forward
  axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Eigen::Isometry3d T_sensor_camera = Eigen::Isometry3d::Identity();
  T_sensor_camera.linear() =
      (Eigen::AngleAxisd(mount.yaw_deg * kDegree, Eigen::Vector3d::UnitZ()) *
       Eigen::AngleAxisd(mount.pitch_deg * kDegree, Eigen::Vector3d::UnitY()))
          .toRotationMatrix() *
      axes;
  T_sensor_camera.translation() = mount.place_m;
  return T_sensor_camera.inverse(Eigen::Isometry);
}

StreetCamera camera_of(std::string name, const CameraIntrinsics& intrinsics, const Mount& mount,
                       double offset_s) {
  StreetCamera camera;
  camera.name = std::move(name);
  camera.model = *CameraModel::make(intrinsics);
  camera.T_camera_sensor = T_camera_sensor(mount);
  camera.offset_s = offset_s;
  constexpr double kMiddle_px = 0.5 * (kLabelStride_px - 1);
  for (int row = 0; row < camera.label_rows(); ++row) {
    for (int column = 0; column < camera.label_columns(); ++column) {
      const Result<Point3d> ray = camera.model.unproject(
          {column * kLabelStride_px + kMiddle_px, row * kLabelStride_px + kMiddle_px});
      camera.rays.emplace_back(ray.ok() ? *ray : Point3d(0.0, 0.0, 0.0));
    }
  }
  return camera;
}

}  // namespace

std::vector<StreetCamera> street_cameras() {
  const CameraIntrinsics left{CameraKind::kPinhole,
                              640,
                              384,
                              432.0,
                              430.0,
                              322.4,
                              189.1,
                              {-0.21, 0.06, 0.0007, -0.0004, -0.006}};
  CameraIntrinsics right = left;
  right.centre_x_px = 316.9;
  right.centre_y_px = 193.6;
  right.distortion = {-0.2, 0.055, -0.0003, 0.0006, -0.005};
  const CameraIntrinsics rear{CameraKind::kFisheye,
                              640,
                              480,
                              195.0,
                              195.6,
                              318.7,
                              242.2,
                              {-0.013, 0.0021, -0.0008, 0.0, 0.0}};
  std::vector<StreetCamera> cameras;
  cameras.push_back(camera_of("front-left", left, {{0.7, 0.35, -0.3}, 33.0, 4.0}, -0.031));
  cameras.push_back(camera_of("front-right", right, {{0.7, -0.35, -0.3}, -33.0, 4.0}, 0.018));
  cameras.push_back(camera_of("rear", rear, {{-0.8, 0.0, -0.2}, 180.0, 10.0}, -0.047));
  return cameras;
}

EchoImage look(const StreetCamera& camera, const Eigen::Isometry3d& T_street_sensor,
               const Scene& scene) {
  const Eigen::Isometry3d T_street_camera =
      T_street_sensor * camera.T_camera_sensor.inverse(Eigen::Isometry);
  EchoImage image;
  image.rows = camera.label_rows();
  image.columns = camera.label_columns();
  image.closes = false;
  image.echoes.resize(camera.rays.size());
  for (std::size_t i = 0; i < camera.rays.size(); ++i) {
    if (camera.rays[i].squaredNorm() < 0.5) continue;
    const Ray ray{T_street_camera.translation(), T_street_camera.linear() * camera.rays[i]};
    Hit hit;
    hit.range_m = kMaxRange_m;
    scene(ray, hit);
    if (hit.range_m >= kMaxRange_m) continue;
    Echo& echo = image.echoes[i];
    echo.range_m = hit.range_m;
    echo.cos_incidence = hit.cos_incidence;
    echo.object = hit.object;
    echo.id = hit.surface.id;
    echo.p_street = ray.origin + hit.range_m * ray.direction;
  }
  return image;
}

}  // namespace tessera::street
