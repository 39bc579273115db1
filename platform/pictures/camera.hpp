// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A pinhole camera that looks down on the map, placed so that the content fills a picture.
#pragma once

#include <optional>

#include "pictures/canvas.hpp"
#include "pictures/framing.hpp"

namespace tessera {

struct Vector3 {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
};

[[nodiscard]] constexpr float dot(const Vector3& a, const Vector3& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

struct Camera {
  Vector3 eye_m;  ///< Map frame.
  Vector3 right;  ///< Unit vectors, map frame.
  Vector3 up;
  Vector3 forward;
  float near_m = 0.0F;    ///< Closer voxels are not drawn.
  float focus_m = 0.0F;   ///< The distance of the middle of the content.
  float scale_px = 1.0F;  ///< Pixels for a slope of 1 against the view axis.
  float x_px = 0.0F;      ///< Pixel of the view axis.
  float y_px = 0.0F;
  int width_px = 0;
  int height_px = 0;

  /// The picture position of a point with a view depth of at least near_m.
  [[nodiscard]] PixelPoint pixel_of(const Vector3& from_eye_m, float depth_m) const {
    return {x_px + scale_px * dot(from_eye_m, right) / depth_m,
            y_px - scale_px * dot(from_eye_m, up) / depth_m};
  }
  /// The picture position of a voxel's centre; empty if it is too close.
  [[nodiscard]] std::optional<PixelPoint> pixel_of(const RenderVoxel& voxel) const;
  /// True iff that position is inside of the picture.
  [[nodiscard]] bool shows(const RenderVoxel& voxel) const;
};

/// A camera on the scene, which has a drawable voxel. heading_rad: viewing direction, from the
/// map's x axis; elevation_rad: angle downwards. The height of the picture follows from the
/// content, at most max_height_px.
[[nodiscard]] Camera place_camera(const Scene& scene, float heading_rad, float elevation_rad,
                                  int width_px, int max_height_px);

}  // namespace tessera
