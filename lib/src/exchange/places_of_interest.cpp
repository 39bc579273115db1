// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/places_of_interest.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {

namespace {

/// A voxel goes to those that have a point of it in them, and so no further than a voxel.
constexpr double kSpreadVoxels = 1.0;

}  // namespace

WorldBox world_box(const BlockExtent& extent, const Matrix34d& T_global_map,
                   double resolution_m) noexcept {
  const double edge_m = kBlockEdge * resolution_m;
  const std::array<double, 3> low{edge_m * extent.low.x, edge_m * extent.low.y,
                                  edge_m * extent.low.z};
  const std::array<double, 3> high{edge_m * (extent.high.x + 1.0), edge_m * (extent.high.y + 1.0),
                                   edge_m * (extent.high.z + 1.0)};
  WorldBox box;
  for (Eigen::Index row = 0; row < 3; ++row) {
    double center = T_global_map(row, 3);
    double half = kSpreadVoxels * resolution_m;
    for (Eigen::Index column = 0; column < 3; ++column) {
      const auto axis = static_cast<std::size_t>(column);
      center += T_global_map(row, column) * (low[axis] + high[axis]) / 2.0;
      half += std::abs(T_global_map(row, column)) * (high[axis] - low[axis]) / 2.0;
    }
    const auto axis = static_cast<std::size_t>(row);
    box.low[axis] = center - half;
    box.high[axis] = center + half;
  }
  return box;
}

void PlacesOfInterest::set(std::span<const Point3d> p_global, double radius_m) noexcept {
  count_ = std::min(p_global.size(), kMost);
  std::copy_n(p_global.begin(), count_, p_global_.begin());
  radius_m_ = radius_m;
}

double PlacesOfInterest::distance_m(const WorldBox& box) const noexcept {
  if (count_ == 0) return 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (const Point3d& place : std::span(p_global_).first(count_)) {
    double square = 0.0;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      const double below = box.low[axis] - place(i);
      const double above = place(i) - box.high[axis];
      const double gap = std::max({below, above, 0.0});
      square += gap * gap;
    }
    least = std::min(least, square);
  }
  return std::sqrt(least) - radius_m_;
}

}  // namespace tessera
