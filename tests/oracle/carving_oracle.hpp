// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which voxels a segment pierces, by testing every voxel of its bounding box against the three
// slabs in double precision; and where carving a ray ends, by measuring the angle to every return.
#pragma once

#include <set>
#include <span>

#include "oracle/label_oracle.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera::oracle {

using Vector = std::array<double, 3>;

[[nodiscard]] inline Vector vector_of(const Point3f& p) {
  return {static_cast<double>(p.x()), static_cast<double>(p.y()), static_cast<double>(p.z())};
}
/// A sensor there, turned as the map is.
[[nodiscard]] inline Matrix34d pose_at(const Vector& p) {
  Matrix34d T = Matrix34d::Identity();
  T.col(3) = Eigen::Vector3d(p[0], p[1], p[2]);
  return T;
}

/// What a set of segments pierces. Voxels of possible but not of certain are touched within 1e-9 of
/// an edge or corner.
struct Pierced {
  std::set<Voxel> certain;
  std::set<Voxel> possible;

  /// Adds the voxels of a grid of voxel_m that the segment from a to b passes through. O(box
  /// volume).
  void add(const Vector& a, const Vector& b, double voxel_m);
};

/// The range from origin of the nearest return whose direction is within angle_rad of that of
/// toward; 1e300 if there is none. O(returns).
[[nodiscard]] double nearest_within(std::span<const Vector> returns, const Vector& origin,
                                    const Vector& toward, double angle_rad);

/// The point of the segment from origin to toward at length_m from origin, at most toward itself;
/// origin if length_m is not positive.
[[nodiscard]] Vector point_along(const Vector& origin, const Vector& toward, double length_m);

}  // namespace tessera::oracle
