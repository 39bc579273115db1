// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/framing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tessera {
namespace {

constexpr std::uint64_t kSampleSize = 200'000;
constexpr float kFarthest_m = 1.0e6F;
constexpr double kLowShare = 0.02;
constexpr double kHighShare = 0.98;
constexpr float kWidening = 0.5F;

/// Interval of the cubes along one axis, without stray ones.
Interval extent_along(const Scene& scene, float RenderVoxel::*coordinate) {
  if (scene.sample.empty()) return {};
  std::vector<float> values;
  values.reserve(scene.sample.size());
  for (const RenderVoxel& voxel : scene.sample) values.push_back(voxel.*coordinate);
  Extent extent(stray_limits(values));
  // Of all voxels: the sample would miss the outermost ones.
  for (const RenderVoxel& voxel : scene.voxels) {
    if (is_drawable(voxel)) extent.take(voxel.*coordinate);
  }
  const Interval centres = extent.interval();
  return {centres.low - 0.5F * scene.resolution_m, centres.high + 0.5F * scene.resolution_m};
}

float percentile(std::vector<float>& values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace

bool is_drawable(const RenderVoxel& voxel) noexcept {
  // Comparisons with NaN are false, so this refuses it too.
  return std::abs(voxel.x) <= kFarthest_m && std::abs(voxel.y) <= kFarthest_m &&
         std::abs(voxel.z) <= kFarthest_m;
}

Scene make_scene(std::span<const RenderVoxel> voxels, float resolution_m) {
  Scene scene{.voxels = voxels,
              .resolution_m = resolution_m,
              .drawable = 0,
              .sample = {},
              .x_m = {},
              .y_m = {},
              .z_m = {}};
  for (const RenderVoxel& voxel : voxels) scene.drawable += is_drawable(voxel) ? 1U : 0U;
  const std::uint64_t stride = scene.drawable / kSampleSize + 1;
  std::uint64_t rank = 0;
  for (const RenderVoxel& voxel : voxels) {
    if (is_drawable(voxel) && rank++ % stride == 0) scene.sample.push_back(voxel);
  }
  scene.x_m = extent_along(scene, &RenderVoxel::x);
  scene.y_m = extent_along(scene, &RenderVoxel::y);
  scene.z_m = extent_along(scene, &RenderVoxel::z);
  return scene;
}

Interval stray_limits(std::vector<float>& values) {
  const Interval most{percentile(values, kLowShare), percentile(values, kHighShare)};
  const float widening = kWidening * most.span();
  return {most.low - widening, most.high + widening};
}

Stretch stretch_of(std::span<const RenderVoxel> sample) {
  if (sample.empty()) return {};
  const double n = static_cast<double>(sample.size());
  double sum_x = 0.0;
  double sum_y = 0.0;
  for (const RenderVoxel& voxel : sample) {
    sum_x += static_cast<double>(voxel.x);
    sum_y += static_cast<double>(voxel.y);
  }
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (const RenderVoxel& voxel : sample) {
    const double dx = static_cast<double>(voxel.x) - sum_x / n;
    const double dy = static_cast<double>(voxel.y) - sum_y / n;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
  }
  const double radius = std::hypot(0.5 * (xx - yy), xy);
  const double middle = 0.5 * (xx + yy);
  const double smaller = std::max(middle - radius, 0.0);
  const double larger = middle + radius;
  Stretch stretch;
  if (larger > 0.0) {
    stretch.ratio = static_cast<float>(std::sqrt(larger / std::max(smaller, 0.01 * larger)));
  }
  // Below this ratio the direction is random; the x axis is as good, and the same for similar maps.
  constexpr float kClearRatio = 1.3F;
  if (stretch.ratio > kClearRatio) {
    stretch.direction_rad = static_cast<float>(0.5 * std::atan2(2.0 * xy, xx - yy));
  }
  return stretch;
}

float round_length(float limit_m) {
  const float power = std::pow(10.0F, std::floor(std::log10(limit_m)));
  if (limit_m >= 5.0F * power) return 5.0F * power;
  if (limit_m >= 2.0F * power) return 2.0F * power;
  return power;
}

}  // namespace tessera
