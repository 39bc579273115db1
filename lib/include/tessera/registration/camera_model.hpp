// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// From a point in a camera's frame (x right, y down, z forward, metres) to its pixel and back.
// Pixel (0, 0) is centred on (0.0, 0.0), as calibration tools have it, so the image spans
// -0.5 .. width - 0.5. In double: the distortion's high powers eat a float's digits at wide angles,
// and a projection is bound by its divisions and the reads of the label image, not by the width of
// its numbers. Nothing of libm is used but the square root, so every machine gives the same bits.
#pragma once

#include <array>
#include <cstdint>

#include "tessera/base/geometry.hpp"
#include "tessera/base/status.hpp"

namespace tessera {

/// By which model a lens projects.
enum class CameraKind : std::uint8_t {
  /// Pinhole with radial and tangential distortion k1 k2 p1 p2 k3 (Brown, 1966, in the order of
  /// OpenCV): with x = X/Z, y = Y/Z, r^2 = x^2 + y^2, q = 1 + k1 r^2 + k2 r^4 + k3 r^6:
  /// x' = x q + 2 p1 x y + p2 (r^2 + 2 x^2), y' = y q + p1 (r^2 + 2 y^2) + 2 p2 x y.
  kPinhole = 0,
  /// Equidistant with k1 .. k4 (Kannala and Brandt, PAMI 2006): with theta the angle to the axis,
  /// the pixel's distance from the centre is
  /// f theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
  kFisheye = 1,
};

/// A calibration as it is handed in. column = focal_x x' + centre_x, row = focal_y y' + centre_y.
struct CameraIntrinsics {
  CameraKind kind = CameraKind::kPinhole;
  int width_px = 0;
  int height_px = 0;
  double focal_x_px = 0.0;
  double focal_y_px = 0.0;
  double centre_x_px = 0.0;
  double centre_y_px = 0.0;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3, or k1 k2 k3 k4 0.
};

/// A place in an image; (0, 0) is the middle of the first pixel.
struct Pixel {
  double column = 0.0;
  double row = 0.0;
};

/// Whether a camera sees a point.
enum class Sight : std::uint8_t {
  kSeen,
  kBehind,   ///< Behind the camera or at its centre.
  kOutside,  ///< Beside the image, or where the model is not one-to-one any more.
};

/// A calibration that was checked, with the part of the world in which it is one-to-one. Beyond
/// that distortion folds points back into the image that the camera does not see: they are outside.
class CameraModel {
 public:
  static constexpr int kMostPixels = 16384;  ///< On each side of the image.
  /// Tangent of the widest angle to the axis that a pinhole is taken for: 89.4 degrees.
  static constexpr double kWidestTangent = 100.0;
  static constexpr double kMostNumber = 1e6;  ///< Of any number of a calibration.

  /// Fails with kInvalidArgument iff a number is not within kMostNumber, a side is not 1 to
  /// kMostPixels, a focal length is not above 0, or a fisheye has a fifth distortion number; with
  /// kMismatch iff the model is not one-to-one: of a pinhole up to the image's farthest corner, of
  /// a fisheye up to its nearest side (the corners of a round image may see nothing). A pinhole
  /// counts as one-to-one at radius r where the radial part rises, and its rate and its scale are
  /// both above 6 |(p1, p2)| r: the distortion's derivative is then positive definite, so the map
  /// is the gradient of a convex function. O(1): up to 9 * 9 bisections.
  [[nodiscard]] static Result<CameraModel> make(const CameraIntrinsics& intrinsics) noexcept;
  CameraModel() noexcept = default;  ///< Sees nothing.

  /// Sets pixel iff the point is seen. Coordinates that are not finite are not seen. O(1).
  [[nodiscard]] Sight project(const Point3d& p_camera, Pixel& pixel) const noexcept;
  /// The direction, of length 1, that is seen in a pixel; projected again it is within 1e-9 of the
  /// focal length of the pixel. Fails with kOutOfRange iff the pixel is not in the image or sees
  /// nothing. At most 60 bisections and 40 steps of Newton's method, each halved at most 20 times.
  [[nodiscard]] Result<Point3d> unproject(const Pixel& pixel) const noexcept;

  [[nodiscard]] const CameraIntrinsics& intrinsics() const noexcept { return intrinsics_; }
  [[nodiscard]] int width_px() const noexcept { return intrinsics_.width_px; }
  [[nodiscard]] int height_px() const noexcept { return intrinsics_.height_px; }
  /// How far from the axis points are seen at most: of a pinhole the tangent of the angle, of a
  /// fisheye the angle in radians.
  [[nodiscard]] double limit() const noexcept { return limit_; }

 private:
  [[nodiscard]] Sight in_image(double x, double y, Pixel& pixel) const noexcept;
  [[nodiscard]] Result<Point3d> unproject_pinhole(double x, double y) const noexcept;
  [[nodiscard]] Result<Point3d> unproject_fisheye(double x, double y) const noexcept;

  CameraIntrinsics intrinsics_;
  double limit_ = 0.0;
};

}  // namespace tessera
