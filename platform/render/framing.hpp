// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What part of the map a picture shows: all of it, unless stray voxels far from the rest would
// shrink the rest. What is stray follows from percentiles; what is not stray is never cut off.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "render/picture.hpp"

namespace tessera {

struct Interval {
  float low = 0.0F;
  float high = 0.0F;
  [[nodiscard]] float span() const { return high - low; }
  [[nodiscard]] float middle() const { return 0.5F * (low + high); }
  [[nodiscard]] bool contains(float value) const { return value >= low && value <= high; }
};

/// What the views draw, and where all of it is that is not stray.
struct Scene {
  std::span<const RenderVoxel> voxels;
  float resolution_m = 0.0F;
  std::uint64_t drawable = 0;       ///< Of voxels, those for which is_drawable holds.
  std::vector<RenderVoxel> sample;  ///< At most some 200,000 of the drawable ones, evenly picked.
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

/// Grows from nothing to the smallest interval that holds the values given to it, but none beyond
/// the limits.
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

/// How the content lies in the x-y plane: where its longer side points, and how much longer that
/// is.
struct Stretch {
  float direction_rad = 0.0F;  ///< In (-pi/2, pi/2] from the map's x axis; 0 if no side stands out.
  float ratio = 1.0F;          ///< Of standard deviations, in [1, 10].
};

[[nodiscard]] Stretch stretch_of(std::span<const RenderVoxel> sample);

/// The largest of 1, 2, 5, 10, 20, ... (and 0.5, 0.2, ...) that is at most limit_m, which is
/// positive.
[[nodiscard]] float round_length(float limit_m);

}  // namespace tessera
