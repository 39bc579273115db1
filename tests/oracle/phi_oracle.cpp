// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "oracle/fusion_oracle.hpp"

namespace tessera::oracle {

namespace {

std::array<double, 3> center_of(const Voxel& v, double resolution_m) {
  return {(static_cast<double>(v[0]) + 0.5) * resolution_m,
          (static_cast<double>(v[1]) + 0.5) * resolution_m,
          (static_cast<double>(v[2]) + 0.5) * resolution_m};
}

/// The voxel that a local one's centre is in.
Voxel image_of(const Matrix34d& T_global_local, double resolution_m, const Voxel& local) {
  const std::array<double, 3> c = center_of(local, resolution_m);
  const Eigen::Vector3d image =
      T_global_local.leftCols<3>() * Eigen::Vector3d(c[0], c[1], c[2]) + T_global_local.col(3);
  return cell_of({image.x(), image.y(), image.z()}, resolution_m);
}

bool is_shift(const Matrix34d& T, double resolution_m) {
  if (T.leftCols<3>() != Eigen::Matrix3d::Identity()) return false;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double voxels = T(i, 3) / resolution_m;
    if (std::fabs(voxels - std::round(voxels)) > 1e-9) return false;
  }
  return true;
}

/// The voxels that the corners of a box of 0.36 voxels around the returns are in, an eighth each;
/// what would be beyond the voxel's faces is just within them.
std::map<Voxel, double> boxes(const OracleContribution& one, double resolution_m,
                              const Voxel& local) {
  std::map<Voxel, double> shares;
  const std::array<int, 3>& levels = one.centroids.at(local);
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d place;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double middle = (levels[axis] + 0.5) / 6.0;
      const double end = ((corner >> axis) & 1) != 0 ? middle + 0.18 : middle - 0.18;
      place(static_cast<Eigen::Index>(axis)) =
          (static_cast<double>(local[axis]) + std::clamp(end, 0.001, 0.999)) * resolution_m;
    }
    const Eigen::Vector3d image =
        one.T_global_local.leftCols<3>() * place + one.T_global_local.col(3);
    shares[cell_of({image.x(), image.y(), image.z()}, resolution_m)] += 0.125;
  }
  return shares;
}

}  // namespace

std::vector<Voxel> takers_of(const Matrix34d& T_global_local, double resolution_m,
                             const Voxel& local) {
  const Eigen::Matrix3d R = T_global_local.leftCols<3>();
  const Eigen::Vector3d t = T_global_local.col(3);
  const Voxel nearest = image_of(T_global_local, resolution_m, local);
  std::vector<Voxel> takers;
  for (std::int64_t dz = -2; dz <= 2; ++dz) {
    for (std::int64_t dy = -2; dy <= 2; ++dy) {
      for (std::int64_t dx = -2; dx <= 2; ++dx) {
        const Voxel g{nearest[0] + dx, nearest[1] + dy, nearest[2] + dz};
        const std::array<double, 3> gc = center_of(g, resolution_m);
        const Eigen::Vector3d back = R.transpose() * (Eigen::Vector3d(gc[0], gc[1], gc[2]) - t);
        if (cell_of({back.x(), back.y(), back.z()}, resolution_m) == local) takers.push_back(g);
      }
    }
  }
  return takers;
}

std::vector<Voxel> phi(const Matrix34d& T_global_local, double resolution_m, const Voxel& local) {
  std::vector<Voxel> takers = takers_of(T_global_local, resolution_m, local);
  if (takers.empty()) takers.push_back(image_of(T_global_local, resolution_m, local));
  return takers;
}

std::map<Voxel, OracleGiven> resampled(const OracleContribution& one, double resolution_m) {
  std::map<Voxel, OracleGiven> given;
  const bool turned = !is_shift(one.T_global_local, resolution_m);
  for (const auto& [local, counts] : one.voxels) {
    if (!turned || !one.centroids.contains(local)) {
      for (const Voxel& voxel : phi(one.T_global_local, resolution_m, local))
        given[voxel].add(counts, 1.0, true);
      continue;
    }
    std::map<Voxel, double> parts = boxes(one, resolution_m, local);
    for (const auto& [voxel, share] : parts) {
      given[voxel].share += share;
      given[voxel].of_surface += share * counts[0];
    }
    // Passes as without a centroid.
    const std::vector<Voxel> takers = phi(one.T_global_local, resolution_m, local);
    const bool is_taken = !takers_of(one.T_global_local, resolution_m, local).empty();
    for (const Voxel& voxel : takers) parts.try_emplace(voxel, is_taken ? 0.125 : 0.0);
    for (const auto& [voxel, part] : parts) {
      if (part == 0.0 && counts[0] == 0.0) continue;
      const bool takes = std::find(takers.begin(), takers.end(), voxel) != takers.end();
      given[voxel].add(counts, part, takes);
    }
  }
  for (auto& [voxel, here] : given) {
    if (here.share >= 0.3)
      here.counts[0] = std::min(here.counts[0], std::floor(here.of_surface + 0.5));
  }
  return given;
}

}  // namespace tessera::oracle
