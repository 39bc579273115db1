// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Registration: a scan's returns into the map frame, and which of them count.
#include <cmath>

#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

/// What a return is held against: the same for a whole scan.
struct Limits {
  Limits(const InferenceConfig& config, const LocalMap& map, const Point3d& origin,
         int unit_edge) noexcept
      : lattice(map.lattice()),
        origin_map(origin),
        min_square(squared(config.min_range_m)),
        max_m(static_cast<double>(config.max_range_m)),
        max_square(max_m > 0.0 ? squared(config.max_range_m) : 1e300),
        // A tile of units of one voxel is half a block, so that tile numbers end at half the grid.
        voxels(unit_edge == 1 ? kVoxelLimit / 2 : kVoxelLimit) {
    // So that differences of cell and tile numbers within a scan fit 21 bits an axis.
    const double cell_m = config.thinning_m;
    const double resolution_m = lattice.resolution_m();
    const double finest_m = cell_m > 0.0 && cell_m < resolution_m ? cell_m : resolution_m;
    const double reach_m = 0.5 * kBlockLimit * finest_m;
    reach_square = reach_m * reach_m;
    // Twice the reach, as a pose may stretch a little.
    near_edge = !(origin.cwiseAbs().maxCoeff() + 2.0 * reach_m < voxels * resolution_m);
  }
  static double squared(float v) noexcept {
    return static_cast<double>(v) * static_cast<double>(v);
  }
  /// Of a place in reach. Written so that NaN fails.
  [[nodiscard]] bool in_grid(const Point3f& p_map) const noexcept {
    if (!near_edge) return true;
    const Point3d q = lattice.to_voxels(p_map);
    return q.x() >= -voxels && q.x() < voxels && q.y() >= -voxels && q.y() < voxels &&
           q.z() >= -voxels && q.z() < voxels;
  }

  Lattice lattice;
  Point3d origin_map;
  double min_square;
  double max_m;
  double max_square;
  double reach_square = 0.0;
  bool near_edge = true;  ///< Places in reach may be outside the grid.
  double voxels;
};

enum class Fate : std::uint8_t { kRefused, kInRange, kFar };

/// Sets point's place and weight; counts what is refused.
Fate register_return(const ScanView& scan, std::size_t i, const Limits& limits, ScanPoint& point,
                     ScanReport& report) noexcept {
  const float* const p_sensor = scan.points + i * scan.stride_floats;
  const double square =
      squared_norm(static_cast<double>(p_sensor[0]), static_cast<double>(p_sensor[1]),
                   static_cast<double>(p_sensor[2]));
  point.weight = scan.weights == nullptr ? 1.0F : scan.weights[i];
  // The square of a finite float does not overflow a double.
  if (!(square < 1e300) || !(point.weight >= 0.0F && point.weight <= kMaxWeight)) {
    ++report.non_finite;
    return Fate::kRefused;
  }
  if (square < limits.min_square) {
    ++report.too_near;
    return Fate::kRefused;
  }
  point.p_map = transform(scan.T_map_sensor, p_sensor);
  const bool far = square > limits.max_square;
  if (far) {
    const Point3d ray = point.p_map.cast<double>() - limits.origin_map;
    point.p_map = (limits.origin_map + ray * (limits.max_m / norm(ray))).cast<float>();
  }
  if ((far ? limits.max_square : square) > limits.reach_square || !limits.in_grid(point.p_map)) {
    ++report.out_of_grid;
    return Fate::kRefused;
  }
  report.beyond_range += far ? 1U : 0U;
  return far ? Fate::kFar : Fate::kInRange;
}

}  // namespace

void Integrator::register_points(const LocalMap& map, const ScanView& scan,
                                 ScanReport& report) noexcept {
  // A scan with more returns than fit is sampled evenly, so that what is left is still all around
  // the sensor.
  const std::uint64_t kept = scan.count < registered_.size() ? scan.count : registered_.size();
  report.over_capacity = static_cast<std::uint32_t>(scan.count - kept);
  const Limits limits(config_, map, origin_map_, unit_edge());
  const int unlabelled = map.classes().unlabelled();
  for (std::uint64_t k = 0; k < kept; ++k) {
    if (k % kReturnBatch == 0 && !in_time()) {
      report.returns_cut = static_cast<std::uint32_t>(kept);
      registered_count_ = far_count_ = 0;
      return;
    }
    const auto i = static_cast<std::size_t>(kept == scan.count ? k : k * scan.count / kept);
    ScanPoint point;
    const Fate fate = register_return(scan, i, limits, point, report);
    if (fate == Fate::kFar && config_.free_space.enabled)
      registered_[registered_.size() - ++far_count_] = point;
    if (fate != Fate::kInRange) continue;
    const std::uint8_t component =
        scan.components == nullptr ? std::uint8_t{0} : scan.components[i];
    const bool known = component >= 1 && component < unlabelled;
    point.component = known ? component : static_cast<std::uint8_t>(unlabelled);
    report.unlabelled += known ? 0U : 1U;
    registered_[registered_count_++] = point;
  }
}

}  // namespace tessera
