// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// When recorded scans and their poses are played: at the recorded times if there are any, else
// evenly; scaled so that scans come at the given rate.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/outcome.hpp"
#include "scans/recorded_scans.hpp"

namespace tessera {

/// Microseconds since the stamp of the first scan; negative before it.
class PlayTimeline {
 public:
  /// Poses are played from this time before the first scan to this time after the last, recorded
  /// microseconds.
  static constexpr std::int64_t kAround_us = 200'000;

  /// rate_hz: of scans, by the median of the steps between them. Fails with kFailure iff there is
  /// no memory for the poses.
  static Outcome<PlayTimeline> make(const RecordedScans& scans, double rate_hz);
  /// The reverse, as if time ran backward: from the last scan, at 0, to the first. Fails as make().
  [[nodiscard]] Outcome<PlayTimeline> back() const;

  /// Time of the scan that is played as number i.
  [[nodiscard]] std::int64_t scan_us(std::size_t i) const { return scans_us_[i]; }
  /// All poses around the scans; for scans without times, that of each scan.
  [[nodiscard]] const PoseTrack& track() const noexcept { return track_; }
  /// Between poses that are interpolated.
  [[nodiscard]] std::int64_t max_gap_us() const noexcept {
    return std::abs(played(kMaxPoseGap_us));
  }
  /// Converts recorded microseconds to those of playing; of the reverse, before instead of after.
  [[nodiscard]] std::int64_t played(std::int64_t recorded_us) const noexcept;
  [[nodiscard]] double stretch() const noexcept { return stretch_; }

 private:
  /// Without times scans are taken to be recorded at 10 Hz.
  static constexpr std::int64_t kUsualPeriod_us = 100'000;

  Outcome<void> reserve(std::size_t poses);
  void add_recorded(const ScanMotion& motion, std::int64_t first_us);
  void add_of_scans(const RecordedScans& scans);

  double stretch_ = 1.0;
  std::vector<std::int64_t> scans_us_;
  ArenaMemory memory_;
  PoseTrack track_;
};

}  // namespace tessera
