// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/internal/columns.hpp"

#include <cmath>

namespace tessera {

namespace {

using Surface = MapSketch::Surface;

Point3d normal_of(const Surface& surface) noexcept {
  const Point3d n{static_cast<double>(surface.normal[0]), static_cast<double>(surface.normal[1]),
                  static_cast<double>(surface.normal[2])};
  return n.z() < 0.0 ? Point3d(-n.x(), -n.y(), -n.z()) : n;
}

/// Mean of the normals of what is flat that are within an angle of `up`.
Point3d mean_normal(const MapSketch& sketch, const Point3d& up, double least_cosine) noexcept {
  Point3d sum = Point3d::Zero();
  for (std::uint32_t i = 0; i < sketch.surface_count(); ++i) {
    const Surface& surface = sketch.surface(i);
    if (surface.kind != MapSketch::Kind::kFlat) continue;
    const Point3d n = normal_of(surface);
    if (n.x() * up.x() + n.y() * up.y() + n.z() * up.z() < least_cosine) continue;
    sum += n;
  }
  const double length = norm(sum);
  return length > 0.0 ? Point3d(sum / length) : up;
}

/// The least rotation that takes a unit vector to the z axis.
Matrix3 upright(const Point3d& up) noexcept {
  const double x = up.x();
  const double y = up.y();
  const double k = 1.0 / (1.0 + up.z());
  return {1.0 - k * x * x, -k * x * y, -x, -k * x * y, 1.0 - k * y * y, -y, x, y, up.z()};
}

}  // namespace

Matrix34d Level::transform() const noexcept {
  const Point3d t = to_level(Point3d::Zero());
  const Matrix3& R = rows;
  Matrix34d T;
  T << R[0], R[1], R[2], t.x(), R[3], R[4], R[5], t.y(), R[6], R[7], R[8], t.z();
  return T;
}

Level level_of(const MapSketch& sketch) noexcept {
  Level level;
  for (std::uint32_t i = 0; i < sketch.surface_count(); ++i)
    level.origin_map += sketch.center_of(sketch.surface(i));
  if (sketch.surface_count() != 0) level.origin_map /= static_cast<double>(sketch.surface_count());
  constexpr double kCos12 = 0.9781;
  constexpr double kCos6 = 0.9945;
  Point3d up{0.0, 0.0, 1.0};
  up = mean_normal(sketch, up, kCos12);
  up = mean_normal(sketch, up, kCos6);
  up = mean_normal(sketch, up, kCos6);
  level.rows = upright(up);
  return level;
}

Result<Columns> Columns::make(Arena& arena) noexcept {
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes())
    return Status::kResourceExhausted;
  Columns result;
  result.columns_ = arena.take<Column>(kCount);
  return result;
}

Columns::Column* Columns::column_at(const Point3d& p_level) noexcept {
  const int x = place(p_level.x());
  const int y = place(p_level.y());
  if (x < 0 || y < 0 || x >= kEdge || y >= kEdge) return nullptr;
  return &columns_[static_cast<std::size_t>(y) * kEdge + static_cast<std::size_t>(x)];
}

double Columns::width_of(const MapSketch& sketch) noexcept {
  constexpr double kLeastWidth_m = 0.79;  // so that 192 shifts are 75 m both ways
  double width_m = sketch.cell_m();
  while (width_m < kLeastWidth_m) width_m += sketch.cell_m();
  return width_m;
}

void Columns::draw(const MapSketch& sketch, const Level& level) noexcept {
  width_m_ = width_of(sketch);
  for (Column& column : columns_) column = Column{};
  constexpr double kMostHeight_m = 1000.0;
  for (std::uint32_t i = 0; i < sketch.surface_count(); ++i) {
    const Point3d p = level.to_level(sketch.center_of(sketch.surface(i)));
    Column* const column = column_at(p);
    if (column == nullptr || p.z() > kMostHeight_m || p.z() < -kMostHeight_m) continue;
    const auto height = static_cast<std::int16_t>(floor_to_int(p.z() / kHeightStep_m));
    if (height < column->lowest) column->lowest = height;
    column->marks = ColumnMarks::kSeen;
  }
  find_ground();
  for (std::uint32_t i = 0; i < sketch.surface_count(); ++i) {
    const Surface& surface = sketch.surface(i);
    if (surface.kind == MapSketch::Kind::kUpright)
      mark(level.to_level(sketch.center_of(surface)), ColumnMarks::kLow, ColumnMarks::kTall);
  }
  for (std::uint32_t i = 0; i < sketch.free_cell_count(); ++i)
    mark(level.to_level(sketch.middle_of(sketch.free_cell(i).key)), ColumnMarks::kLowFree,
         ColumnMarks::kTallFree);
  standing_ = 0;
  for (Column& column : columns_) {
    if ((column.marks & (ColumnMarks::kLow | ColumnMarks::kTall)) != 0) ++standing_;
    if ((column.marks & ColumnMarks::kLow) != 0)
      column.marks &= static_cast<std::uint8_t>(~unsigned{ColumnMarks::kLowFree});
    if ((column.marks & ColumnMarks::kTall) != 0)
      column.marks &= static_cast<std::uint8_t>(~unsigned{ColumnMarks::kTallFree});
  }
}

void Columns::mark(const Point3d& p_level, std::uint8_t low, std::uint8_t tall) noexcept {
  Column* const column = column_at(p_level);
  if (column == nullptr || column->lowest == kNone) return;
  const bool is_tall = p_level.z() - column->ground * kHeightStep_m > kTall_m;
  column->marks |= is_tall ? tall : low;
}

void Columns::find_ground() noexcept {
  for (int y = 0; y < kEdge; ++y) {
    for (int x = 0; x < kEdge; ++x) {
      Column& column = columns_[static_cast<std::size_t>(y) * kEdge + static_cast<std::size_t>(x)];
      if (column.lowest != kNone) column.ground = lowest_around(x, y);
    }
  }
}

std::int16_t Columns::lowest_around(int x, int y) const noexcept {
  constexpr int kAround = 2;
  const auto first = [](int place) { return place < kAround ? 0 : place - kAround; };
  std::int16_t least = kNone;
  for (int v = first(y); v <= y + kAround && v < kEdge; ++v) {
    for (int u = first(x); u <= x + kAround && u < kEdge; ++u) {
      const std::int16_t lowest = column(u, v).lowest;
      if (lowest < least) least = lowest;
    }
  }
  return least;
}

}  // namespace tessera
