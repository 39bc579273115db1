// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Walking a straight line through the grid, cell by cell, for queries along rays.
#pragma once

#include <array>
#include <cstdint>

#include "tessera/base/geometry.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera {

/// What is left of a walk through a unit grid, axis by axis. How many steps each axis takes is
/// fixed in advance: rounding can change their order, never where they end.
struct SegmentSteps {
  /// Of an axis that takes no more steps.
  static constexpr double kNever = 1e300;

  std::array<std::int32_t, 3> cell{};
  std::array<std::int32_t, 3> step{};  ///< -1 or 1.
  std::array<std::int32_t, 3> left{};  ///< Steps to come.
  std::array<double, 3> t_next{};      ///< Part of the segment before the axis' next step.
  std::array<double, 3> t_step{};      ///< Part of the segment between two of its steps.

  /// The walk from a to b, before its first step.
  SegmentSteps(const Point3d& a, const Point3d& b) noexcept
      : cell{floor_to_int(a.x()), floor_to_int(a.y()), floor_to_int(a.z())} {
    const std::array<std::int32_t, 3> last{floor_to_int(b.x()), floor_to_int(b.y()),
                                           floor_to_int(b.z())};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      const double d = b[i] - a[i];
      step[axis] = d > 0.0 ? 1 : -1;
      left[axis] = (last[axis] - cell[axis]) * step[axis];
      const double border = cell[axis] + (step[axis] > 0 ? 1 : 0);
      t_step[axis] = left[axis] > 0 ? 1.0 / (d * step[axis]) : kNever;
      t_next[axis] = left[axis] > 0 ? (border - a[i]) / d : kNever;
    }
  }
};

/// Steps through the cells of a unit grid that the segment from a to b crosses, both ends included,
/// ties between axes to x, then y. visit(x, y, z, t) gets the cell and the part of the segment
/// before it, and returns false to stop; false is then returned. Under |dx| + |dy| + |dz| + 4
/// cells.
template <class Visit>
bool walk_segment(const Point3d& a, const Point3d& b, Visit&& visit) noexcept {
  SegmentSteps steps(a, b);
  // Each axis has its own code, as rays that stay on one or two axes are predicted well; indexing
  // by axis would put a trip through memory into every step.
  double t = 0.0;
  const auto advance = [&](std::size_t axis) {
    if (steps.left[axis] <= 0) return false;
    t = steps.t_next[axis];
    steps.cell[axis] += steps.step[axis];
    steps.t_next[axis] =
        --steps.left[axis] > 0 ? steps.t_next[axis] + steps.t_step[axis] : SegmentSteps::kNever;
    return true;
  };
  const auto advance_nearest = [&] {
    if (steps.t_next[1] < steps.t_next[0])
      return steps.t_next[2] < steps.t_next[1] ? advance(2) : advance(1);
    return steps.t_next[2] < steps.t_next[0] ? advance(2) : advance(0);
  };
  do {
    if (!visit(steps.cell[0], steps.cell[1], steps.cell[2], t)) return false;
  } while (advance_nearest());
  return true;
}

}  // namespace tessera
