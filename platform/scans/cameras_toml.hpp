// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// cameras.toml: the cameras of a robot, their poses on it, and the folders of their label images.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"
#include "tessera/registration/camera_model.hpp"
#include "tessera/registration/depth_image.hpp"
#include "tessera/registration/label_projection.hpp"

namespace tessera {

struct CameraDescription {
  std::string name;    ///< Not empty, unique.
  std::string folder;  ///< Of its images NNNNNN.png, in the dataset; may be empty.
  std::string mask;    ///< A PNG that is 0 where the camera sees the robot itself; empty: none.
  CameraModel model;
  Matrix34d T_camera_lidar = Matrix34d::Identity();  ///< Rigid; camera x right, y down, z forward.
  std::int64_t offset_us = 0;                        ///< From the scan's stamp to the image's.
};

/// The [[camera]] entries, in their order: name, model ("pinhole" or "fisheye"), width, height,
/// focal = [x, y], centre = [x, y], T_camera_lidar = 3x4 by rows (metres); and optionally
/// folder, mask, distortion (k1 k2 p1 p2 k3, a pinhole's last or last three may be left out; k1 k2
/// k3 k4), stamp_offset (seconds). path: for messages. Fails with kUsage, naming file, line and
/// remedy, iff it is not TOML, a key is missing, unknown or has a wrong value, a model is refused
/// (CameraModel::make), or there are no cameras or more than kMostCameras.
Outcome<std::vector<CameraDescription>> parse_cameras(std::string_view text,
                                                      const std::string& path);
/// The same from a file. Fails as parse_cameras and read_text_file do.
Outcome<std::vector<CameraDescription>> read_cameras(const std::string& path);

/// The camera of depth images.
struct DepthCameraDescription {
  CameraModel model;
  DepthConfig depth;             ///< Every pixel is sampled unless step says otherwise.
  double depth_scale_m = 0.001;  ///< Metres of one unit of a depth image.
};

/// Keys without a table: model, width, height, focal, centre and distortion as above, depth_scale
/// (metres, 1e-6 to 1); and optionally depth_along ("axis", or "ray"), step (pixels, 1 to
/// 64), min_depth and max_depth (metres, 0 to 1000). Fails with kUsage as parse_cameras does, and
/// iff max_depth is less than min_depth.
Outcome<DepthCameraDescription> parse_depth_camera(std::string_view text, const std::string& path);
/// The same from a file. Fails as parse_depth_camera and read_text_file do.
Outcome<DepthCameraDescription> read_depth_camera(const std::string& path);

}  // namespace tessera
