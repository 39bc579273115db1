// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/top_view.hpp"

#include <algorithm>
#include <cmath>

#include "pictures/height_field.hpp"

namespace tessera {
namespace {

constexpr float kTurnRatio = 1.15F;
constexpr float kMargin = 0.015F;
constexpr float kMinHeightShare = 0.25F;
/// Voxels high above the ground with others below them.
constexpr float kTranslucentOpacity = 0.35F;
/// Differences below 1.2 voxels are steps of the lattice.
constexpr float kStepVoxels = 1.2F;

/// Two layers of the map: everything, and voxels not higher above the ground than the limit.
struct Layers {
  HeightField all;
  HeightField low;
};

Layers make_layers(const Scene& scene, const TopFrame& frame, float limit_m) {
  // A cell of at least two canvas pixels is one pixel of the final picture; finer ones would only
  // be averaged.
  const float cell_m = std::max(scene.resolution_m, 2.0F / frame.pixels_per_m);
  Interval x_m = frame.x_m;
  Interval y_m = frame.y_m;
  // Cells that are voxels must have the voxels' centres in their middle, not on their borders.
  const RenderVoxel& anchor = scene.sample.front();
  x_m.low = anchor.x - cell_m * (std::ceil((anchor.x - x_m.low) / cell_m) + 0.5F);
  y_m.low = anchor.y - cell_m * (std::ceil((anchor.y - y_m.low) / cell_m) + 0.5F);
  const HeightField ground = ground_heights(scene, x_m, y_m);
  Layers layers{HeightField(x_m, y_m, cell_m), HeightField(x_m, y_m, cell_m)};
  for (const RenderVoxel& voxel : scene.voxels) {
    if (!is_drawable(voxel)) continue;
    layers.all.raise(voxel);
    const float ground_m = ground.height_at(ground.column_of(voxel.x), ground.row_of(voxel.y));
    if (ground_m == HeightField::kNone || voxel.z <= ground_m + limit_m) layers.low.raise(voxel);
  }
  return layers;
}

Color color_of(const Layers& layers, std::size_t cell, Color background) {
  const float all_m = layers.all.height_m[cell];
  const float low_m = layers.low.height_m[cell];
  if (all_m == HeightField::kNone) return background;
  if (low_m == HeightField::kNone) return mix(background, layers.all.color[cell], 0.8F);
  if (all_m <= low_m) return layers.low.color[cell];
  return mix(layers.low.color[cell], layers.all.color[cell], kTranslucentOpacity);
}

}  // namespace

PixelPoint TopFrame::pixel_of(float x, float y) const {
  const float right_m = turned ? y - y_m.middle() : x - x_m.middle();
  const float down_m = turned ? x - x_m.middle() : y_m.middle() - y;
  return {0.5F * static_cast<float>(width_px) + pixels_per_m * right_m,
          0.5F * static_cast<float>(height_px) + pixels_per_m * down_m};
}

PixelPoint TopFrame::map_point_of(int x_px, int y_px) const {
  const float right_m =
      (static_cast<float>(x_px) + 0.5F - 0.5F * static_cast<float>(width_px)) / pixels_per_m;
  const float down_m =
      (static_cast<float>(y_px) + 0.5F - 0.5F * static_cast<float>(height_px)) / pixels_per_m;
  if (turned) return {x_m.middle() + down_m, y_m.middle() + right_m};
  return {x_m.middle() + right_m, y_m.middle() - down_m};
}

TopFrame make_top_frame(const Scene& scene, int width_px, int max_height_px) {
  TopFrame frame{.x_m = scene.x_m,
                 .y_m = scene.y_m,
                 .pixels_per_m = 1.0F,
                 .turned = false,
                 .width_px = width_px,
                 .height_px = 0};
  frame.turned = scene.y_m.span() > kTurnRatio * scene.x_m.span();
  const float wide_m = (frame.turned ? scene.y_m : scene.x_m).span() * (1.0F + 2.0F * kMargin);
  const float high_m = (frame.turned ? scene.x_m : scene.y_m).span() * (1.0F + 2.0F * kMargin);
  const float width = static_cast<float>(width_px);
  const float min_height = kMinHeightShare * width;
  frame.pixels_per_m = std::min(width / wide_m, static_cast<float>(max_height_px) / high_m);
  const float height =
      std::clamp(high_m * frame.pixels_per_m, min_height, static_cast<float>(max_height_px));
  frame.height_px = static_cast<int>(std::lround(height / 2.0F)) * 2;
  // The window is the whole picture, not only the part with most voxels.
  const float across_m = width / frame.pixels_per_m;
  const float down_m = static_cast<float>(frame.height_px) / frame.pixels_per_m;
  const float half_x_m = 0.5F * (frame.turned ? down_m : across_m);
  const float half_y_m = 0.5F * (frame.turned ? across_m : down_m);
  frame.x_m = {scene.x_m.middle() - half_x_m, scene.x_m.middle() + half_x_m};
  frame.y_m = {scene.y_m.middle() - half_y_m, scene.y_m.middle() + half_y_m};
  return frame;
}

Canvas draw_top_view(const Scene& scene, const TopFrame& frame, const ImageOptions& options,
                     Color background) {
  Layers layers = make_layers(scene, frame, options.translucent_above_m);
  shade_relief(layers.all, kStepVoxels * scene.resolution_m, frame.turned);
  shade_relief(layers.low, kStepVoxels * scene.resolution_m, frame.turned);
  Canvas canvas(frame.width_px, frame.height_px, background);
  for (int y = 0; y < frame.height_px; ++y) {
    for (int x = 0; x < frame.width_px; ++x) {
      const PixelPoint p = frame.map_point_of(x, y);
      const int column = layers.all.column_of(p.x);
      const int row = layers.all.row_of(p.y);
      if (!layers.all.contains(column, row)) continue;
      canvas.at(x, y) = color_of(layers, layers.all.index(column, row), background);
    }
  }
  return canvas;
}

}  // namespace tessera
