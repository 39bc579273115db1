// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "resampling.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <utility>

#include "tessera/base/rigid.hpp"

namespace tessera::bench {

namespace {

constexpr int kSamples = 4;  ///< Of a voxel, on each axis.
constexpr double kAllSamples = kSamples * kSamples * kSamples;

VoxelCoord voxel_at(const Point3d& p) {
  return {floor_to_int(p.x()), floor_to_int(p.y()), floor_to_int(p.z())};
}
Point3d center_of(const VoxelCoord& voxel) { return {voxel.x + 0.5, voxel.y + 0.5, voxel.z + 0.5}; }

bool is_occupied(const VoxelEvidence& evidence) {
  const double free = static_cast<double>(evidence.sigma[0]);
  return evidence.total() - free > free;
}

void add(const VoxelEvidence& evidence, double weight, VoxelEvidence& sum) {
  for (std::size_t l = 1; l < static_cast<std::size_t>(evidence.num_components); ++l)
    sum.sigma[l] += static_cast<float>(weight * static_cast<double>(evidence.sigma[l]));
  sum.rest += static_cast<float>(weight * static_cast<double>(evidence.rest));
}

/// What a voxel of the new grid overlaps: the old ones, with how many of its samples each has.
using Shares = std::vector<std::pair<VoxelCoord, int>>;

Shares shares_of(const NewGrid& grid, const VoxelCoord& voxel) {
  Shares shares;
  for (int i = 0; i < kSamples * kSamples * kSamples; ++i) {
    const auto along = [](int n) { return (n + 0.5) / kSamples; };
    const VoxelCoord taken = voxel_at(
        grid.to_old({voxel.x + along(i % kSamples), voxel.y + along(i / kSamples % kSamples),
                     voxel.z + along(i / kSamples / kSamples)}));
    const auto known =
        std::find_if(shares.begin(), shares.end(), [&](const auto& s) { return s.first == taken; });
    if (known != shares.end()) {
      ++known->second;
    } else {
      shares.emplace_back(taken, 1);
    }
  }
  return shares;
}

/// By overlap: labels and free evidence alike, or free evidence as the least of what is overlapped
/// where at least that share is occupied.
VoxelEvidence by_shares(const LocalMap& map, const NewGrid& grid, const VoxelCoord& voxel,
                        double least_occupied) {
  VoxelEvidence sum{.num_components = map.num_components()};
  double free = 0.0;
  double occupied = 0.0;
  double least_free = std::numeric_limits<double>::infinity();
  for (const auto& [taken, samples] : shares_of(grid, voxel)) {
    const VoxelEvidence evidence = map.evidence(taken);
    const double weight = samples / kAllSamples;
    add(evidence, weight, sum);
    free += weight * static_cast<double>(evidence.sigma[0]);
    least_free = std::min(least_free, static_cast<double>(evidence.sigma[0]));
    occupied += is_occupied(evidence) ? weight : 0.0;
  }
  sum.sigma[0] = static_cast<float>(occupied >= least_occupied ? least_free : free);
  return sum;
}

/// The mean of the labels of what is occupied, where that is at least such a share of the voxel.
VoxelEvidence by_occupied(const LocalMap& map, const NewGrid& grid, const VoxelCoord& voxel,
                          double least) {
  VoxelEvidence sum{.num_components = map.num_components()};
  double free = 0.0;
  double occupied = 0.0;
  const Shares shares = shares_of(grid, voxel);
  for (const auto& [taken, samples] : shares)
    if (is_occupied(map.evidence(taken))) occupied += samples / kAllSamples;
  for (const auto& [taken, samples] : shares) {
    const VoxelEvidence evidence = map.evidence(taken);
    const double weight = samples / kAllSamples;
    free += weight * static_cast<double>(evidence.sigma[0]);
    if (is_occupied(evidence)) add(evidence, weight / occupied, sum);
  }
  if (occupied >= least) return sum;
  sum = {.num_components = map.num_components()};
  sum.sigma[0] = static_cast<float>(free);
  return sum;
}

struct Patch {
  double half = 0.5;    ///< Of its edge, voxels.
  double least = 0.15;  ///< Share of patches that keeps a voxel from being free.
};

/// A voxel with returns in it gives its labels to where a box around their mean is, cut off at the
/// voxel's own faces, and an eighth to the voxels whose centre is in it; others to the latter
/// alone.
VoxelEvidence by_patches(const LocalMap& map, const MeansOfReturns& means, const NewGrid& grid,
                         const VoxelCoord& voxel, const Patch& patch) {
  constexpr double kToCentres = 0.125;
  const VoxelCoord middle = voxel_at(grid.to_old(center_of(voxel)));
  const VoxelEvidence own = map.evidence(middle);
  const bool has_returns = means.find(middle) != nullptr;
  VoxelEvidence sum{.num_components = map.num_components()};
  add(own, has_returns ? kToCentres : 1.0, sum);
  double share = 0.0;
  double free = 0.0;
  for (int n = 0; n < 27; ++n) {
    const VoxelCoord old{middle.x + n % 3 - 1, middle.y + n / 3 % 3 - 1, middle.z + n / 9 - 1};
    const Point3d* const mean = means.find(old);
    if (mean == nullptr) continue;
    const VoxelEvidence evidence = map.evidence(old);
    if (!is_occupied(evidence)) continue;
    int inside = 0;
    for (int i = 0; i < 27; ++i) {
      const auto along = [&](double m, int at) {
        return std::clamp(m + patch.half * (at - 1) * 2.0 / 3.0, -0.499, 0.499);
      };
      const Point3d offset(along(mean->x(), i % 3), along(mean->y(), i / 3 % 3),
                           along(mean->z(), i / 9));
      inside += voxel_at(grid.to_new(center_of(old) + offset)) == voxel ? 1 : 0;
    }
    if (inside == 0) continue;
    const double weight = inside / 27.0;
    add(evidence, weight, sum);
    share += weight;
    free += weight * static_cast<double>(evidence.sigma[0]);
  }
  double left = static_cast<double>(own.sigma[0]);
  if (share >= patch.least) left = std::min(left, free);
  sum.sigma[0] = static_cast<float>(left);
  return sum;
}

}  // namespace

Matrix34d transform_of(const Frame& frame, double resolution_m) {
  constexpr double kRadians = std::numbers::pi / 180.0;
  const double yaw = frame.yaw_deg * kRadians;
  const double tilt = frame.tilt_deg * kRadians;
  const double a = std::sqrt(0.5);
  const double c = std::cos(tilt);
  const double s = std::sin(tilt) * a;
  Eigen::Matrix3d tilted;
  tilted << 0.5 * (1.0 + c), 0.5 * (1.0 - c), s, 0.5 * (1.0 - c), 0.5 * (1.0 + c), -s, -s, s, c;
  Eigen::Matrix3d turned;
  turned << std::cos(yaw), -std::sin(yaw), 0.0, std::sin(yaw), std::cos(yaw), 0.0, 0.0, 0.0, 1.0;
  Matrix34d T;
  T.leftCols<3>() = turned * tilted;
  T.col(3).setConstant(frame.shift_voxels * resolution_m);
  return T;
}

std::vector<Frame> frames() {
  std::vector<Frame> all;
  for (const double yaw_deg : {0.0, 5.0, 22.5, 45.0})
    for (const double tilt_deg : {0.0, 3.0})
      for (const double shift_voxels : {0.0, 0.25, 0.5})
        all.push_back({yaw_deg, tilt_deg, shift_voxels});
  return all;
}

MeansOfReturns::MeansOfReturns(const Scene& scene, double resolution_m) {
  const Lattice lattice(resolution_m);
  for (const Scan& scan : scene.scans) {
    for (std::size_t i = 0; i < scan.components.size(); ++i) {
      const Point3f p_map = transform(scan.T_map_sensor, scan.points_xyzi.data() + 4 * i);
      const Result<VoxelCoord> voxel = lattice.voxel_of(p_map);
      if (!voxel.ok()) continue;
      Sum& sum = sums_[key_of(*voxel)];
      sum.sum += (p_map.cast<double>() - lattice.center_of(*voxel)) / resolution_m;
      ++sum.count;
    }
  }
  for (const auto& [key, sum] : sums_) {
    const auto rounded = [&](Eigen::Index axis) {
      const double level = std::floor((sum.sum(axis) / sum.count + 0.5) * kLevels);
      return (std::clamp(level, 0.0, kLevels - 1.0) + 0.5) / kLevels - 0.5;
    };
    means_[key] = Point3d(rounded(0), rounded(1), rounded(2));
  }
}

const Point3d* MeansOfReturns::find(const VoxelCoord& voxel) const {
  const auto found = means_.find(key_of(voxel));
  return found == means_.end() ? nullptr : &found->second;
}

std::vector<Way> ways_to_resample(const MeansOfReturns& means) {
  using Voxel = const VoxelCoord&;
  using Map = const LocalMap&;
  using Grid = const NewGrid&;
  constexpr double kNever = 2.0;
  std::vector<Way> ways{
      {"shares of volume", [](Map m, Grid g, Voxel v) { return by_shares(m, g, v, kNever); }},
      {"shares, free the least",
       [](Map m, Grid g, Voxel v) { return by_shares(m, g, v, 1.0 / 64.0); }},
      {"occupied by a third", [](Map m, Grid g, Voxel v) { return by_occupied(m, g, v, 0.33); }},
      {"occupied by half", [](Map m, Grid g, Voxel v) { return by_occupied(m, g, v, 0.5); }},
  };
  for (const Patch patch : {Patch{0.2, 0.3}, Patch{0.3, 0.15}, Patch{0.5, 0.3}}) {
    char name[48];
    std::snprintf(name, sizeof(name), "means of returns, %.1f, %.2f", patch.half, patch.least);
    ways.push_back({name, [patch, &means](Map m, Grid g, Voxel v) {
                      return by_patches(m, means, g, v, patch);
                    }});
  }
  return ways;
}

}  // namespace tessera::bench
