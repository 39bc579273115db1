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

}  // namespace tessera::oracle
