// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Files with a pose per row, in the usual forms.
#pragma once

#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera {

struct PoseRows {
  std::vector<Matrix34d> T_map_sensor;
  std::vector<double> stamps_s;  ///< Of each pose in the form of TUM; else empty.
};

/// T_map_sensor of each row, by the number of its columns: 12, a row-major 3x4 matrix as in KITTI;
/// 16, a 4x4 matrix whose last row is 0 0 0 1; 8, stamp tx ty tz qx qy qz qw as in TUM, with rising
/// stamps. Ignores blank lines and those that begin with #. A pose that is not rigid or not finite
/// stays so, as in read_poses(); a quaternion within 1 % of unit length is normalised. Fails with
/// kUsage, naming the line, iff the file cannot be read or is over 256 MiB, a row has another
/// number of numbers than these or than the first row, a word is not a number, or
/// check_some_rigid() fails.
Outcome<PoseRows> read_pose_rows(const std::string& path);

}  // namespace tessera
