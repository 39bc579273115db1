// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A sketch seen from above: which columns have something that stands, and how high.
#pragma once

#include <cstdint>
#include <span>

#include "tessera/frames/map_sketch.hpp"

namespace tessera {

/// Where a sketch is levelled: p_level = rows (p_map - origin_map), up along the mean normal of
/// what is flat, about the mean of its surfaces.
struct Level {
  Matrix3 rows{1, 0, 0, 0, 1, 0, 0, 0, 1};
  Point3d origin_map = Point3d::Zero();

  [[nodiscard]] Point3d to_level(const Point3d& p_map) const noexcept {
    const Point3d d = p_map - origin_map;
    return {rows[0] * d.x() + rows[1] * d.y() + rows[2] * d.z(),
            rows[3] * d.x() + rows[4] * d.y() + rows[5] * d.z(),
            rows[6] * d.x() + rows[7] * d.y() + rows[8] * d.z()};
  }
  /// T_level_map.
  [[nodiscard]] Matrix34d transform() const noexcept;
};
/// Up is at most 24 degrees off the z axis of the map, mostly under 12. O(surfaces).
[[nodiscard]] Level level_of(const MapSketch& sketch) noexcept;

/// What a column has: a bit each. Low is up to Columns::kTall_m above the ground around.
struct ColumnMarks {
  static constexpr std::uint8_t kSeen = 1;     ///< Any surface.
  static constexpr std::uint8_t kLow = 2;      ///< Something that stands, low.
  static constexpr std::uint8_t kTall = 4;     ///< Something that stands, higher.
  static constexpr std::uint8_t kLowFree = 8;  ///< Free space, low; but nothing that stands there.
  static constexpr std::uint8_t kTallFree = 16;
};

/// kEdge x kEdge columns about the origin of a levelled sketch.
class Columns {
 public:
  static constexpr int kEdge = 512;
  static constexpr double kTall_m = 1.8;

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<Column>(kCount);
  }
  [[nodiscard]] static Result<Columns> make(Arena& arena) noexcept;
  Columns() noexcept = default;

  /// What columns of a sketch have. O(columns + cells).
  void draw(const MapSketch& sketch, const Level& level) noexcept;
  /// Of a column; each of x and y 0 .. kEdge - 1.
  [[nodiscard]] std::uint8_t marks(int x, int y) const noexcept { return column(x, y).marks; }
  /// Height of its lowest surface in the levelled frame; of one that is seen.
  [[nodiscard]] double lowest_m(int x, int y) const noexcept {
    return column(x, y).lowest * kHeightStep_m;
  }
  /// How many have something that stands.
  [[nodiscard]] std::uint32_t standing() const noexcept { return standing_; }
  [[nodiscard]] double width_m() const noexcept { return width_m_; }
  /// The same of columns of a sketch.
  [[nodiscard]] static double width_of(const MapSketch& sketch) noexcept;
  /// The column of a place on an axis of the levelled frame, which may be outside.
  [[nodiscard]] int place(double level_m) const noexcept {
    return floor_to_int(level_m / width_m_) + kEdge / 2;
  }
  [[nodiscard]] double center_m(int place) const noexcept {
    constexpr int kMiddle = kEdge / 2;
    return (place - kMiddle + 0.5) * width_m_;
  }

 private:
  static constexpr std::size_t kCount = std::size_t{kEdge} * kEdge;
  static constexpr double kHeightStep_m = 0.05;
  static constexpr std::int16_t kNone = 32'767;
  struct Column {
    std::int16_t lowest = kNone;
    std::int16_t ground = kNone;  ///< The lowest of the columns around.
    std::uint8_t marks = 0;
  };
  [[nodiscard]] const Column& column(int x, int y) const noexcept {
    return columns_[static_cast<std::size_t>(y) * kEdge + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] Column* column_at(const Point3d& p_level) noexcept;
  void find_ground() noexcept;
  /// The lowest of the columns around one.
  [[nodiscard]] std::int16_t lowest_around(int x, int y) const noexcept;
  /// Marks what is at a place as low or tall, by its height above the ground around.
  void mark(const Point3d& p_level, std::uint8_t low, std::uint8_t tall) noexcept;

  std::span<Column> columns_;
  double width_m_ = 0.8;
  std::uint32_t standing_ = 0;
};

}  // namespace tessera
