// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Integrating until a given time: the limit that time sets, and what is left out where it comes.
#include "tessera/inference/integrator.hpp"

namespace tessera {

ScanReport Integrator::integrate(LocalMap& map, const ScanView& scan, Deadline& deadline,
                                 std::int64_t due_us) noexcept {
  deadline.begin(due_us);
  deadline_ = &deadline;
  ScanReport report = integrate_scan(map, scan);
  deadline_ = nullptr;
  // Bounds were predicted, so bounds are what the rate is of; but not those of work that was cut.
  const bool whole = report.tiles_cut + report.ray_blocks_cut + report.rays_cut == 0 && !cut_;
  deadline.end(whole ? report.work_predicted : report.work_spent());
  report.overshoot_us = deadline.overshoot_us();
  return report;
}

bool Integrator::in_time(std::uint64_t work) noexcept {
  if (deadline_ == nullptr || cut_) return !cut_;
  const bool fits = deadline_->allows(work);
  cut_ = deadline_->past();
  return fits;
}

void Integrator::set_work_limit(ScanReport& report) noexcept {
  work_limit_ = config_.work_budget == 0 ? kNoLimit : config_.work_budget;
  limit_is_deadline_ = false;
  if (deadline_ != nullptr) {
    const std::uint64_t fits = deadline_->begin_work();
    cut_ = deadline_->past();
    limit_is_deadline_ = fits < work_limit_;
    if (limit_is_deadline_) work_limit_ = fits;
  }
  report.work_limit = work_limit_ == kNoLimit ? 0 : work_limit_;
}

void Integrator::leave_out_all(ScanReport& report) noexcept {
  report.refused_deadline += static_cast<std::uint32_t>(admitted_count_);
  report.rays_refused_deadline += static_cast<std::uint32_t>(ray_count_);
  admitted_count_ = ray_count_ = rays_cut_ = 0;
}

void Integrator::count_cut_tile(const Tile& tile, ScanReport& report) const noexcept {
  ++report.tiles_cut;
  if (tile.occupied == 0) return;
  const std::uint32_t begin = tiles_.sample(tile, std::countr_zero(tile.occupied)).begin;
  const std::uint32_t end = tiles_.sample(tile, 63 - std::countl_zero(tile.occupied)).end;
  report.points_cut += end - begin;
}

BlockCoord Integrator::sensor_place(const LocalMap& map, bool blocks) const noexcept {
  const VoxelCoord voxel = *map.lattice().voxel_of(origin_map_.cast<float>());
  return blocks ? block_of(voxel) : ScanTiles::place_of(voxel, tiles_.unit_edge()).tile;
}

}  // namespace tessera
