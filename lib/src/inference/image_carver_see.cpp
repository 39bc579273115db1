// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The images of a scan's returns.
#include <algorithm>
#include <bit>
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
  image_.add_hits(points.returns(), origin_map_);
  const double ends_before_m = ends_of_no_return_before(config);
  for (const ScanPoint& point : points.returns_beyond()) {
    const Point3d d = from_sensor(point);
    image_.add(d, point.component == kSightEnds || norm(d) < ends_before_m);
  }
  image_.finish();
}

bool ImageCarver::sees_through(const Point3f& p_map, float margin_voxels) const noexcept {
  const Point3d d = p_map.cast<double>() - origin_map_;
  int axis = 0;
  for (int i = 1; i < 3; ++i) axis = std::abs(d[i]) > std::abs(d[axis]) ? i : axis;
  const int face = 2 * axis + (d[axis] < 0.0 ? 1 : 0);
  const double depth_m = std::abs(d[axis]);
  const CarveImage::Rows& rows = image_.rows(face);
  if (!(depth_m >= resolution_m_) || !rows.any() || squared_norm(d) > range_m_ * range_m_)
    return false;
  const std::array<int, 2> across = axes_across(axis);
  const auto column = static_cast<int>(CarveImage::pixel(d[across[0]] / depth_m));
  const auto row = static_cast<int>(CarveImage::pixel(d[across[1]] / depth_m));
  if (row < rows.first || row > rows.last) return false;
  const double margin_m = static_cast<double>(margin_voxels) * resolution_m_;
  return image_.seen(face, SeenBy::kAll)[row * CarveImage::kEdge + column] >=
         image_.threshold(depth_m + margin_m);
}

bool ImageCarver::in_reach(BlockCoord block) const noexcept {
  const Box box = box_of({block, 0});
  const double reach_m = range_m_ + kBlockEdge * resolution_m_;
  return squared_norm(0.5 * (box.low + box.high)) <= reach_m * reach_m;
}

void ImageCarver::keep_in_range(const Point3d& first_m, int axis,
                                std::array<std::uint64_t, kBlockEdge>& words) const noexcept {
  const std::array<int, 2> across = axes_across(axis);
  const auto square = [&](int at_axis, int i) {
    const double at_m = first_m[at_axis] + i * resolution_m_;
    return at_m * at_m;
  };
  for (int slab = 0; slab < kBlockEdge; ++slab) {
    std::uint64_t& word = words[static_cast<std::size_t>(slab)];
    std::uint64_t bits = word;
    for (; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      const double square_m2 =
          square(axis, slab) + square(across[0], bit & 7) + square(across[1], bit >> 3);
      if (square_m2 > range_m_ * range_m_) word &= ~(std::uint64_t{1} << bit);
    }
  }
}

}  // namespace tessera
