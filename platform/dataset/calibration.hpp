// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// calib.txt of a KITTI sequence: of all its lines only "Tr:", the LiDAR's place on the camera.
#pragma once

#include <string>

#include "posix/outcome.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera {

/// T_camera_lidar, rigid within 1e-3. The identity if there is no such file (the poses are in the
/// LiDAR frame then). Fails with kUsage iff the file cannot be read, has no Tr line or several, or
/// that line is not twelve numbers or not a rigid transform.
Outcome<Matrix34d> read_calibration(const std::string& path);

}  // namespace tessera
