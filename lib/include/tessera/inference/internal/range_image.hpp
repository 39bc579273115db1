// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How far a sensor saw in each direction: the nearest return of a scan in any cone of directions,
// none missed. Basic arithmetic and square roots only, so the same on every machine.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera {

/// A cube around the sensor, its faces cut into kFacePixels^2 pixels, each of which keeps the range
/// of the nearest return in it. A pixel spans 0.6 degrees at a face's centre, less elsewhere.
class RangeImage {
 public:
  static constexpr int kFacePixels = 192;
  /// The widest cone that can be asked for: the half angle, radians.
  static constexpr float kMaxAngle_rad = 0.05F;
  /// No return there: farther than any.
  static constexpr float kNone_m = 3.4e38F;
  /// How far beyond the angle asked for a return may be that still counts: a pixel's diagonal, at
  /// most 0.01474 at a face's centre, and rounding.
  static constexpr double kSlack_rad = 0.0148;

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<float>(kPixels);
  }
  /// An image without returns. Fails with kResourceExhausted iff the arena has no room for it.
  [[nodiscard]] static Result<RangeImage> make(Arena& arena) noexcept;
  RangeImage() noexcept = default;

  /// Forgets all returns. O(kPixels).
  void clear() noexcept;
  /// Adds a return at range_m in the direction, which is finite, not zero and of any length. O(1).
  void add_return(const Point3d& direction, double range_m) noexcept;
  /// The range of the nearest return in pixels that touch the cone of directions within angle_rad
  /// (0 .. kMaxAngle_rad) of direction (finite, not zero, of any length); kNone_m if there is none.
  /// So every return within the angle counts, and none farther than angle_rad + kSlack_rad
  /// does. Reads at most 3 * (2.6 * kFacePixels * angle_rad + 2.1)^2 pixels.
  [[nodiscard]] float nearest_m(const Point3d& direction, float angle_rad) const noexcept;

 private:
  static constexpr std::size_t kPixels = std::size_t{6} * kFacePixels * kFacePixels;

  std::span<float> ranges_m_;  ///< By face (+x -x +y -y +z -z), then row, then column.
};

}  // namespace tessera
