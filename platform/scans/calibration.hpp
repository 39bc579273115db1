// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// calib.txt of a KITTI sequence: only its line "Tr:" is used, the pose of the LiDAR in the camera.
#pragma once

#include <string>

#include "base/outcome.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera {

/// T_camera_lidar, rigid within 1e-3. The identity if the file does not exist (then the poses are
/// in the LiDAR frame). Fails with kUsage iff the file cannot be read, has no Tr line or several,
/// or that line is not twelve numbers or not a rigid transform.
Outcome<Matrix34d> read_calibration(const std::string& path);

}  // namespace tessera
