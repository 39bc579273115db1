// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Fixed-size geometry types. Frames are named at the variable: p_map is a point in the map frame,
// T_map_sensor takes sensor coordinates to map coordinates.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tessera {

using Point3f = Eigen::Matrix<float, 3, 1, Eigen::DontAlign>;
using Point3d = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
/// A rigid transform's 3x4 matrix [R | t], row-major as the KITTI files have it.
using Matrix34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor | Eigen::DontAlign>;

}  // namespace tessera
