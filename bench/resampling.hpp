// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames, and ways to bring a map into another grid, to compare them with the library's. Each gives
// what one voxel of the new grid has, from the voxels around it in the old one.
#pragma once

#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

#include "scenes.hpp"

namespace tessera::bench {

/// A voxel as one number.
[[nodiscard]] constexpr std::uint64_t key_of(const VoxelCoord& voxel) noexcept {
  const auto bits = [](std::int32_t c) { return static_cast<std::uint64_t>(c + (1 << 20)); };
  return bits(voxel.x) << 42U | bits(voxel.y) << 21U | bits(voxel.z);
}

/// The mean of the returns in each voxel, in voxels from its centre.
class MeansOfReturns {
 public:
  MeansOfReturns(const Scene& scene, double resolution_m);
  /// Rounded to so many levels an axis; null: no return is in the voxel.
  [[nodiscard]] const Point3d* find(const VoxelCoord& voxel) const;

 private:
  static constexpr int kLevels = 6;  ///< Three axes are a byte then.
  struct Sum {
    Point3d sum = Point3d::Zero();
    int count = 0;
  };
  std::unordered_map<std::uint64_t, Sum> sums_;
  std::unordered_map<std::uint64_t, Point3d> means_;
};

struct Frame {
  double yaw_deg = 0.0;
  double tilt_deg = 0.0;      ///< Around the line x = y of the ground.
  double shift_voxels = 0.0;  ///< On each axis.
};

[[nodiscard]] Matrix34d transform_of(const Frame& frame, double resolution_m);
/// Those in which ways are compared.
[[nodiscard]] std::vector<Frame> frames();

/// Where a map is in another grid of the same resolution. Coordinates are voxels.
struct NewGrid {
  NewGrid(const Matrix34d& T_new_old, double resolution_m)
      : R(T_new_old.leftCols<3>()), t(T_new_old.col(3) / resolution_m) {}
  [[nodiscard]] Point3d to_new(const Point3d& p_old) const { return R * p_old + t; }
  [[nodiscard]] Point3d to_old(const Point3d& p_new) const { return R.transpose() * (p_new - t); }
  Eigen::Matrix3d R;
  Point3d t;
};

struct Way {
  std::string name;
  /// Of a voxel of the new grid.
  std::function<VoxelEvidence(const LocalMap&, const NewGrid&, const VoxelCoord&)> evidence;
};

/// means must outlive them.
[[nodiscard]] std::vector<Way> ways_to_resample(const MeansOfReturns& means);

}  // namespace tessera::bench
