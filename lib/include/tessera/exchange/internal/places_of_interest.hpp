// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which part of the world matters to a robot: balls around itself and around places of its route.
#pragma once

#include <array>
#include <span>

#include "tessera/base/geometry.hpp"
#include "tessera/grid/block_extent.hpp"

namespace tessera {

/// Metres of the global frame, corners included.
struct WorldBox {
  std::array<double, 3> low{};
  std::array<double, 3> high{};
};

/// A box around all that blocks of a map may give to the global map: the blocks, and a voxel more
/// for resampling. extent: any(). O(1).
[[nodiscard]] WorldBox world_box(const BlockExtent& extent, const Matrix34d& T_global_map,
                                 double resolution_m) noexcept;

class PlacesOfInterest {
 public:
  static constexpr std::size_t kMost = 16;

  /// The first kMost of them count. radius_m: around each.
  void set(std::span<const Point3d> p_global, double radius_m) noexcept;
  /// False: nothing was set, and all places matter alike.
  [[nodiscard]] bool any() const noexcept { return count_ != 0; }
  /// From the nearest ball to a box, in metres; 0 or less: a part of the box matters, the more the
  /// nearer it is to the ball's middle. 0 where nothing was set. O(kMost).
  [[nodiscard]] double distance_m(const WorldBox& box) const noexcept;

 private:
  std::array<Point3d, kMost> p_global_{};
  std::size_t count_ = 0;
  double radius_m_ = 0.0;
};

}  // namespace tessera
