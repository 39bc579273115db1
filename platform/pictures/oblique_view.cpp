// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/oblique_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "pictures/eye_dome.hpp"
#include "pictures/height_field.hpp"

namespace tessera {
namespace {

/// Cubes smaller than this on the canvas are drawn at this size, so that distant surfaces stay
/// closed.
constexpr float kSmallestCube_px = 1.6F;
/// Faces reach a little over their edges, so that no background is visible between neighbours.
constexpr float kOverlap = 0.02F;
constexpr float kTopTone = 1.0F;
constexpr float kBottomTone = 0.45F;
constexpr float kSideTone = 0.72F;
/// Factors for sides that face the light, and for those that face away.
constexpr float kSideContrast = 0.2F;
/// The light comes from behind the viewer's left shoulder.
constexpr float kLightFromForward_rad = 2.5F;
constexpr float kShadow = 0.72F;
/// Below the top of its column a voxel gets darker, over this depth and down to this tone.
constexpr float kColumnDepth_m = 4.0F;
constexpr float kColumnTone = 0.68F;
constexpr float kMostCells = 4.0e6F;

/// The light on the scene: its direction, and the obstacles.
class Light {
 public:
  Light(const Scene& scene, const Camera& camera)
      : heights_(scene.x_m, scene.y_m,
                 std::max(scene.resolution_m,
                          std::sqrt(scene.x_m.span() * scene.y_m.span() / kMostCells))),
        slack_m_(1.2F * scene.resolution_m) {
    const float heading = std::atan2(camera.forward.y, camera.forward.x);
    x_ = std::cos(heading + kLightFromForward_rad);
    y_ = std::sin(heading + kLightFromForward_rad);
    // The nearest of the eight directions; 0.38 is the sine of half of 45 degrees.
    const auto step = [](float part) { return part > 0.38F ? 1 : (part < -0.38F ? -1 : 0); };
    to_light_ = {step(x_), step(y_)};
    for (const RenderVoxel& voxel : scene.voxels) {
      if (is_drawable(voxel)) heights_.raise(voxel);
    }
  }

  /// The tone of a vertical face with the given outward normal.
  [[nodiscard]] float side_tone(float normal_x, float normal_y) const {
    return kSideTone + kSideContrast * (normal_x * x_ + normal_y * y_);
  }
  [[nodiscard]] float at(const RenderVoxel& voxel) const {
    const CellStep cell{heights_.column_of(voxel.x), heights_.row_of(voxel.y)};
    if (!heights_.contains(cell.column, cell.row)) return 1.0F;
    const float below_m = heights_.height_at(cell.column, cell.row) - voxel.z - slack_m_;
    const float share = std::clamp(below_m / kColumnDepth_m, 0.0F, 1.0F);
    const float shade = in_shadow(heights_, cell, voxel.z, to_light_, slack_m_) ? kShadow : 1.0F;
    return std::min(1.0F - (1.0F - kColumnTone) * share, shade);
  }

 private:
  HeightField heights_;
  float slack_m_;
  float x_ = 0.0F;
  float y_ = 0.0F;
  CellStep to_light_{};
};

struct Target {
  Canvas canvas;
  std::vector<float> depth_m;
};

/// A direction on the picture, and how much depth changes along it.
struct Edge {
  float x_px = 0.0F;
  float y_px = 0.0F;
  float depth_m = 0.0F;
};

/// A parallelogram around a centre: centre + s * a + t * b with s, t in [-1/2, 1/2]. A cube is
/// small against its distance, so its perspective is taken as affine.
struct Face {
  Edge centre;
  Edge a;
  Edge b;
  Color color;
};

void draw_face(Target& target, const Face& face) {
  const float det = face.a.x_px * face.b.y_px - face.a.y_px * face.b.x_px;
  if (std::abs(det) < 1.0e-3F) return;
  const float reach_x = 0.5F * (std::abs(face.a.x_px) + std::abs(face.b.x_px)) + 0.5F;
  const float reach_y = 0.5F * (std::abs(face.a.y_px) + std::abs(face.b.y_px)) + 0.5F;
  const int width = target.canvas.width();
  const int height = target.canvas.height();
  const int x_begin = std::max(static_cast<int>(face.centre.x_px - reach_x), 0);
  const int x_end = std::min(static_cast<int>(face.centre.x_px + reach_x) + 1, width);
  const int y_begin = std::max(static_cast<int>(face.centre.y_px - reach_y), 0);
  const int y_end = std::min(static_cast<int>(face.centre.y_px + reach_y) + 1, height);
  for (int y = y_begin; y < y_end; ++y) {
    const float dy = static_cast<float>(y) + 0.5F - face.centre.y_px;
    for (int x = x_begin; x < x_end; ++x) {
      const float dx = static_cast<float>(x) + 0.5F - face.centre.x_px;
      const float s = (dx * face.b.y_px - dy * face.b.x_px) / det;
      const float t = (face.a.x_px * dy - face.a.y_px * dx) / det;
      if (std::abs(s) > 0.5F + kOverlap || std::abs(t) > 0.5F + kOverlap) continue;
      const float depth_m = face.centre.depth_m + s * face.a.depth_m + t * face.b.depth_m;
      float& nearest_m =
          target.depth_m[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(x)];
      if (depth_m >= nearest_m) continue;
      nearest_m = depth_m;
      target.canvas.at(x, y) = face.color;
    }
  }
}

Edge moved(const Edge& from, const Edge& by, float share) {
  return {from.x_px + share * by.x_px, from.y_px + share * by.y_px,
          from.depth_m + share * by.depth_m};
}

void draw_cube(Target& target, const Camera& camera, const Light& light, const RenderVoxel& voxel,
               float edge_m) {
  const Vector3 d{voxel.x - camera.eye_m.x, voxel.y - camera.eye_m.y, voxel.z - camera.eye_m.z};
  const float depth_m = dot(d, camera.forward);
  if (depth_m < camera.near_m) return;
  const PixelPoint at = camera.pixel_of(d, depth_m);
  const float size_px = std::max(camera.scale_px * edge_m / depth_m, kSmallestCube_px);
  if (at.x < -2.0F * size_px || at.y < -2.0F * size_px ||
      at.x > static_cast<float>(camera.width_px) + 2.0F * size_px ||
      at.y > static_cast<float>(camera.height_px) + 2.0F * size_px) {
    return;
  }
  const Edge centre{at.x, at.y, depth_m};
  const Edge ex{size_px * camera.right.x, -size_px * camera.up.x, edge_m * camera.forward.x};
  const Edge ey{size_px * camera.right.y, -size_px * camera.up.y, edge_m * camera.forward.y};
  const Edge ez{size_px * camera.right.z, -size_px * camera.up.z, edge_m * camera.forward.z};
  // Of each pair of opposite faces, the one towards the eye.
  const auto side = [](float from_eye_m) { return from_eye_m < 0.0F ? 0.5F : -0.5F; };
  const float brightness = light.at(voxel);
  const float x_tone = brightness * light.side_tone(2.0F * side(d.x), 0.0F);
  const float y_tone = brightness * light.side_tone(0.0F, 2.0F * side(d.y));
  const float z_tone = brightness * (d.z < 0.0F ? kTopTone : kBottomTone);
  draw_face(target, {moved(centre, ez, side(d.z)), ex, ey, scaled(voxel.color, z_tone)});
  draw_face(target, {moved(centre, ex, side(d.x)), ey, ez, scaled(voxel.color, x_tone)});
  draw_face(target, {moved(centre, ey, side(d.y)), ex, ez, scaled(voxel.color, y_tone)});
}

}  // namespace

Canvas draw_oblique_view(const Scene& scene, const Camera& camera, Color background) {
  const auto pixels =
      static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  Target target{Canvas(camera.width_px, camera.height_px, background),
                std::vector<float>(pixels, kNoDepth)};
  const Light light(scene, camera);
  for (const RenderVoxel& voxel : scene.voxels) {
    if (is_drawable(voxel)) draw_cube(target, camera, light, voxel, scene.resolution_m);
  }
  apply_eye_dome(target.canvas, target.depth_m);
  return std::move(target.canvas);
}

}  // namespace tessera
