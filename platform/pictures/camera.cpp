// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/camera.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace tessera {
namespace {

/// Eye distance as a multiple of the content's diagonal: smaller exaggerates the foreground, larger
/// flattens the scene.
constexpr float kDistance = 1.1F;
constexpr float kMargin = 0.02F;
constexpr float kMinHeightShare = 0.3F;

void aim(Camera& camera, float heading_rad, float elevation_rad) {
  const float ch = std::cos(heading_rad);
  const float sh = std::sin(heading_rad);
  const float ce = std::cos(elevation_rad);
  const float se = std::sin(elevation_rad);
  camera.forward = {ce * ch, ce * sh, -se};
  camera.right = {sh, -ch, 0.0F};
  camera.up = {se * ch, se * sh, ce};
}

/// Place of the content in a picture with one pixel per unit slope.
struct Slopes {
  Interval across;
  Interval down;
};

Slopes slopes_of(const Scene& scene, const Camera& unscaled) {
  std::vector<float> across;
  std::vector<float> down;
  for (const RenderVoxel& voxel : scene.sample) {
    const std::optional<PixelPoint> slope = unscaled.pixel_of(voxel);
    if (!slope) continue;
    across.push_back(slope->x);
    down.push_back(slope->y);
  }
  if (across.empty()) return {};
  Extent x(stray_limits(across));
  Extent y(stray_limits(down));
  for (const RenderVoxel& voxel : scene.voxels) {
    if (!is_drawable(voxel)) continue;
    const std::optional<PixelPoint> slope = unscaled.pixel_of(voxel);
    if (!slope) continue;
    x.take(slope->x);
    y.take(slope->y);
  }
  return {x.interval(), y.interval()};
}

}  // namespace

std::optional<PixelPoint> Camera::pixel_of(const RenderVoxel& voxel) const {
  const Vector3 d{voxel.x - eye_m.x, voxel.y - eye_m.y, voxel.z - eye_m.z};
  const float depth_m = dot(d, forward);
  if (depth_m < near_m) return std::nullopt;
  return pixel_of(d, depth_m);
}

bool Camera::shows(const RenderVoxel& voxel) const {
  const std::optional<PixelPoint> at = pixel_of(voxel);
  return at && at->x >= 0.0F && at->y >= 0.0F && at->x < static_cast<float>(width_px) &&
         at->y < static_cast<float>(height_px);
}

Camera place_camera(const Scene& scene, float heading_rad, float elevation_rad, int width_px,
                    int max_height_px) {
  Camera camera;
  camera.width_px = width_px;
  aim(camera, heading_rad, elevation_rad);
  const float diagonal_m =
      std::max(std::hypot(scene.x_m.span(), scene.y_m.span()), scene.z_m.span());
  camera.focus_m = kDistance * diagonal_m;
  camera.near_m = 0.1F * camera.focus_m;
  camera.eye_m = {scene.x_m.middle() - camera.focus_m * camera.forward.x,
                  scene.y_m.middle() - camera.focus_m * camera.forward.y,
                  scene.z_m.middle() - camera.focus_m * camera.forward.z};
  const Slopes seen = slopes_of(scene, camera);
  const float voxel_slope = 2.0F * scene.resolution_m / camera.focus_m;
  const Interval x = seen.across;
  const Interval y = seen.down;
  const float x_span = (x.span() + voxel_slope) * (1.0F + 2.0F * kMargin);
  const float y_span = (y.span() + voxel_slope) * (1.0F + 2.0F * kMargin);
  const float width = static_cast<float>(width_px);
  const float max_height = static_cast<float>(max_height_px);
  camera.scale_px = std::min(width / x_span, max_height / y_span);
  const float height = std::clamp(y_span * camera.scale_px,
                                  std::min(kMinHeightShare * width, max_height), max_height);
  camera.height_px = static_cast<int>(std::lround(height / 2.0F)) * 2;
  camera.x_px = 0.5F * width - camera.scale_px * x.middle();
  camera.y_px = 0.5F * static_cast<float>(camera.height_px) - camera.scale_px * y.middle();
  return camera;
}

}  // namespace tessera
