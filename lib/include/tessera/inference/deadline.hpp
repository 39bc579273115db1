// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Deadlines: a clock that the caller injects, and a policy on top of the work budget that turns
// time into counts of work. The core reads no clock but this one, and none where no deadline is
// given.
#pragma once

#include <array>
#include <cstdint>

namespace tessera {

/// Time from outside.
struct Clock {
  void* context = nullptr;
  /// Microseconds since any zero, never fewer than the last time.
  std::int64_t (*now_us)(void* context) = nullptr;
};

/// When a scan must be done, and how much work fits until then. Its decisions follow from the
/// clock's readings and the work recorded alone. One scan at a time.
class Deadline {
 public:
  /// Scans whose work and time the rate is taken from.
  static constexpr std::size_t kWindow = 8;
  /// Part of the measured rate that is counted on.
  static constexpr double kMargin = 0.75;
  /// Work a microsecond that is counted on until a scan was measured; low, so that the first scan
  /// is rather cut short than late.
  static constexpr double kFirstRate = 25.0;

  /// No clock: everything is allowed.
  Deadline() noexcept = default;
  /// first_rate: above 0; other values are taken for kFirstRate.
  explicit Deadline(const Clock& clock, double first_rate = kFirstRate) noexcept
      : clock_(clock), first_rate_(first_rate > 0.0 ? first_rate : kFirstRate) {}

  /// Begins a scan that is to be done at due_us on the clock. No reading.
  void begin(std::int64_t due_us) noexcept;
  /// The work that fits the time left: rate() times that time, 0 if there is none. Its measurement
  /// begins here. One reading.
  [[nodiscard]] std::uint64_t begin_work() noexcept;
  /// True iff the time is not up, and so much work fits what is left of it. One reading.
  [[nodiscard]] bool allows(std::uint64_t work) noexcept;
  /// True iff the last reading found the time up.
  [[nodiscard]] bool past() const noexcept { return past_; }
  /// Ends the scan and records work, in the counts that begin_work gave, as done since then. One
  /// reading.
  void end(std::uint64_t work) noexcept;

  /// Work a microsecond that is counted on: kMargin of all work by all time of the last kWindow
  /// scans with work, so a small scan, most of it fixed cost, weighs little.
  [[nodiscard]] double rate() const noexcept;
  /// Microseconds by which the last scan ended late; 0: in time.
  [[nodiscard]] std::int64_t overshoot_us() const noexcept { return overshoot_us_; }
  /// Readings of the clock since the policy was made.
  [[nodiscard]] std::uint64_t readings() const noexcept { return readings_; }

 private:
  struct Sample {
    double work = 0.0;
    double time_us = 0.0;
  };
  [[nodiscard]] std::int64_t left_us() noexcept;

  Clock clock_{};
  double first_rate_ = kFirstRate;
  std::array<Sample, kWindow> samples_{};
  std::size_t next_ = 0;
  bool measuring_ = false;
  bool past_ = false;
  std::int64_t due_us_ = 0;
  std::int64_t left_at_start_us_ = 0;
  std::int64_t overshoot_us_ = 0;
  std::uint64_t readings_ = 0;
};

}  // namespace tessera
