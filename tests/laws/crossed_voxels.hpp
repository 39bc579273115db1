// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which voxels rays from one place may free, by testing a voxel against each ray in double
// precision. Shares nothing with the library's walk.
#pragma once

#include <set>
#include <vector>

#include "tessera/grid/lattice.hpp"

namespace tessera::oracle {

class CrossedVoxels {
 public:
  /// A voxel counts as crossed if a ray passes within this of it, in voxels: far above the rounding
  /// of doubles at the grid's edge (2e-9), far below what matters.
  static constexpr double kTolerance_voxels = 1e-6;

  CrossedVoxels(const Point3d& origin_map, double voxel_m)
      : voxel_m_(voxel_m), origin_(origin_map / voxel_m) {}

  void add_ray(const Point3f& end_map);
  /// A ray whose end is a return.
  void add_hit(const Point3f& end_map);

  [[nodiscard]] bool is_hit(const VoxelCoord& voxel) const;
  /// O(rays), less where voxels asked for one after the other lie on the same ray.
  [[nodiscard]] bool is_crossed(const VoxelCoord& voxel);

 private:
  [[nodiscard]] bool meets(const Point3d& end, const VoxelCoord& voxel) const;

  double voxel_m_;
  Point3d origin_;             ///< In voxels.
  std::vector<Point3d> ends_;  ///< In voxels.
  std::set<std::array<int, 3>> hits_;
  std::size_t last_ = 0;  ///< The ray that crossed the last voxel.
};

}  // namespace tessera::oracle
