// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The work and the time that a scan may take. Time is spent as work: what a deadline has room for
// is a limit of work, and what scans took lately says how much is kept for the labels of a point.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tessera/inference/deadline.hpp"
#include "tessera/inference/scan_report.hpp"

namespace tessera {

class ScanWork {
 public:
  /// Steps that opening and carving a block of rays takes as long as, about.
  static constexpr std::uint64_t kBlockWork = 128;
  /// By the image, evaluations that take as long as one step, as bringing one return into the
  /// image, and as opening and writing a block.
  static constexpr std::uint64_t kImageStepWork = 2;
  static constexpr std::uint64_t kImageReturnWork = 5;
  static constexpr std::uint64_t kImageBlockWork = 64;
  /// Calls of is_spent() from one reading of the clock to the next.
  static constexpr std::size_t kPointBatch = 64;

  /// Begins a scan; deadline: null without one, else it has begun. No reading.
  void begin(Deadline* deadline, bool by_image = false) noexcept {
    deadline_ = deadline;
    cut_ = false;
    by_image_ = by_image;
  }
  /// Sets the bound on the evaluations for a point of this scan.
  void set_most_per_point(std::uint64_t evaluations) noexcept { most_per_point_ = evaluations; }
  /// The limit from here on: the work budget (0: none), or what fits the deadline if that is less.
  /// One reading.
  void set_limit(std::uint64_t work_budget, ScanReport& report) noexcept;

  [[nodiscard]] bool has_deadline() const noexcept { return deadline_ != nullptr; }
  /// True: the time of the scan is up.
  [[nodiscard]] bool cut() const noexcept { return cut_; }
  /// Without a deadline, true. Else reads the clock, unless the time was up already: whether so
  /// much work still fits.
  [[nodiscard]] bool in_time(std::uint64_t work = 0) noexcept;
  [[nodiscard]] bool has_limit() const noexcept { return limit_ != kNoLimit; }
  [[nodiscard]] std::uint64_t limit() const noexcept { return limit_; }
  [[nodiscard]] bool limit_is_deadline() const noexcept { return limit_is_deadline_; }
  /// True if so much work is over the limit, or the time is up but for what is to be written. Every
  /// kPointBatch calls read the clock once; asked counts them.
  bool is_spent(std::uint64_t work, std::uint64_t to_write, std::size_t& asked) noexcept;
  /// What time is kept for while so many blocks wait to be written, beside labels.
  [[nodiscard]] std::uint64_t to_write(std::size_t blocks) const noexcept {
    return (by_image_ ? kImageBlockWork : kBlockWork) * blocks;
  }
  /// Counts what the limit leaves out: the budget's or the deadline's.
  [[nodiscard]] std::uint32_t& refusals(ScanReport& report, bool is_point) const noexcept;

  [[nodiscard]] std::uint64_t most_per_point() const noexcept { return most_per_point_; }
  /// Evaluations for a point that time is kept for: at most most_per_point().
  [[nodiscard]] std::uint64_t foreseen_per_point() const noexcept {
    return seen_per_point_ != 0 && seen_per_point_ < most_per_point_ ? seen_per_point_
                                                                     : most_per_point_;
  }
  /// After a scan of so many admitted points: the work that was done since set_limit(), as Deadline
  /// counts it. rays_predicted: ray steps of all admitted, at most.
  [[nodiscard]] std::uint64_t done(const ScanReport& report, std::size_t admitted,
                                   std::uint64_t rays_predicted) const noexcept;
  /// 1.5 times what points took lately: what most scenes take is far from the bound.
  void learn_from(const ScanReport& report, std::size_t admitted) noexcept;

 private:
  static constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};

  Deadline* deadline_ = nullptr;
  bool cut_ = false;
  bool by_image_ = false;
  bool limit_is_deadline_ = false;
  std::uint64_t limit_ = kNoLimit;
  std::uint64_t most_per_point_ = 0;
  std::uint64_t seen_per_point_ = 0;  ///< Of the scans with a deadline; 0: nothing yet.
};

}  // namespace tessera
