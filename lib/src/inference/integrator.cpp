// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/integrator.hpp"

#include <cmath>

#include "tessera/inference/internal/thinning.hpp"
#include "tessera/inference/kernel.hpp"

namespace tessera {

namespace {

bool valid(const InferenceConfig& config) noexcept {
  if (config.mode > InferenceMode::kMultiEntropy || config.thinning_weight > ThinningWeight::kSum) {
    return false;
  }
  const auto within = [](float v, float low, float high) { return v >= low && v <= high; };
  const EntropyConfig& e = config.entropy;
  const bool entropy = within(e.base_length, 0.0F, 16.0F) &&
                       within(e.entropy_length, 0.0F, 16.0F) &&
                       within(e.fill_length, 0.0F, 16.0F) && within(e.smooth_above, 0.0F, 2.0F) &&
                       e.fill_neighbours >= 1 && e.fill_neighbours <= 7 &&
                       (e.block_edge == 1 || e.block_edge == 2 || e.block_edge == 4);
  const bool ranges =
      within(config.min_range_m, 0.0F, 1e6F) && within(config.max_range_m, 0.0F, 1e6F) &&
      (config.max_range_m == 0.0F || config.max_range_m > config.min_range_m) &&
      (config.thinning_m == 0.0 || (config.thinning_m >= 1e-3 && config.thinning_m <= 1e3));
  const bool kernel = within(config.kernel_length_m, 1e-3F, 1e3F) &&
                      within(config.kernel_scale, 1e-6F, 1e6F) &&
                      within(config.min_weight, 0.0F, 1.0F);
  const bool carving =
      within(config.free_space.neighbour_angle_rad, 0.0F, RangeImage::kMaxAngle_rad) &&
      within(config.free_space.margin_voxels, 0.0F, 64.0F);
  return entropy && ranges && kernel && carving;
}

}  // namespace

Result<Integrator> Integrator::make(Arena& arena, const InferenceConfig& config,
                                    const ScanCapacity& capacity) noexcept {
  const bool capacities = capacity.points > 0 && capacity.points <= ScanCapacity::kMaxPoints &&
                          capacity.tiles > 0 && capacity.ray_blocks > 0;
  if (!valid(config) || !capacities) return Status::kInvalidArgument;
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes(capacity, config)) {
    return Status::kResourceExhausted;
  }
  Integrator result;
  result.config_ = config;
  result.registered_ = arena.take<ScanPoint>(capacity.points);
  result.admitted_ = arena.take<ScanPoint>(capacity.points);
  result.sort_ = arena.take<KeyedIndex>(2 * std::size_t{capacity.points});
  result.octet_ = arena.take<OctetEvidence>(1);
  const Result<ScanTiles> tiles = ScanTiles::make(arena, capacity);
  if (!tiles.ok()) return tiles.status();
  result.tiles_ = *tiles;
  if (config.mode == InferenceMode::kKernel) {
    const Result<KernelStrip> strip = KernelStrip::make(arena);
    if (!strip.ok()) return strip.status();
    result.strip_ = *strip;
  }
  if (config.free_space.enabled) {
    const Result<FreeSpace> free_space = FreeSpace::make(arena, capacity);
    if (!free_space.ok()) return free_space.status();
    result.free_space_ = *free_space;
  }
  return result;
}

ScanReport Integrator::integrate(LocalMap& map, const ScanView& scan) noexcept {
  return integrate_scan(map, scan);
}

ScanReport Integrator::integrate_scan(LocalMap& map, const ScanView& scan) noexcept {
  ScanReport report;
  report.points = static_cast<std::uint32_t>(scan.count);
  admitted_count_ = ray_count_ = registered_count_ = far_count_ = rays_cut_ = 0;
  cut_ = false;
  report.pose = check_rigid(scan.T_map_sensor);
  if (report.pose == Status::kOk && !place_sensor(map.lattice(), scan.T_map_sensor.col(3)))
    report.pose = Status::kInvalidArgument;
  if (report.pose != Status::kOk) return report;
  map.begin_revision();

  register_points(map, scan, report);
  if (cut_) return report;
  thin_points(map, report);
  measure_kernel(map.lattice().resolution_m());
  if (!in_time()) {
    leave_out_all(report);
    return report;
  }
  begin_scratch(map);
  open_failed_ = false;
  const bool all_fit = admit(map, report);
  if (cut_) {
    leave_out_all(report);
  } else {
    write(map, report);
  }
  close_unwritten_blocks(map, all_fit && !cut_);
  report.admitted = static_cast<std::uint32_t>(admitted_count_);
  return report;
}

/// Asked in double first: rounding a coordinate beyond the floats would be undefined.
bool Integrator::place_sensor(const Lattice& lattice, const Point3d& origin_map) noexcept {
  if (!lattice.voxel_of(origin_map).ok()) return false;
  const Result<VoxelCoord> voxel = lattice.voxel_of(round_to_float(origin_map));
  if (!voxel.ok()) return false;
  origin_map_ = origin_map;
  origin_voxel_ = *voxel;
  return true;
}

bool Integrator::admit(LocalMap& map, ScanReport& report) noexcept {
  set_work_limit(report);
  if (!cut_) shed_points(report);
  const bool tried = !cut_ && within_limit(report) && !memory_was_short_;
  const bool all_fit = tried && fill_scratch(map) && fits_whole(map) && open_blocks(map);
  if (!all_fit && !cut_) {
    if (open_failed_) map.close_empty_blocks();
    report.ray_steps = free_space_.steps();  // on trial
    if (tried) begin_scratch(map);
    admit_one_by_one(map, report);
    tiles_.forget_points();
    free_space_.forget_marks();
    if (!(in_time() && fill_scratch(map) && open_blocks(map)) && !cut_) refuse_all(map, report);
  }
  memory_was_short_ = report.refused_memory() + report.rays_refused_memory > 0;
  report.tiles = static_cast<std::uint32_t>(tiles_.tiles().size());
  report.ray_blocks = static_cast<std::uint32_t>(free_space_.blocks().size());
  report.ray_steps += free_space_.steps();
  return all_fit;
}

/// What admission reserved was not there: nothing of the scan is written, and that is counted.
void Integrator::refuse_all(const LocalMap& map, ScanReport& report) noexcept {
  TESSERA_ASSERT(false);
  ++report.write_faults;
  report.refused_storage += static_cast<std::uint32_t>(admitted_count_);
  report.rays_refused_memory += static_cast<std::uint32_t>(ray_count_);
  admitted_count_ = ray_count_ = rays_cut_ = 0;
  open_failed_ = true;
  begin_scratch(map);
}

void Integrator::begin_scratch(const LocalMap& map) noexcept {
  tiles_.reset(unit_edge());
  if (config_.free_space.enabled) free_space_.begin(config_.free_space, map.lattice(), origin_map_);
}

void Integrator::thin_points(const LocalMap& map, ScanReport& report) noexcept {
  const int unlabelled = map.classes().unlabelled();
  const auto thin_or_copy = [&](std::span<const ScanPoint> from, std::span<ScanPoint> to) {
    if (config_.thinning_m > 0.0)
      return thin(from, map.lattice(), config_.thinning_m, unlabelled, to, sort_,
                  config_.thinning_weight);
    for (std::size_t i = 0; i < from.size(); ++i) to[i] = from[i];
    return from.size();
  };
  admitted_count_ = thin_or_copy(registered_.first(registered_count_), admitted_);
  rays_ = admitted_.subspan(admitted_count_);
  ray_count_ = thin_or_copy(registered_.last(far_count_), rays_);
  report.thinned = static_cast<std::uint32_t>(admitted_count_);
  largest_weight_ = 0.0F;
  for (const ScanPoint& point : admitted())
    largest_weight_ = point.weight > largest_weight_ ? point.weight : largest_weight_;
}

void Integrator::measure_kernel(double resolution_m) noexcept {
  const double length = static_cast<double>(config_.kernel_length_m) / resolution_m;
  // Weights above one can lift a contribution over the cut-off anywhere in the ball.
  const double lift =
      static_cast<double>(largest_weight_) * static_cast<double>(config_.kernel_scale);
  const double cut = lift > 0.0 ? static_cast<double>(config_.min_weight) / lift : 1.0;
  const auto s = static_cast<double>(Kernel::support(cut < 1.0 ? cut : 1.0));
  kernel_radius_ = static_cast<float>(length * std::sqrt(s));
  kernel_reach_units_ = (static_cast<int>(kernel_radius_ + 1.5F) + 1) / 2;
}

}  // namespace tessera
