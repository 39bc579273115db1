// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which returns of a scan are on other robots, and where their rays come to them.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "tessera/base/robot_body.hpp"

namespace tessera {

/// The boxes stay the caller's and must outlive it.
class TeammateFilter {
 public:
  /// Of boxes that are given, so many are used: the first ones.
  static constexpr std::size_t kMost = 64;
  /// Farther from 0 a sensor has none of use, on any axis.
  static constexpr double kFarthest_m = 1e8;

  /// Of no boxes.
  TeammateFilter() noexcept = default;
  /// A box is of use if its transform is rigid, low < high on each axis, no corner is farther than
  /// RobotBody::kFarthest_m from its origin, and the origin is not in it: from there all returns
  /// would be. O(boxes).
  TeammateFilter(std::span<const PlacedBox> boxes, const Point3d& origin_map) noexcept;

  [[nodiscard]] bool any() const noexcept { return used_ != 0; }
  /// Boxes that are of use.
  [[nodiscard]] std::uint32_t count() const noexcept;
  /// The return at p_map, at most 1e9 m from 0, is in a box: at this share of its ray that first
  /// comes to one of those that it is in. Costs a look-up where no box is near, else a transform
  /// a box.
  [[nodiscard]] std::optional<double> share_before(const Point3f& p_map) const noexcept {
    const std::uint64_t row = cells_[cell_of(p_map.y())];
    if ((row >> cell_of(p_map.x()) & 1U) == 0) return std::nullopt;
    return share_in_boxes(p_map);
  }
  /// The share of the way to p_map that is before all boxes; 1: it meets none. O(boxes).
  [[nodiscard]] double share_clear(const Point3d& p_map) const noexcept;

 private:
  /// A map of where boxes are, seen from above: cells of so much, and after 64 the first again.
  static constexpr double kCell_m = 1.0;
  static constexpr std::size_t kCells = 64;

  /// Of a negative whole number, the one below its own.
  [[nodiscard]] static std::size_t cell_of(float at_m) noexcept {
    const auto floor = static_cast<std::int32_t>(at_m) - (at_m < 0.0F ? 1 : 0);
    return static_cast<std::size_t>(floor) % kCells;
  }
  /// Where a box is, seen from above.
  struct Area {
    float low_x = 0.0F;
    float high_x = 0.0F;
    float low_y = 0.0F;
    float high_y = 0.0F;
  };
  void mark(std::size_t number) noexcept;
  [[nodiscard]] std::optional<double> share_in_boxes(const Point3f& p_map) const noexcept;
  template <class Visit>
  void for_used(Visit&& visit) const noexcept;

  std::span<const PlacedBox> boxes_;
  Point3d origin_map_ = Point3d::Zero();
  std::uint64_t used_ = 0;  ///< Bit i: box i is.
  std::array<std::uint64_t, kCells> cells_{};
  std::array<Area, kMost> areas_;  ///< Of those that are used.
};

}  // namespace tessera
