// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// When a dataset's scans and poses are played: the recorded times where it has them, else evenly;
// stretched so that scans come at the wanted rate.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "dataset/dataset.hpp"
#include "posix/outcome.hpp"

namespace tessera {

/// Microseconds from the stamp of the first scan on; before it, negative.
class PlayTimeline {
 public:
  /// Poses that are played before the first scan and after the last, recorded microseconds.
  static constexpr std::int64_t kAround_us = 200'000;

  /// rate_hz: of scans, as the median of the steps between them. Fails with kFailure iff there is
  /// no memory for the poses.
  static Outcome<PlayTimeline> make(const Dataset& dataset, double rate_hz);
  /// The same way back, as if time ran the other way: from the last scan, at 0, to the first. Fails
  /// as make().
  [[nodiscard]] Outcome<PlayTimeline> back() const;

  /// Of the scan that is played as number i.
  [[nodiscard]] std::int64_t scan_us(std::size_t i) const { return scans_us_[i]; }
  /// All poses around the scans; of a dataset without times, that of each scan.
  [[nodiscard]] const PoseTrack& track() const noexcept { return track_; }
  /// Between poses that are interpolated.
  [[nodiscard]] std::int64_t max_gap_us() const noexcept { return std::abs(played(kMostGap_us)); }
  /// What recorded microseconds are when they are played; of the way back, before instead of after.
  [[nodiscard]] std::int64_t played(std::int64_t recorded_us) const noexcept;
  [[nodiscard]] double stretch() const noexcept { return stretch_; }

 private:
  static constexpr std::int64_t kMostGap_us = ScanMotion::kMaxGap_us;
  /// Without times scans are taken to be recorded at 10 Hz.
  static constexpr std::int64_t kUsualPeriod_us = 100'000;

  struct alignas(kArenaAlignment) Line {
    std::byte bytes[kArenaAlignment];
  };
  Outcome<void> reserve(std::size_t poses);
  void add_recorded(const ScanMotion& motion, std::int64_t first_us);
  void add_of_scans(const Dataset& dataset);

  double stretch_ = 1.0;
  std::vector<std::int64_t> scans_us_;
  std::vector<Line> memory_;
  PoseTrack track_;
};

}  // namespace tessera
