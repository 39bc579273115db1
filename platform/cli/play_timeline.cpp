// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/play_timeline.hpp"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// Typical recorded microseconds between a scan and that of the next number; 0: not known.
double usual_step_us(const RecordedScans& scans) {
  std::vector<double> steps_us;
  for (std::size_t i = 1; i < scans.num_scans(); ++i) {
    const int before = scans.scan_number(i - 1);
    const int number = scans.scan_number(i);
    const std::int64_t took_us =
        scans.motion()->stamp_us(number) - scans.motion()->stamp_us(before);
    steps_us.push_back(static_cast<double>(took_us) / static_cast<double>(number - before));
  }
  if (steps_us.empty()) return 0.0;
  const auto middle = steps_us.begin() + static_cast<std::ptrdiff_t>(steps_us.size() / 2);
  std::nth_element(steps_us.begin(), middle, steps_us.end());
  return *middle;
}

}  // namespace

std::int64_t PlayTimeline::played(std::int64_t recorded_us) const noexcept {
  return std::llround(stretch_ * static_cast<double>(recorded_us));
}

Outcome<void> PlayTimeline::reserve(std::size_t poses) {
  const std::size_t capacity = std::max<std::size_t>(poses, 1);
  memory_ = ArenaMemory(PoseTrack::required_bytes(capacity));
  Arena arena(memory_.span());
  const Result<PoseTrack> track = PoseTrack::make(capacity, arena);
  if (!track.ok()) return Failure{"no memory for the poses", FailureKind::kFailure};
  track_ = *track;
  return {};
}

void PlayTimeline::add_recorded(const ScanMotion& motion, std::int64_t first_us) {
  const PoseTrack& recorded = motion.track();
  const std::int64_t last_us = scans_us_.back() + played(kAround_us);
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    const StampedPose pose{played(recorded[i].stamp_us - first_us), recorded[i].T_map_body};
    if (pose.stamp_us < -played(kAround_us) || pose.stamp_us > last_us) continue;
    // Two may coincide when they are played fast.
    static_cast<void>(track_.add(pose));
  }
}

void PlayTimeline::add_of_scans(const RecordedScans& scans) {
  // A pose that is not rigid is left out.
  for (std::size_t i = 0; i < scans.num_scans(); ++i)
    static_cast<void>(track_.add({scans_us_[i], scans.T_map_sensor(i)}));
}

Outcome<PlayTimeline> PlayTimeline::make(const RecordedScans& scans, double rate_hz) {
  PlayTimeline timeline;
  const ScanMotion* const motion = scans.motion();
  const double step_us = motion != nullptr ? usual_step_us(scans) : 0.0;
  const double recorded_us = step_us > 0.0 ? step_us : static_cast<double>(kUsualPeriod_us);
  timeline.stretch_ = 1e6 / rate_hz / recorded_us;
  TESSERA_TRY(timeline.reserve(motion != nullptr ? motion->track().size() : scans.num_scans()));
  const std::int64_t first_us =
      motion != nullptr ? motion->stamp_us(scans.scan_number(0)) : std::int64_t{0};
  for (std::size_t i = 0; i < scans.num_scans(); ++i) {
    const std::int64_t after_us = motion != nullptr
                                      ? motion->stamp_us(scans.scan_number(i)) - first_us
                                      : static_cast<std::int64_t>(i) * kUsualPeriod_us;
    timeline.scans_us_.push_back(timeline.played(after_us));
  }
  if (motion != nullptr) {
    timeline.add_recorded(*motion, first_us);
  } else {
    timeline.add_of_scans(scans);
  }
  return timeline;
}

Outcome<PlayTimeline> PlayTimeline::back() const {
  PlayTimeline timeline;
  timeline.stretch_ = -stretch_;
  TESSERA_TRY(timeline.reserve(track_.size()));
  const std::int64_t end_us = scans_us_.back();
  timeline.scans_us_.reserve(scans_us_.size());
  for (auto stamp = scans_us_.rbegin(); stamp != scans_us_.rend(); ++stamp)
    timeline.scans_us_.push_back(end_us - *stamp);
  for (std::size_t i = track_.size(); i > 0; --i) {
    const StampedPose& pose = track_[i - 1];
    static_cast<void>(timeline.track_.add({end_us - pose.stamp_us, pose.T_map_body}));
  }
  return timeline;
}

}  // namespace tessera
