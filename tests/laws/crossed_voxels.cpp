// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "laws/crossed_voxels.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera::oracle {

void CrossedVoxels::add_ray(const Point3f& end_map) {
  ends_.push_back(end_map.cast<double>() / voxel_m_);
}

void CrossedVoxels::add_hit(const Point3f& end_map) {
  add_ray(end_map);
  const Point3d& q = ends_.back();
  hits_.insert({static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())),
                static_cast<int>(std::floor(q.z()))});
}

bool CrossedVoxels::is_hit(const VoxelCoord& voxel) const {
  return hits_.count({voxel.x, voxel.y, voxel.z}) != 0;
}

bool CrossedVoxels::is_crossed(const VoxelCoord& voxel) {
  if (last_ < ends_.size() && meets(ends_[last_], voxel)) return true;
  for (last_ = 0; last_ < ends_.size(); ++last_) {
    if (meets(ends_[last_], voxel)) return true;
  }
  return false;
}

/// The segment's part within the voxel's three slabs, grown by the tolerance, is not empty.
bool CrossedVoxels::meets(const Point3d& end, const VoxelCoord& voxel) const {
  const std::array<int, 3> corner{voxel.x, voxel.y, voxel.z};
  double enter = 0.0;
  double leave = 1.0;
  for (int i = 0; i < 3; ++i) {
    const double low = corner[static_cast<std::size_t>(i)] - kTolerance_voxels - origin_[i];
    const double high = low + 1.0 + 2.0 * kTolerance_voxels;
    const double d = end[i] - origin_[i];
    if (std::abs(d) < 1e-12) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    enter = std::max(enter, std::min(low / d, high / d));
    leave = std::min(leave, std::max(low / d, high / d));
  }
  return enter <= leave;
}

}  // namespace tessera::oracle
