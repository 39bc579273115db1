// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rotations as quaternions, the same to the last bit in every build.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "tessera/base/geometry.hpp"

namespace tessera {

/// w x y z.
using Quaternion = std::array<double, 4>;

[[nodiscard]] inline double dot(const Quaternion& a, const Quaternion& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}
inline void normalise(Quaternion& q) noexcept {
  const double length = std::sqrt(dot(q, q));
  for (double& part : q) part /= length;
}
/// Of a rigid transform; of length 1.
[[nodiscard]] Quaternion rotation_of(const Matrix34d& T) noexcept;
/// The rotation of a quaternion of length 1, and this translation.
[[nodiscard]] Matrix34d transform_of(const Quaternion& q, const Point3d& translation) noexcept;

}  // namespace tessera
