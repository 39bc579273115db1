// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/boxes_in_sectors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tessera/base/rigid.hpp"

namespace tessera {

void add_box(const PlacedBox& one, const Matrix34d& T_map_body, const ObstacleSectorsConfig& config,
             std::span<SectorReport> sectors) {
  constexpr double kStep_m = 0.2;
  const Matrix34d T_map_box = inverse(one.T_box_map);
  const Point3d body = T_map_body.col(3);
  const double level = std::hypot(T_map_body(0, 0), T_map_body(1, 0));
  if (sectors.empty() || !(level > 0.0)) return;
  const double ahead_x = T_map_body(0, 0) / level;
  const double ahead_y = T_map_body(1, 0) / level;
  // Corners from the body, at half of the height; and the heights of all.
  std::array<Point3d, 4> corners;
  double low_m = 1e9;
  double high_m = -1e9;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const double x = static_cast<double>(i == 1 || i == 2 ? one.box.high[0] : one.box.low[0]);
    const double y = static_cast<double>(i >= 2 ? one.box.high[1] : one.box.low[1]);
    const auto bottom = static_cast<double>(one.box.low[2]);
    const auto top = static_cast<double>(one.box.high[2]);
    corners[i] = apply(T_map_box, {x, y, 0.5 * (bottom + top)}) - body;
    for (const double z : {bottom, top}) {
      const double at_m = apply(T_map_box, {x, y, z}).z() - body.z();
      low_m = std::min(low_m, at_m);
      high_m = std::max(high_m, at_m);
    }
  }
  if (high_m < config.min_height_m || low_m > config.max_height_m) return;
  const auto count = static_cast<int>(sectors.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Point3d side = corners[(i + 1) % corners.size()] - corners[i];
    const int steps = static_cast<int>(std::ceil(norm(side) / kStep_m));
    for (int k = 0; k < steps; ++k) {
      const Point3d p = corners[i] + side * (static_cast<double>(k) / steps);
      const double distance_m = std::max(std::hypot(p.x(), p.y()) - 0.5 * kStep_m, 0.0);
      if (distance_m > config.max_range_m) continue;
      const double angle =
          std::atan2(p.y() * ahead_x - p.x() * ahead_y, p.x() * ahead_x + p.y() * ahead_y);
      const int number =
          static_cast<int>(std::floor(angle * count / (2.0 * std::numbers::pi) + 0.5));
      SectorReport& sector = sectors[static_cast<std::size_t>((number + count) % count)];
      const auto meters = static_cast<float>(distance_m);
      if (!sector.available) continue;
      sector.free_up_to_m = std::min(sector.free_up_to_m, meters);
      if (sector.occupied && sector.distance_m <= meters) continue;
      sector.occupied = true;
      sector.label = 0;
      sector.distance_m = meters;
      sector.occupancy = 1.0F;
    }
  }
}

}  // namespace tessera
