// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The images of a scan's returns.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tessera/inference/internal/image_carver.hpp"

namespace tessera {

namespace {

/// Rays without a return that are shorter than this end before the range limit, and nothing is
/// known behind them; 0: none does. Others than those lie at the limit, where there is one.
double ends_of_no_return_before(const InferenceConfig& config) noexcept {
  const auto no_return_m = static_cast<double>(config.no_return_range_m);
  const auto max_m = static_cast<double>(config.max_range_m);
  if (!(max_m > 0.0)) return std::numeric_limits<double>::infinity();
  return no_return_m > 0.0 && no_return_m < max_m ? 0.5 * (no_return_m + max_m) : 0.0;
}

}  // namespace

void ImageCarver::see(const ScanPoints& points, const InferenceConfig& config) noexcept {
  origin_map_ = points.origin_map();
  const auto from_sensor = [this](const ScanPoint& point) -> Point3d {
    return point.p_map.cast<double>() - origin_map_;
  };
  // Those beyond the range limit lie at it.
  double square_m2 = 0.0;
  for (const std::span<const ScanPoint> all : {points.returns(), points.returns_beyond()}) {
    for (const ScanPoint& point : all)
      square_m2 = std::max(square_m2, squared_norm(from_sensor(point)));
  }
  range_m_ = std::sqrt(square_m2);
  image_.begin(std::max(range_m_, 1e-3), config.free_space.neighbour_pixels);
  for (const ScanPoint& point : points.returns()) image_.add(from_sensor(point), true);
  const double ends_before_m = ends_of_no_return_before(config);
  for (const ScanPoint& point : points.returns_beyond()) {
    const Point3d d = from_sensor(point);
    image_.add(d, point.component == kSightEnds || norm(d) < ends_before_m);
  }
  image_.finish();
}

}  // namespace tessera
