// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/scan_work.hpp"

namespace tessera {

void ScanWork::set_limit(std::uint64_t work_budget, ScanReport& report) noexcept {
  limit_ = work_budget == 0 ? kNoLimit : work_budget;
  limit_is_deadline_ = false;
  if (deadline_ != nullptr) {
    const std::uint64_t fits = deadline_->begin_work();
    cut_ = deadline_->past();
    limit_is_deadline_ = fits < limit_;
    if (limit_is_deadline_) limit_ = fits;
  }
  report.work_limit = has_limit() ? limit_ : 0;
}

bool ScanWork::in_time(std::uint64_t work) noexcept {
  if (deadline_ == nullptr || cut_) return !cut_;
  const bool fits = deadline_->allows(work);
  cut_ = deadline_->past();
  return fits;
}

bool ScanWork::is_spent(std::uint64_t work, std::uint64_t to_write, std::size_t& asked) noexcept {
  if (work > limit_) return true;
  if (asked++ % kPointBatch != 0 || in_time(to_write)) return false;
  limit_is_deadline_ = true;
  return true;
}

std::uint32_t& ScanWork::refusals(ScanReport& report, bool is_point) const noexcept {
  if (limit_is_deadline_) return is_point ? report.refused_deadline : report.rays_refused_deadline;
  return is_point ? report.refused_work : report.rays_refused_work;
}

/// As it was foreseen, so that the rate is of what is foreseen; but what was cut counts as it was
/// done.
std::uint64_t ScanWork::done(const ScanReport& report, std::size_t admitted,
                             std::uint64_t rays_predicted) const noexcept {
  const std::uint64_t slower =
      by_image_ ? (kImageStepWork - 1) * report.ray_steps + kImageReturnWork * report.rays : 0;
  if (cut_ || report.tiles_cut + report.ray_blocks_cut > 0)
    return report.work_spent() + slower + to_write(report.free_blocks);
  if (report.work_predicted == 0) return 0;
  const std::uint64_t never = most_per_point_ - foreseen_per_point();
  const std::uint64_t done =
      report.work_predicted - admitted * never + slower + to_write(report.ray_blocks);
  if (report.rays_cut == 0) return done;
  const double cut = static_cast<double>(report.rays_cut) /
                     static_cast<double>(std::uint64_t{report.rays} + report.rays_cut);
  return done - static_cast<std::uint64_t>(cut * static_cast<double>(rays_predicted));
}

void ScanWork::learn_from(const ScanReport& report, std::size_t admitted) noexcept {
  if (report.tiles_cut > 0) {
    seen_per_point_ = 2 * foreseen_per_point();
  } else if (!cut_ && admitted > 0) {
    const std::uint64_t seen = (report.evaluations * 3 / 2 + admitted) / admitted;
    const std::uint64_t before = seen_per_point_ - seen_per_point_ / 8;
    seen_per_point_ = seen > before ? seen : before;
  }
}

}  // namespace tessera
