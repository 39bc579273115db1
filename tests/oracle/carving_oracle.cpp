// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "oracle/carving_oracle.hpp"

#include <algorithm>
#include <cmath>

namespace tessera::oracle {

namespace {

/// The part of the segment, in metres, inside the voxel grown by margin_m on all sides; negative if
/// there is none.
double length_inside(const Vector& a, const Vector& b, const Voxel& voxel, double voxel_m,
                     double margin_m) {
  double enter = 0.0;
  double leave = 1.0;
  double square = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double low = static_cast<double>(voxel[i]) * voxel_m - margin_m;
    const double high = static_cast<double>(voxel[i] + 1) * voxel_m + margin_m;
    const double d = b[i] - a[i];
    square += d * d;
    if (std::abs(d) < 1e-300) {
      if (a[i] <= low || a[i] >= high) return -1.0;
      continue;
    }
    enter = std::max(enter, std::min((low - a[i]) / d, (high - a[i]) / d));
    leave = std::min(leave, std::max((low - a[i]) / d, (high - a[i]) / d));
  }
  return (leave - enter) * std::sqrt(square);
}

Vector from_to(const Vector& a, const Vector& b) { return {b[0] - a[0], b[1] - a[1], b[2] - a[2]}; }

double length(const Vector& v) { return std::hypot(v[0], v[1], v[2]); }

}  // namespace

void Pierced::add(const Vector& a, const Vector& b, double voxel_m) {
  constexpr double kGrazing = 1e-9;
  const Voxel from = cell_of(a, voxel_m);
  const Voxel to = cell_of(b, voxel_m);
  const auto low = [&](std::size_t i) { return std::min(from[i], to[i]) - 1; };
  const auto high = [&](std::size_t i) { return std::max(from[i], to[i]) + 1; };
  for (std::int64_t z = low(2); z <= high(2); ++z) {
    for (std::int64_t y = low(1); y <= high(1); ++y) {
      for (std::int64_t x = low(0); x <= high(0); ++x) {
        const Voxel voxel{x, y, z};
        if (length_inside(a, b, voxel, voxel_m, kGrazing) < 0.0) continue;
        possible.insert(voxel);
        if (length_inside(a, b, voxel, voxel_m, -kGrazing) > 0.0) certain.insert(voxel);
      }
    }
  }
}

double nearest_within(std::span<const Vector> returns, const Vector& origin, const Vector& toward,
                      double angle_rad) {
  const Vector d = from_to(origin, toward);
  double nearest_m = 1e300;
  for (const Vector& p : returns) {
    const Vector e = from_to(origin, p);
    const Vector cross{d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2],
                       d[0] * e[1] - d[1] * e[0]};
    const double dot = d[0] * e[0] + d[1] * e[1] + d[2] * e[2];
    if (std::atan2(length(cross), dot) <= angle_rad) nearest_m = std::min(nearest_m, length(e));
  }
  return nearest_m;
}

Vector point_along(const Vector& origin, const Vector& toward, double length_m) {
  const Vector d = from_to(origin, toward);
  const double part = std::clamp(length_m / length(d), 0.0, 1.0);
  return {origin[0] + part * d[0], origin[1] + part * d[1], origin[2] + part * d[2]};
}

}  // namespace tessera::oracle
