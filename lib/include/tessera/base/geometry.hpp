// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Fixed-size geometry types. Frames are named at the variable: p_map is a point in the map frame,
// T_map_sensor takes sensor coordinates to map coordinates.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "tessera/base/internal/rounding.hpp"
#include "tessera/base/status.hpp"

namespace tessera {

using Point3f = Eigen::Matrix<float, 3, 1, Eigen::DontAlign>;
using Point3d = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
/// A rigid transform's 3x4 matrix [R | t], row-major as the KITTI files have it.
using Matrix34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor | Eigen::DontAlign>;

/// The nearest point in floats. Not p.cast<float>(), which gcc 12 may drop
/// (base/internal/rounding.hpp).
[[nodiscard]] inline Point3f round_to_float(const Point3d& p) noexcept {
  return {round_to_float(p.x()), round_to_float(p.y()), round_to_float(p.z())};
}
/// The same point in doubles, rounded to floats even where the compiler sees doubles behind it.
[[nodiscard]] inline Point3d widen(const Point3f& p) noexcept {
  return {static_cast<double>(opaque(p.x())), static_cast<double>(opaque(p.y())),
          static_cast<double>(opaque(p.z()))};
}

/// x^2 + y^2 + z^2, summed in this order whatever the compiler and its vector unit: Eigen's own
/// sums differ in their last bit from one to the other, and a map's digest with them.
[[nodiscard]] constexpr double squared_norm(double x, double y, double z) noexcept {
  return x * x + y * y + z * z;
}
[[nodiscard]] inline double squared_norm(const Point3d& v) noexcept {
  return squared_norm(v.x(), v.y(), v.z());
}
/// sqrt is correctly rounded by IEEE 754, so the same everywhere.
[[nodiscard]] inline double norm(const Point3d& v) noexcept { return std::sqrt(squared_norm(v)); }

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
