// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Integrating until a given time: the limit that time sets, and what is left out where it comes.
#include "tessera/inference/integrator.hpp"
#include "tessera/inference/internal/admission_order.hpp"

namespace tessera {

ScanReport Integrator::integrate(LocalMap& map, const ScanView& scan, Deadline& deadline,
                                 std::int64_t due_us) noexcept {
  deadline.begin(due_us);
  deadline_ = &deadline;
  ScanReport report = integrate_scan(map, scan);
  deadline_ = nullptr;
  deadline.end(work_done(report));
  learn_from(report);
  report.overshoot_us = deadline.overshoot_us();
  return report;
}

/// As it was foreseen, so that the rate is of what is foreseen; but what was cut counts as it was
/// done.
std::uint64_t Integrator::work_done(const ScanReport& report) const noexcept {
  if (cut_ || report.tiles_cut + report.ray_blocks_cut > 0) return report.work_spent();
  if (report.work_predicted == 0) return 0;
  const std::uint64_t never = evaluations_per_point() - foreseen_per_point();
  const std::uint64_t done =
      report.work_predicted - admitted_count_ * never + kBlockWork * report.ray_blocks;
  if (report.rays_cut == 0) return done;
  const double cut = static_cast<double>(report.rays_cut) /
                     static_cast<double>(std::uint64_t{report.rays} + report.rays_cut);
  return done - static_cast<std::uint64_t>(cut * static_cast<double>(rays_predicted_));
}

/// 1.5 times what points took lately: what most scenes take is far from the bound.
void Integrator::learn_from(const ScanReport& report) noexcept {
  if (report.tiles_cut > 0) {
    seen_per_point_ = 2 * foreseen_per_point();
  } else if (!cut_ && admitted_count_ > 0) {
    const std::uint64_t seen = (report.evaluations * 3 / 2 + admitted_count_) / admitted_count_;
    const std::uint64_t before = seen_per_point_ - seen_per_point_ / 8;
    seen_per_point_ = seen > before ? seen : before;
  }
}

std::uint64_t Integrator::foreseen_per_point() const noexcept {
  const std::uint64_t most = evaluations_per_point();
  return seen_per_point_ != 0 && seen_per_point_ < most ? seen_per_point_ : most;
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

/// Rays are traced while there is time, and no longer, so only labels must be foreseen; where they
/// take all of the time that there is, a quarter of it is kept for rays.
void Integrator::shed_points(ScanReport& report) noexcept {
  const std::uint64_t labels = admitted_count_ * foreseen_per_point();
  const std::uint64_t most = config_.free_space.enabled ? work_limit_ / 4 * 3 : work_limit_;
  if (!limit_is_deadline_ || labels <= most) return;
  const AdmissionScene scene{.points = admitted(),
                             .rays = {},
                             .origin_map = origin_map_,
                             .origin_voxel = origin_voxel_,
                             .unit_edge = unit_edge(),
                             .spread = true};
  std::uint64_t left = most / foreseen_per_point();
  for (const KeyedIndex& item : order_of_admission(scene, sort_)) {
    if (left > 0) {
      --left;
      continue;
    }
    admitted_[item.index].component = kRefused;
    ++report.refused_deadline;
  }
  admitted_count_ = keep_admitted(admitted_.first(admitted_count_));
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

BlockCoord Integrator::sensor_place(bool blocks) const noexcept {
  return blocks ? block_of(origin_voxel_)
                : ScanTiles::place_of(origin_voxel_, tiles_.unit_edge()).tile;
}

}  // namespace tessera
