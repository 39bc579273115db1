// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Registration: a scan's returns into the map frame, and which of them count.
#include <cmath>

#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

/// What a return's distance and place are held against: the same for a whole scan.
struct Limits {
  Limits(const InferenceConfig& config, double resolution_m, int unit_edge) noexcept
      : min_square(static_cast<double>(config.min_range_m) *
                   static_cast<double>(config.min_range_m)),
        max_m(static_cast<double>(config.max_range_m)),
        // A tile of units of one voxel is half a block, so that tile numbers end at half the grid.
        voxels(unit_edge == 1 ? kVoxelLimit / 2 : kVoxelLimit) {
    // So that differences of cell and tile numbers within a scan fit 21 bits an axis.
    const double cell_m = config.thinning_m;
    const double finest_m = cell_m > 0.0 && cell_m < resolution_m ? cell_m : resolution_m;
    const double reach_m = 0.5 * kBlockLimit * finest_m;
    reach_square = reach_m * reach_m;
    max_square = max_m > 0.0 ? max_m * max_m : 1e300;
  }
  /// Written so that NaN fails.
  [[nodiscard]] bool in_grid(const Point3d& q) const noexcept {
    return q.x() >= -voxels && q.x() < voxels && q.y() >= -voxels && q.y() < voxels &&
           q.z() >= -voxels && q.z() < voxels;
  }

  double min_square;
  double max_m;
  double max_square = 0.0;
  double reach_square = 0.0;
  double voxels;
};

}  // namespace

void Integrator::register_points(const LocalMap& map, const ScanView& scan,
                                 ScanReport& report) noexcept {
  // A scan with more returns than fit is sampled evenly, so that what is left is still all around
  // the sensor.
  const std::uint64_t kept = scan.count < registered_.size() ? scan.count : registered_.size();
  report.over_capacity = static_cast<std::uint32_t>(scan.count - kept);
  const Limits limits(config_, map.lattice().resolution_m(), unit_edge());
  const Lattice lattice = map.lattice();
  const int unlabelled = map.classes().unlabelled();
  const Matrix34d T_map_sensor = scan.T_map_sensor;
  for (std::uint64_t k = 0; k < kept; ++k) {
    if (k % kReturnBatch == 0 && !in_time()) {
      report.returns_cut = static_cast<std::uint32_t>(kept);
      registered_count_ = far_count_ = 0;
      return;
    }
    const auto i = static_cast<std::size_t>(kept == scan.count ? k : k * scan.count / kept);
    const float* const p_sensor = scan.points + i * scan.stride_floats;
    const double square =
        squared_norm(static_cast<double>(p_sensor[0]), static_cast<double>(p_sensor[1]),
                     static_cast<double>(p_sensor[2]));
    const float weight = scan.weights == nullptr ? 1.0F : scan.weights[i];
    // The square of a finite float does not overflow a double.
    if (!(square < 1e300) || !(weight >= 0.0F && weight <= kMaxWeight)) {
      ++report.non_finite;
      continue;
    }
    if (square < limits.min_square) {
      ++report.too_near;
      continue;
    }
    ScanPoint point{.p_map = transform(T_map_sensor, p_sensor), .weight = weight};
    const bool far = square > limits.max_square;
    if (far) {
      const Point3d ray = point.p_map.cast<double>() - origin_map_;
      point.p_map = (origin_map_ + ray * (limits.max_m / norm(ray))).cast<float>();
    }
    if ((far ? limits.max_square : square) > limits.reach_square ||
        !limits.in_grid(lattice.to_voxels(point.p_map))) {
      ++report.out_of_grid;
      continue;
    }
    if (far) {
      ++report.beyond_range;
      if (config_.free_space.enabled) registered_[registered_.size() - ++far_count_] = point;
      continue;
    }
    const std::uint8_t component =
        scan.components == nullptr ? std::uint8_t{0} : scan.components[i];
    const bool known = component >= 1 && component < unlabelled;
    point.component = known ? component : static_cast<std::uint8_t>(unlabelled);
    report.unlabelled += known ? 0U : 1U;
    registered_[registered_count_++] = point;
  }
}

}  // namespace tessera
