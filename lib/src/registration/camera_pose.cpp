// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/registration/camera_pose.hpp"

#include "tessera/base/rigid.hpp"

namespace tessera {

Result<Matrix34d> camera_from_lidar(const PoseTrack& track, const CameraMount& mount,
                                    std::int64_t image_us, std::int64_t scan_us,
                                    std::int64_t max_gap_us) noexcept {
  if (image_us == scan_us) return product(mount.T_camera_body, mount.T_body_lidar);
  const Result<Matrix34d> T_map_image = track.at(image_us, max_gap_us);
  if (!T_map_image.ok()) return T_map_image.status();
  const Result<Matrix34d> T_map_scan = track.at(scan_us, max_gap_us);
  if (!T_map_scan.ok()) return T_map_scan.status();
  const Matrix34d T_image_scan = product(inverse(*T_map_image), *T_map_scan);
  return product(mount.T_camera_body, product(T_image_scan, mount.T_body_lidar));
}

}  // namespace tessera
