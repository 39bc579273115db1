// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/range_image.hpp"

#include <algorithm>
#include <cmath>

#include "tessera/base/internal/lanes.hpp"

namespace tessera {

namespace {

constexpr int kFaceEdge = RangeImage::kFacePixels;
/// Added to every angle (radians): far above what rounding can move a cone's outline by, also where
/// a root of nearly zero is taken, and far below a pixel.
constexpr double kRounding_rad = 2e-6;

/// A direction seen from a face: along the face's axis, its columns and its rows. The point of the
/// face that it meets is (u, v) = (column / axis, row / axis), both in [-1, 1].
struct FaceDirection {
  double axis = 0.0;
  double column = 0.0;
  double row = 0.0;
};

/// face: 0 .. 5 for +x -x +y -y +z -z.
FaceDirection seen_from(int face, const Point3d& d) noexcept {
  const double sign = (face & 1) == 0 ? 1.0 : -1.0;
  if (face < 2) return {sign * d.x(), d.y(), d.z()};
  if (face < 4) return {sign * d.y(), d.x(), d.z()};
  return {sign * d.z(), d.x(), d.y()};
}

int face_of(const Point3d& d) noexcept {
  const double ax = std::abs(d.x());
  const double ay = std::abs(d.y());
  const double az = std::abs(d.z());
  if (ax >= ay && ax >= az) return d.x() < 0.0 ? 1 : 0;
  if (ay >= az) return d.y() < 0.0 ? 3 : 2;
  return d.z() < 0.0 ? 5 : 4;
}

/// The row or column of a face's coordinate, which is in [-1, 1] but for rounding.
int pixel_of(double w) noexcept {
  return std::clamp(static_cast<int>((w + 1.0) * (0.5 * kFaceEdge)), 0, kFaceEdge - 1);
}

std::size_t row_begin(int face, int row) noexcept {
  return static_cast<std::size_t>((face * kFaceEdge + row) * kFaceEdge);
}

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

/// Where a cone meets a face's plane: an ellipse, as the cone lies within 65 degrees of the face's
/// axis. sine: of the cone's half angle. center: the cone's axis, of length 1.
class Ellipse {
 public:
  Ellipse(const FaceDirection& center, double sine) noexcept
      : center_(center), square_(1.0 - sine * sine), q_(square_ - center.column * center.column) {
    // On columns and rows: the tangents of the angle between the face's axis and the two planes
    // through the face's other coordinate that touch the cone.
    const Double2 component{center.column, center.row};
    const Double2 tangent =
        sine / sqrt2(center.axis * center.axis + component * component - sine * sine);
    const Double2 low = (component - center.axis * tangent) / (center.axis + component * tangent);
    const Double2 high = (component + center.axis * tangent) / (center.axis - component * tangent);
    columns_ = {low[0], high[0]};
    rows_ = {low[1], high[1]};
    // The plane through an outermost column is off the cone's axis by the cone's angle and touches
    // the cone at the axis's foot in it.
    const Double2 outermost{low[0], high[0]};
    const Double2 off{sine, -sine};
    const Double2 touches =
        center.row / (center.axis + off * outermost / sqrt2(1.0 + outermost * outermost));
    touches_ = {touches[0], touches[1]};
  }

  [[nodiscard]] Interval rows() const noexcept { return rows_; }
  [[nodiscard]] bool meets_face() const noexcept {
    return columns_.low <= 1.0 && columns_.high >= -1.0 && rows_.low <= 1.0 && rows_.high >= -1.0;
  }

  /// The columns that the ellipse covers at row coordinate v, taken to be in rows(): the roots of
  /// (axis + column u + row v)^2 = square (1 + u^2 + v^2).
  [[nodiscard]] Interval columns_at(double v) const noexcept {
    const double m = center_.axis + center_.row * v;
    const double under = square_ * (m * m - q_ * (1.0 + v * v));
    const double root = under > 0.0 ? std::sqrt(under) : 0.0;
    const Double2 columns = (center_.column * m + Double2{-root, root}) / q_;
    return {columns[0], columns[1]};
  }

  /// The columns that the ellipse covers between two row coordinates in rows(), from those that it
  /// covers at them: in between it bulges out only at its outermost columns.
  [[nodiscard]] Interval hull(double v_low, const Interval& at_low, double v_high,
                              const Interval& at_high) const noexcept {
    Interval hull{std::min(at_low.low, at_high.low), std::max(at_low.high, at_high.high)};
    if (v_low <= touches_.low && touches_.low <= v_high) hull.low = columns_.low;
    if (v_low <= touches_.high && touches_.high <= v_high) hull.high = columns_.high;
    return hull;
  }

 private:
  FaceDirection center_;
  double square_;
  double q_;
  Interval columns_;
  Interval rows_;
  Interval touches_;  ///< The row coordinates at the outermost columns.
};

/// True only if the cone does not meet the face, for a comparison: Ellipse's tangents are at most
/// sine / 0.52, as the cone's axis is within 58 degrees of the face's.
bool beside_face(const FaceDirection& center, double sine) noexcept {
  const double farthest = std::max(std::abs(center.column), std::abs(center.row));
  const double bound = sine / 0.52;
  return farthest * (1.0 - bound) > center.axis * (1.0 + bound) + kRounding_rad;
}

/// The nearest in those of a face's pixels that the ellipse touches.
float nearest_on_face(std::span<const float> ranges_m, int face, const Ellipse& ellipse,
                      float nearest) noexcept {
  const Interval rows{std::max(ellipse.rows().low, -1.0), std::min(ellipse.rows().high, 1.0)};
  const int last_row = pixel_of(rows.high);
  double v = rows.low;
  Interval at_v = ellipse.columns_at(v);
  for (int row = pixel_of(rows.low); row <= last_row; ++row) {
    const double v_next =
        row == last_row ? rows.high : static_cast<double>(row + 1) * (2.0 / kFaceEdge) - 1.0;
    const Interval at_next = ellipse.columns_at(v_next);
    const Interval columns = ellipse.hull(v, at_v, v_next, at_next);
    v = v_next;
    at_v = at_next;
    if (columns.low > 1.0 || columns.high < -1.0) continue;
    const float* const pixels = ranges_m.data() + row_begin(face, row);
    const int last = pixel_of(columns.high);
    for (int i = pixel_of(columns.low); i <= last; ++i) nearest = std::min(nearest, pixels[i]);
  }
  return nearest;
}

}  // namespace

Result<RangeImage> RangeImage::make(Arena& arena) noexcept {
  if (arena.remaining_bytes() < required_bytes()) return Status::kResourceExhausted;
  RangeImage result;
  result.ranges_m_ = arena.take<float>(kPixels);
  result.clear();
  return result;
}

void RangeImage::clear() noexcept { std::ranges::fill(ranges_m_, kNone_m); }

void RangeImage::add_return(const Point3d& direction, double range_m) noexcept {
  const int face = face_of(direction);
  const FaceDirection d = seen_from(face, direction);
  const std::size_t pixel = row_begin(face, pixel_of(d.row / d.axis)) +
                            static_cast<std::size_t>(pixel_of(d.column / d.axis));
  ranges_m_[pixel] = std::min(ranges_m_[pixel], static_cast<float>(range_m));
}

float RangeImage::nearest_m(const Point3d& direction, float angle_rad) const noexcept {
  TESSERA_ASSERT(angle_rad >= 0.0F && angle_rad <= kMaxAngle_rad);
  const double length = std::sqrt(direction.x() * direction.x() + direction.y() * direction.y() +
                                  direction.z() * direction.z());
  const Point3d unit(direction.x() / length, direction.y() / length, direction.z() / length);
  // An angle is more than its sine: a cone with the angle as its sine is the wider one.
  const double sine = static_cast<double>(angle_rad) + kRounding_rad;
  float nearest = kNone_m;
  for (int face = 0; face < 6; ++face) {
    const FaceDirection center = seen_from(face, unit);
    // A face ends 54.8 degrees from its axis, and no cone is wider than 2.9: cos(57.7 degrees).
    if (center.axis < 0.53 || beside_face(center, sine)) continue;
    const Ellipse ellipse(center, sine);
    if (ellipse.meets_face()) nearest = nearest_on_face(ranges_m_, face, ellipse, nearest);
  }
  return nearest;
}

}  // namespace tessera
