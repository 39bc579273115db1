// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The part of the map in a picture: all of it, unless stray voxels far from the rest would shrink
// the rest. Stray voxels follow from percentiles; others are never cut off.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "pictures/picture.hpp"

namespace tessera {

struct Interval {
  float low = 0.0F;
  float high = 0.0F;
  [[nodiscard]] float span() const { return high - low; }
  [[nodiscard]] float middle() const { return 0.5F * (low + high); }
  [[nodiscard]] bool contains(float value) const { return value >= low && value <= high; }
};

/// The voxels of the views, and the box of those that are not stray.
struct Scene {
  std::span<const RenderVoxel> voxels;
  float resolution_m = 0.0F;
  std::uint64_t drawable = 0;       ///< Voxels for which is_drawable holds.
  std::vector<RenderVoxel> sample;  ///< At most about 200,000 of the drawable ones, evenly sampled.
  Interval x_m;
  Interval y_m;
  Interval z_m;
};

/// Finite, and within 1000 km of the origin, beyond which single precision no longer separates
/// voxels.
[[nodiscard]] bool is_drawable(const RenderVoxel& voxel) noexcept;

[[nodiscard]] Scene make_scene(std::span<const RenderVoxel> voxels, float resolution_m);

/// Beyond this interval a value is stray: from the 2nd to the 98th percentile, widened by half at
/// either end. Reorders values; there must be at least one.
[[nodiscard]] Interval stray_limits(std::vector<float>& values);

/// Grows from empty to the smallest interval of the given values, without those beyond the limits.
class Extent {
 public:
  explicit Extent(Interval limits) : limits_(limits) {}
  void take(float value) {
    if (!limits_.contains(value)) return;
    extremes_ = any_ ? Interval{std::min(extremes_.low, value), std::max(extremes_.high, value)}
                     : Interval{value, value};
    any_ = true;
  }
  [[nodiscard]] Interval interval() const { return extremes_; }

 private:
  Interval limits_;
  Interval extremes_;
  bool any_ = false;
};

/// Orientation of the content in the x-y plane: direction of its longer side, and the ratio of
/// sides.
struct Stretch {
  float direction_rad = 0.0F;  ///< In (-pi/2, pi/2] from the map's x axis; 0 if no side stands out.
  float ratio = 1.0F;          ///< Of standard deviations, in [1, 10].
};

[[nodiscard]] Stretch stretch_of(std::span<const RenderVoxel> sample);

/// The largest of 1, 2, 5, 10, 20, ... (and 0.5, 0.2, ...) that is at most limit_m, which is
/// positive.
[[nodiscard]] float round_length(float limit_m);

}  // namespace tessera
