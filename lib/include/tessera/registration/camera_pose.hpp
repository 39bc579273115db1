// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where a camera was, seen from a scan, when it took its image at another time than the scan.
#pragma once

#include <cstdint>

#include "tessera/registration/pose_track.hpp"

namespace tessera {

/// Where the sensors sit on the robot.
struct CameraMount {
  Matrix34d T_camera_body = Matrix34d::Identity();
  Matrix34d T_body_lidar = Matrix34d::Identity();
};

/// T_camera_lidar from the scanner at scan_us to the camera at image_us, for what stands still:
/// T_camera_body T_map_body(image_us)^-1 T_map_body(scan_us) T_body_lidar. At equal stamps the
/// track is not asked. Fails with kOutOfRange iff the track has no pose at one of the stamps
/// (PoseTrack::at). O(log track.size()).
[[nodiscard]] Result<Matrix34d> camera_from_lidar(const PoseTrack& track, const CameraMount& mount,
                                                  std::int64_t image_us, std::int64_t scan_us,
                                                  std::int64_t max_gap_us) noexcept;

}  // namespace tessera
