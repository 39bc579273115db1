// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Finds the images and poses that belong to a scan.
#include <algorithm>

#include "scans/sensor_matcher.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

struct Span_us {
  std::int64_t first = 0;
  std::int64_t last = 0;
  void include(std::int64_t stamp_us) noexcept {
    first = std::min(first, stamp_us);
    last = std::max(last, stamp_us);
  }
};

Span_us sweep_of(const Scan& scan) noexcept {
  Span_us sweep{scan.stamp_us, scan.stamp_us};
  sweep.include(scan.stamp_us + scan.first_us);
  sweep.include(scan.stamp_us + scan.last_us);
  return sweep;
}

}  // namespace

bool SensorMatcher::needs(const Scan& scan, const Camera& camera) const noexcept {
  if (scan.kind == ScanKind::kDepthImage) return camera.number == scan.sensor;
  return !scan.has_components && camera.of_clouds;
}

SensorMatcher::Choice SensorMatcher::choose(const Camera& camera, const Scan& scan) const noexcept {
  const std::span images = std::span(images_).subspan(camera.first, camera.count);
  const bool exact = scan.kind == ScanKind::kDepthImage;
  const std::int64_t most_us = exact ? 0 : std::max<std::int64_t>(config_.max_image_offset_us, 0);
  Choice choice;
  // Stamps passed is_timely, so their differences fit.
  std::int64_t least_us = INT64_MAX;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::int64_t off_us = images[i].stamp_us - scan.stamp_us;
    const std::int64_t away_us = off_us < 0 ? -off_us : off_us;
    choice.settled = choice.settled || off_us >= 0;
    if (away_us > most_us || away_us >= least_us) continue;
    least_us = away_us;
    choice.image = camera.first + i;
  }
  if (choice.settled || choice.image == kNone || images.size() < 2) return choice;
  // All are before the stamp. The next is nearer unless it overshoots by as much.
  const std::int64_t period_us =
      images[images.size() - 1].stamp_us - images[images.size() - 2].stamp_us;
  choice.settled = period_us >= 2 * least_us;
  return choice;
}

SensorMatcher::Partners SensorMatcher::look_for_partners(const Scan& scan, bool waited) noexcept {
  Span_us span = sweep_of(scan);
  bool missing = false;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    choices_[i] = {};
    if (!needs(scan, cameras_[i])) continue;
    choices_[i] = choose(cameras_[i], scan);
    if (!choices_[i].settled && !waited) return Partners::kWaits;
    if (choices_[i].image == kNone) {
      missing = true;
    } else {
      span.include(images_[choices_[i].image].stamp_us);
    }
  }
  const bool passed = track_.size() > 0 && track_.latest_us() >= span.last;
  if (!passed && !waited) return Partners::kWaits;
  if (!track_.at(scan.stamp_us, config_.max_pose_gap_us).ok()) {
    ++report_.without_pose;
    return Partners::kNever;
  }
  if (missing && config_.missing_images == MissingImages::kDrop) {
    ++report_.without_images;
    return Partners::kNever;
  }
  return Partners::kReady;
}

void SensorMatcher::attach_poses(Scan& scan, std::int64_t first_us,
                                 std::int64_t last_us) const noexcept {
  const std::size_t size = track_.size();
  std::size_t begin = 0;
  while (begin + 1 < size && track_[begin + 1].stamp_us <= first_us) ++begin;
  std::size_t end = begin;
  while (end < size && (end == begin || track_[end - 1].stamp_us < last_us)) ++end;
  const std::size_t there = end - begin;
  scan.num_poses = std::min(there, Scan::kMostPoses);
  for (std::size_t i = 0; i < scan.num_poses; ++i) {
    // The first and the last are always among them.
    const std::size_t from =
        there <= Scan::kMostPoses ? i : i * (there - 1) / (Scan::kMostPoses - 1);
    scan.pose_memory[i] = track_[begin + from];
  }
}

void SensorMatcher::attach(Scan& scan) noexcept {
  Span_us span = sweep_of(scan);
  scan.num_images = 0;
  std::size_t needed = 0;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (!needs(scan, cameras_[i])) continue;
    ++needed;
    if (choices_[i].image == kNone) continue;
    const ScanImage& from = images_[choices_[i].image];
    ScanImage& to = scan.image_memory[scan.num_images++];
    to.camera = from.camera;
    to.width_px = from.width_px;
    to.height_px = from.height_px;
    to.stamp_us = from.stamp_us;
    std::copy(from.components().begin(), from.components().end(), to.memory.begin());
    span.include(from.stamp_us);
  }
  scan.images_missing = scan.num_images < needed;
  if (scan.images_missing)
    ++(scan.num_images == 0 ? report_.unlabelled : report_.partly_unlabelled);
  if (track_.oldest_us() > span.first || track_.latest_us() < span.last)
    ++report_.sweep_beyond_poses;
  attach_poses(scan, span.first, span.last);
  scan.T_map_body = *track_.at(scan.stamp_us, config_.max_pose_gap_us);
  scan.T_map_sensor = product(scan.T_map_body, scan.T_body_sensor);
}

}  // namespace tessera
