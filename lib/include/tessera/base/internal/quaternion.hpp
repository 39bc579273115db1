// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rotations as quaternions, the same to the last bit in every build.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

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

/// To the nearest whole number, halves away from 0. value: within what an int32 holds.
[[nodiscard]] inline std::int32_t nearest_step(double value) noexcept {
  return static_cast<std::int32_t>(value < 0.0 ? value - 0.5 : value + 0.5);
}

/// A quaternion of length 1 without its largest part, which is positive; the others in steps, in
/// the order w x y z.
struct ThreeParts {
  std::array<std::int32_t, 3> steps{};
  std::uint8_t largest = 0;  ///< Which part is left out.
};
/// The index of the first of the largest parts.
[[nodiscard]] std::size_t largest_of(const Quaternion& q) noexcept;
/// Without this part, which is not 0; to the nearest of so many steps to 1.
[[nodiscard]] ThreeParts without_part(const Quaternion& q, std::size_t part,
                                      std::int32_t steps) noexcept;
/// Of length 1. False iff there is no such part, one of the three is over the square root of a
/// half, or the fourth is under a half, each but for rounding. steps: at least 2^14.
[[nodiscard]] bool with_largest(const ThreeParts& parts, std::int32_t steps,
                                Quaternion& q) noexcept;

}  // namespace tessera
