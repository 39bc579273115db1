// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// poses.txt of a KITTI sequence: one pose per scan, of the camera in the frame of the first camera.
#pragma once

#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera {

/// Row n is the pose of scan n, exactly as written, rigid and finite or not: registration refuses
/// an absurd pose, so that it costs one scan and not the sequence. Ignores blank lines. Fails with
/// kUsage iff the file cannot be read, a row is not twelve numbers, or check_some_rigid() fails.
Outcome<std::vector<Matrix34d>> read_poses(const std::string& path);

/// Fails with kUsage iff there are poses in this file and none of them is a rigid transform: these
/// are not poses, or have another form than assumed.
Outcome<void> check_some_rigid(const std::string& path, const std::vector<Matrix34d>& poses);

/// T_map_lidar = inv(T_camera_lidar) P T_camera_lidar with P = T_world_camera: the map frame is the
/// LiDAR frame of a scan whose pose is the identity. T_camera_lidar must be invertible; NaN in P
/// stays NaN.
[[nodiscard]] Matrix34d lidar_pose(const Matrix34d& T_camera_lidar,
                                   const Matrix34d& T_world_camera) noexcept;

}  // namespace tessera
