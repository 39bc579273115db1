// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/base/rigid.hpp"

#include "tessera/base/internal/quaternion.hpp"

namespace tessera {

/// The part that is divided by is the largest of the four, so at least a half.
Quaternion rotation_of(const Matrix34d& T) noexcept {
  const double trace = T(0, 0) + T(1, 1) + T(2, 2);
  Quaternion q;
  if (trace > 0.0) {
    q = {1.0 + trace, T(2, 1) - T(1, 2), T(0, 2) - T(2, 0), T(1, 0) - T(0, 1)};
  } else {
    int i = T(1, 1) > T(0, 0) ? 1 : 0;
    if (T(2, 2) > T(i, i)) i = 2;
    const int j = (i + 1) % 3;
    const int k = (j + 1) % 3;
    q[0] = T(k, j) - T(j, k);
    q[static_cast<std::size_t>(i + 1)] = 1.0 + T(i, i) - T(j, j) - T(k, k);
    q[static_cast<std::size_t>(j + 1)] = T(j, i) + T(i, j);
    q[static_cast<std::size_t>(k + 1)] = T(k, i) + T(i, k);
  }
  normalise(q);
  return q;
}

Matrix34d transform_of(const Quaternion& q, const Point3d& translation) noexcept {
  const auto [w, x, y, z] = q;
  Matrix34d T;
  T << 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
      translation.x(),  //
      2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
      translation.y(),  //
      2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y), translation.z();
  return T;
}

std::size_t largest_of(const Quaternion& q) noexcept {
  std::size_t largest = 0;
  for (std::size_t i = 1; i < q.size(); ++i) {
    if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
  }
  return largest;
}

ThreeParts without_part(const Quaternion& q, std::size_t part, std::int32_t steps) noexcept {
  ThreeParts parts;
  parts.largest = static_cast<std::uint8_t>(part);
  const double scale = q[part] < 0.0 ? -steps : steps;
  std::size_t next = 0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (i != part) parts.steps[next++] = nearest_step(scale * q[i]);
  }
  return parts;
}

bool with_largest(const ThreeParts& parts, std::int32_t steps, Quaternion& q) noexcept {
  constexpr double kRootOfHalf = 0.70710678118654752;  // No part but the largest is over it.
  const auto most = static_cast<std::int32_t>(kRootOfHalf * steps) + 1;
  if (parts.largest >= q.size()) return false;
  double rest = 1.0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (i == parts.largest) continue;
    const std::int32_t part = parts.steps[next++];
    if (part < -most || part > most) return false;
    q[i] = static_cast<double>(part) / steps;
    rest -= q[i] * q[i];
  }
  // The largest of four parts is at least a half, but for what rounding takes.
  if (!(rest >= 0.2499)) return false;
  q[parts.largest] = std::sqrt(rest);
  normalise(q);
  return true;
}

namespace {

/// sin(share a) / sin(a) from the cosine of a, 0 .. 1, without a sine: the series in (cosine - 1)
/// whose terms have the ratio (share^2 / (n (2n + 1)) - n / (2n + 1)) (cosine - 1). The ratio is
/// under a half in size, so what is left out is less than the last term: 2^-24 of the sum for a
/// right angle, 1e-20 for half of one.
double slerp_weight(double share, double cosine) noexcept {
  constexpr int kTerms = 24;
  const double x = cosine - 1.0;
  double nested = 1.0;
  for (int n = kTerms; n >= 1; --n) {
    const double odd = 2.0 * n + 1.0;
    nested = 1.0 + (share * share / (n * odd) - n / odd) * x * nested;
  }
  return share * nested;
}

Quaternion slerp(const Quaternion& from, Quaternion to, double share) noexcept {
  double cosine = dot(from, to);
  if (cosine < 0.0) {  // The same rotation, and the shorter way to it.
    for (double& part : to) part = -part;
    cosine = -cosine;
  }
  if (cosine > 1.0) cosine = 1.0;  // rounding
  const double weight_from = slerp_weight(1.0 - share, cosine);
  const double weight_to = slerp_weight(share, cosine);
  Quaternion q;
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = weight_from * from[i] + weight_to * to[i];
  normalise(q);
  return q;
}

}  // namespace

Matrix34d interpolate(const Matrix34d& from, const Matrix34d& to, double share) noexcept {
  Matrix34d T = transform_of(slerp(rotation_of(from), rotation_of(to), share), Point3d::Zero());
  for (int row = 0; row < 3; ++row) T(row, 3) = from(row, 3) + share * (to(row, 3) - from(row, 3));
  return T;
}

}  // namespace tessera
