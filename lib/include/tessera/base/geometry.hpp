// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Fixed-size geometry types. Frames are named at the variable: p_map is a point in the map frame,
// T_map_sensor takes sensor coordinates to map coordinates.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "tessera/base/status.hpp"

namespace tessera {

using Point3f = Eigen::Matrix<float, 3, 1, Eigen::DontAlign>;
using Point3d = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
/// A rigid transform's 3x4 matrix [R | t], row-major as the KITTI files have it.
using Matrix34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor | Eigen::DontAlign>;

/// kOk iff T is rigid: finite, R^T R = I within 1e-3 an entry, det R > 0; else kInvalidArgument.
/// O(1).
[[nodiscard]] inline Status check_rigid(const Matrix34d& T) noexcept {
  if (!T.allFinite()) return Status::kInvalidArgument;
  const Eigen::Matrix3d R = T.leftCols<3>();
  const Eigen::Matrix3d error = R.transpose() * R - Eigen::Matrix3d::Identity();
  constexpr double kTolerance = 1e-3;
  const bool rigid = error.cwiseAbs().maxCoeff() <= kTolerance && R.determinant() > 0.0;
  return rigid ? Status::kOk : Status::kInvalidArgument;
}

}  // namespace tessera
