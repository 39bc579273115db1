// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The map from straight above, orthographic, to scale.
#pragma once

#include <span>

#include "pictures/canvas.hpp"
#include "pictures/framing.hpp"

namespace tessera {

/// Place of the map's ground in the picture. Not turned: +x to the right, +y up. Turned: +y right,
/// +x down, for content that is longer along y.
struct TopFrame {
  Interval x_m;
  Interval y_m;
  float pixels_per_m = 1.0F;
  bool turned = false;
  int width_px = 0;
  int height_px = 0;

  [[nodiscard]] PixelPoint pixel_of(float x, float y) const;
  /// True iff the voxel's centre is inside of the picture.
  [[nodiscard]] bool shows(const RenderVoxel& voxel) const {
    return x_m.contains(voxel.x) && y_m.contains(voxel.y);
  }
  /// The map coordinates of a pixel's centre, x in .x and y in .y.
  [[nodiscard]] PixelPoint map_point_of(int x_px, int y_px) const;
};

/// Fits the scene, which has a drawable voxel, into width_px and at most max_height_px.
[[nodiscard]] TopFrame make_top_frame(const Scene& scene, int width_px, int max_height_px);

/// width and height of the frame; translucent_above_m as in ImageOptions.
[[nodiscard]] Canvas draw_top_view(const Scene& scene, const TopFrame& frame,
                                   const ImageOptions& options, Color background);

}  // namespace tessera
