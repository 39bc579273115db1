// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/registration/camera_model.hpp"

#include <algorithm>
#include <cmath>

#include "camera_mathematics.hpp"

namespace tessera {

namespace {

/// Where an image ends, in units of the focal lengths from its centre.
struct Edges {
  explicit Edges(const CameraIntrinsics& c) noexcept
      : left((-0.5 - c.centre_x_px) / c.focal_x_px),
        right((c.width_px - 0.5 - c.centre_x_px) / c.focal_x_px),
        top((-0.5 - c.centre_y_px) / c.focal_y_px),
        bottom((c.height_px - 0.5 - c.centre_y_px) / c.focal_y_px) {}
  [[nodiscard]] double farthest_corner() const noexcept {
    const double x = std::max(std::abs(left), std::abs(right));
    const double y = std::max(std::abs(top), std::abs(bottom));
    return std::sqrt(x * x + y * y);
  }
  /// 0 or less if the centre is not in the image.
  [[nodiscard]] double nearest_side() const noexcept {
    return std::min(std::min(-left, right), std::min(-top, bottom));
  }

  double left;
  double right;
  double top;
  double bottom;
};

/// r q: the distance from the centre, of a pinhole's undistorted distance.
Polynomial pinhole_radius(const CameraIntrinsics& c) noexcept {
  const auto& [k1, k2, p1, p2, k3] = c.distortion;
  return {{0.0, 1.0, 0.0, k1, 0.0, k2, 0.0, k3}};
}
/// Of a fisheye's angle to the axis.
Polynomial fisheye_radius(const CameraIntrinsics& c) noexcept {
  const auto& k = c.distortion;
  return {{0.0, 1.0, 0.0, k[0], 0.0, k[1], 0.0, k[2], 0.0, k[3]}};
}

double tangential_size(const CameraIntrinsics& c) noexcept {
  return std::sqrt(c.distortion[2] * c.distortion[2] + c.distortion[3] * c.distortion[3]);
}

/// The radius up to which a pinhole is used: there even the tangential part, at most 3 q r^2,
/// cannot keep a point in the image. 0 if the model folds before.
double pinhole_limit(const CameraIntrinsics& c) noexcept {
  const double tangential = tangential_size(c);
  const Polynomial radius = pinhole_radius(c);
  Polynomial leaves = radius;
  leaves.factors[0] = -Edges(c).farthest_corner();
  leaves.factors[2] = -3.0 * tangential;
  const double limit = first_crossing(leaves, CameraModel::kWidestTangent);
  if (limit >= CameraModel::kWidestTangent) return 0.0;
  const Polynomial rate = leaves.derivative();
  Polynomial scale;
  std::copy(radius.factors.begin() + 1, radius.factors.end(), scale.factors.begin());
  scale.factors[1] = -6.0 * tangential;
  const bool folds = first_crossing(rate, limit) < limit || first_crossing(scale, limit) < limit;
  return folds ? 0.0 : limit;
}

/// The angle up to which a fisheye is used; 0 if the model folds before the nearest side.
double fisheye_limit(const CameraIntrinsics& c) noexcept {
  const Edges edges(c);
  const Polynomial radius = fisheye_radius(c);
  const double turn = first_crossing(radius.derivative(), kPi);
  Polynomial leaves = radius;
  leaves.factors[0] = -edges.farthest_corner();
  const double limit = std::min(turn, first_crossing(leaves, turn));
  return turn < kPi && radius.at(limit) < edges.nearest_side() ? 0.0 : limit;
}

bool valid(const CameraIntrinsics& c) noexcept {
  const auto side = [](int pixels) { return pixels >= 1 && pixels <= CameraModel::kMostPixels; };
  // Written so that NaN fails.
  const auto moderate = [](double number) { return std::abs(number) <= CameraModel::kMostNumber; };
  const auto positive = [&](double number) { return number > 0.0 && moderate(number); };
  bool all = moderate(c.centre_x_px) && moderate(c.centre_y_px);
  for (const double number : c.distortion) all = all && moderate(number);
  return all && side(c.width_px) && side(c.height_px) && positive(c.focal_x_px) &&
         positive(c.focal_y_px) && (c.kind == CameraKind::kPinhole || c.distortion[4] == 0.0);
}

/// A place on the plane one focal length ahead.
struct Place {
  double x;
  double y;
};

struct Distorted {
  Place place;
  double xx;  ///< The derivative, which is symmetric.
  double xy;
  double yy;
};

Distorted distort(const CameraIntrinsics& c, const Place& at) noexcept {
  const auto& [k1, k2, p1, p2, k3] = c.distortion;
  const auto [x, y] = at;
  const double s = x * x + y * y;
  const double q = 1.0 + s * (k1 + s * (k2 + s * k3));
  const double dq = 2.0 * (k1 + s * (2.0 * k2 + s * 3.0 * k3));
  return {{x * q + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
           y * q + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y},
          q + x * x * dq + 2.0 * p1 * y + 6.0 * p2 * x,
          x * y * dq + 2.0 * p1 * x + 2.0 * p2 * y,
          q + y * y * dq + 6.0 * p1 * y + 2.0 * p2 * x};
}

double square_distance(const Place& a, const Place& b) noexcept {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

/// One step of Newton's method from `at`, halved until it comes nearer to the target within the
/// limit; false if none does.
bool newton_step(const CameraIntrinsics& c, const Place& target, double limit, Place& at) noexcept {
  constexpr int kHalvings = 20;
  const Distorted here = distort(c, at);
  const double before = square_distance(here.place, target);
  const double determinant = here.xx * here.yy - here.xy * here.xy;
  const double ex = target.x - here.place.x;
  const double ey = target.y - here.place.y;
  double dx = (here.yy * ex - here.xy * ey) / determinant;
  double dy = (here.xx * ey - here.xy * ex) / determinant;
  for (int i = 0; i < kHalvings; ++i) {
    const Place next{at.x + dx, at.y + dy};
    if (next.x * next.x + next.y * next.y <= limit * limit &&
        square_distance(distort(c, next).place, target) < before) {
      at = next;
      return true;
    }
    dx *= 0.5;
    dy *= 0.5;
  }
  return false;
}

}  // namespace

Result<CameraModel> CameraModel::make(const CameraIntrinsics& intrinsics) noexcept {
  if (!valid(intrinsics)) return Status::kInvalidArgument;
  CameraModel model;
  model.intrinsics_ = intrinsics;
  model.limit_ = intrinsics.kind == CameraKind::kPinhole ? pinhole_limit(intrinsics)
                                                         : fisheye_limit(intrinsics);
  if (!(model.limit_ > 0.0)) return Status::kMismatch;
  return model;
}

Sight CameraModel::in_image(double x, double y, Pixel& pixel) const noexcept {
  const CameraIntrinsics& c = intrinsics_;
  const Pixel at{c.focal_x_px * x + c.centre_x_px, c.focal_y_px * y + c.centre_y_px};
  const bool inside = at.column >= -0.5 && at.column < c.width_px - 0.5 && at.row >= -0.5 &&
                      at.row < c.height_px - 0.5;
  if (!inside) return Sight::kOutside;
  pixel = at;
  return Sight::kSeen;
}

Sight CameraModel::project(const Point3d& p_camera, Pixel& pixel) const noexcept {
  const CameraIntrinsics& c = intrinsics_;
  if (c.kind == CameraKind::kPinhole) {
    if (!(p_camera.z() > 0.0)) return Sight::kBehind;
    const Place at{p_camera.x() / p_camera.z(), p_camera.y() / p_camera.z()};
    // Written so that NaN fails.
    if (!(at.x * at.x + at.y * at.y <= limit_ * limit_)) return Sight::kOutside;
    const Place seen = distort(c, at).place;
    return in_image(seen.x, seen.y, pixel);
  }
  const double aside = std::sqrt(p_camera.x() * p_camera.x() + p_camera.y() * p_camera.y());
  if (!(aside > 0.0)) {
    return p_camera.z() > 0.0 && aside == 0.0 ? in_image(0.0, 0.0, pixel) : Sight::kBehind;
  }
  if (!(aside < 1e150 && std::abs(p_camera.z()) < 1e150)) return Sight::kOutside;
  const double angle_rad = angle_of(aside, p_camera.z());
  if (!(angle_rad <= limit_)) return p_camera.z() > 0.0 ? Sight::kOutside : Sight::kBehind;
  const double s = angle_rad * angle_rad;
  const auto& k = c.distortion;
  const double radius = angle_rad * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
  const double scale = radius / aside;
  return in_image(scale * p_camera.x(), scale * p_camera.y(), pixel);
}

Result<Point3d> CameraModel::unproject_pinhole(double x, double y) const noexcept {
  constexpr int kSteps = 40;
  const Place target{x, y};
  const double radius = std::sqrt(x * x + y * y);
  Polynomial beyond = pinhole_radius(intrinsics_);
  beyond.factors[0] = -radius;
  Place at{0.0, 0.0};
  if (radius > 0.0) {
    // Without the tangential part, which is small, as a start.
    const double start = std::min(crossing(beyond, 0.0, limit_), limit_);
    at = {start / radius * x, start / radius * y};
  }
  for (int i = 0; i < kSteps && newton_step(intrinsics_, target, limit_, at); ++i) continue;
  if (!(square_distance(distort(intrinsics_, at).place, target) <= 1e-18))
    return Status::kOutOfRange;
  const double length = std::sqrt(at.x * at.x + at.y * at.y + 1.0);
  return Point3d(at.x / length, at.y / length, 1.0 / length);
}

Result<Point3d> CameraModel::unproject_fisheye(double x, double y) const noexcept {
  const double radius = std::sqrt(x * x + y * y);
  if (!(radius > 0.0)) return Point3d(0.0, 0.0, 1.0);
  Polynomial beyond = fisheye_radius(intrinsics_);
  beyond.factors[0] = -radius;
  if (beyond.at(limit_) < 0.0) return Status::kOutOfRange;
  const auto [sine, cosine] = sine_cosine(crossing(beyond, 0.0, limit_));
  return Point3d(sine * x / radius, sine * y / radius, cosine);
}

Result<Point3d> CameraModel::unproject(const Pixel& pixel) const noexcept {
  const CameraIntrinsics& c = intrinsics_;
  const bool inside = pixel.column >= -0.5 && pixel.column < c.width_px - 0.5 &&
                      pixel.row >= -0.5 && pixel.row < c.height_px - 0.5;
  if (!inside) return Status::kOutOfRange;
  const double x = (pixel.column - c.centre_x_px) / c.focal_x_px;
  const double y = (pixel.row - c.centre_y_px) / c.focal_y_px;
  return c.kind == CameraKind::kPinhole ? unproject_pinhole(x, y) : unproject_fisheye(x, y);
}

}  // namespace tessera
