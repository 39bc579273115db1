// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The cameras of the simulated robots: two to the front, one fisheye to the rear, each with lens
// distortion and an image at another time than the scan's.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "simulator/lidar.hpp"
#include "tessera/registration/camera_model.hpp"

namespace tessera::street {

/// A network has one label for this number of pixels on each axis.
inline constexpr int kLabelStride_px = 2;

struct StreetCamera {
  std::string name;
  CameraModel model;
  Eigen::Isometry3d T_camera_sensor = Eigen::Isometry3d::Identity();
  double offset_s = 0.0;  ///< Time of its image, from the scan's stamp.
  /// The directions of the labels in the camera's frame, of length 1, by rows; zero outside of the
  /// lens's view.
  std::vector<Eigen::Vector3d> rays;
  [[nodiscard]] int label_columns() const { return model.width_px() / kLabelStride_px; }
  [[nodiscard]] int label_rows() const { return model.height_px() / kLabelStride_px; }
};

/// front-left, front-right: pinholes of 640 x 384 pixels; rear: a fisheye of 640 x 480.
std::vector<StreetCamera> street_cameras();

/// The first hit of the camera in the direction of each label, without losses and noise.
EchoImage look(const StreetCamera& camera, const Eigen::Isometry3d& T_street_sensor,
               const Scene& scene);

}  // namespace tessera::street
