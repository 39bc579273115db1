// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/sensor_matcher.hpp"

#include <algorithm>
#include <utility>

#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

MatcherConfig within_ranges(MatcherConfig config) {
  const auto cut = [](auto& list, std::size_t most) {
    if (list.size() > most) list.resize(most);
  };
  cut(config.sensors, 16);
  cut(config.cameras, Scan::kMostCameras);
  config.pending_scans = std::clamp<std::size_t>(config.pending_scans, 1, 16);
  config.handed_scans = std::clamp<std::size_t>(config.handed_scans, 1, 16);
  config.images = std::clamp<std::size_t>(config.images, 2, 16);
  config.poses = std::clamp<std::size_t>(config.poses, 2, 65'536);
  const bool has_depth =
      std::any_of(config.sensors.begin(), config.sensors.end(),
                  [](const MountedSensor& s) { return s.kind == MountedKind::kDepthCamera; });
  config.slot.cameras = std::max<std::size_t>(config.cameras.size(), has_depth ? 1 : 0);
  return config;
}

/// Every camera whose label images are kept.
std::vector<std::int32_t> camera_numbers(const MatcherConfig& config) {
  std::vector<std::int32_t> numbers = config.cameras;
  for (const MountedSensor& sensor : config.sensors) {
    const bool known = std::find(numbers.begin(), numbers.end(), sensor.number) != numbers.end();
    if (sensor.kind == MountedKind::kDepthCamera && !known) numbers.push_back(sensor.number);
  }
  return numbers;
}

std::size_t num_slots(const MatcherConfig& config) {
  return config.pending_scans + config.handed_scans + 1;
}

/// |a - b|, whatever the two are.
std::uint64_t distance(std::int64_t a, std::int64_t b) noexcept {
  const auto low = static_cast<std::uint64_t>(std::min(a, b));
  return static_cast<std::uint64_t>(std::max(a, b)) - low;
}

}  // namespace

std::size_t SensorMatcher::required_bytes(const MatcherConfig& given) noexcept {
  const MatcherConfig config = within_ranges(given);
  const std::size_t images = camera_numbers(config).size() * config.images + 1;
  return num_slots(config) * (sizeof(Scan) + Scan::required_bytes(config.slot)) +
         images * (sizeof(ScanImage) + config.slot.image_pixels) +
         PoseTrack::required_bytes(config.poses);
}

SensorMatcher::SensorMatcher(const MatcherConfig& config)
    : config_(within_ranges(config)), slots_(std::make_unique<Scan[]>(num_slots(config_))) {
  free_.resize(num_slots(config_));
  for (std::size_t i = 0; i < num_slots(config_); ++i) {
    slots_[i] = Scan(config_.slot);
    if (i > 0) free_[num_free_++] = i;
  }
  pending_.resize(config_.pending_scans + 1);
  for (const MountedSensor& sensor : config_.sensors) mounted_.push_back({.sensor = sensor});
  const std::vector<std::int32_t> numbers = camera_numbers(config_);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    cameras_.push_back({.number = numbers[i],
                        .of_clouds = i < config_.cameras.size(),
                        .first = i * config_.images});
  }
  choices_.resize(cameras_.size());
  spare_image_ = cameras_.size() * config_.images;
  images_.resize(spare_image_ + 1);
  image_bytes_ = std::make_unique<std::uint8_t[]>(images_.size() * config_.slot.image_pixels);
  for (std::size_t i = 0; i < images_.size(); ++i) {
    images_[i].memory = {image_bytes_.get() + i * config_.slot.image_pixels,
                         config_.slot.image_pixels};
  }
  track_memory_ = ArenaMemory(PoseTrack::required_bytes(config_.poses));
  Arena arena(track_memory_.span());
  Result<PoseTrack> track = PoseTrack::make(config_.poses, arena);
  if (track.ok()) track_ = *track;
}

SensorMatcher::Mounted* SensorMatcher::mounted(const Scan& scan) noexcept {
  for (Mounted& one : mounted_) {
    const bool is_depth = one.sensor.kind == MountedKind::kDepthCamera;
    const bool is_semantic = one.sensor.kind == MountedKind::kSemanticCloud;
    if (one.sensor.number == scan.sensor && is_depth == (scan.kind == ScanKind::kDepthImage) &&
        is_semantic == scan.has_components)
      return &one;
  }
  return nullptr;
}

bool SensorMatcher::is_timely(std::int64_t stamp_us, const SensorTime& time,
                              TimelinessCounts& counts) const noexcept {
  const std::uint64_t off_us = distance(stamp_us, time.stamp_now_us);
  const bool is_ahead = stamp_us > time.stamp_now_us;
  const std::int64_t most_us = is_ahead ? config_.max_future_us : config_.max_age_us;
  if (off_us <= static_cast<std::uint64_t>(std::max<std::int64_t>(most_us, 0))) return true;
  ++(is_ahead ? counts.future : counts.ancient);
  return false;
}

void SensorMatcher::forget_all() noexcept {
  report_.dropped_by_step += num_pending_;
  while (num_pending_ > 0) drop_pending(num_pending_ - 1);
  track_.clear();
  for (Camera& camera : cameras_) camera.count = 0;
  for (Mounted& one : mounted_) one.last_us = INT64_MIN;
}

void SensorMatcher::watch_clock(const SensorTime& time) noexcept {
  const std::int64_t offset_us = time.stamp_now_us - time.now_us;
  const bool stepped = knows_clock_ && distance(offset_us, clock_offset_us_) >
                                           static_cast<std::uint64_t>(
                                               std::max<std::int64_t>(config_.max_step_us, 0));
  // Follows changes slower than a step: a clock that is being adjusted.
  clock_offset_us_ = offset_us;
  knows_clock_ = true;
  if (!stepped) return;
  ++report_.clock_steps;
  forget_all();
}

void SensorMatcher::drop_pending(std::size_t at) noexcept {
  free_[num_free_++] = pending_[at];
  std::copy(pending_.begin() + static_cast<std::ptrdiff_t>(at) + 1,
            pending_.begin() + static_cast<std::ptrdiff_t>(num_pending_),
            pending_.begin() + static_cast<std::ptrdiff_t>(at));
  --num_pending_;
}

bool SensorMatcher::is_known(const Scan& scan, const Mounted& from) noexcept {
  if (scan.stamp_us == from.last_us) return true;
  for (std::size_t i = 0; i < num_pending_; ++i) {
    const Scan& other = slots_[pending_[i]];
    if (other.stamp_us == scan.stamp_us && other.sensor == scan.sensor && other.kind == scan.kind)
      return true;
  }
  return false;
}

void SensorMatcher::add_scan(const SensorTime& time) noexcept {
  watch_clock(time);
  Scan& scan = next_scan();
  const Mounted* const from = mounted(scan);
  if (from == nullptr) {
    ++report_.unknown_sensor;
    return;
  }
  if (!is_timely(scan.stamp_us, time, report_.scans)) return;
  if (is_known(scan, *from)) {
    ++report_.duplicates;
    return;
  }
  if (scan.stamp_us < from->last_us) {
    ++report_.out_of_order;
    return;
  }
  scan.taken_us = time.now_us;
  scan.T_body_sensor = from->sensor.T_body_sensor;
  std::size_t at = num_pending_++;
  for (; at > 0 && slots_[pending_[at - 1]].stamp_us > scan.stamp_us; --at)
    pending_[at] = pending_[at - 1];
  pending_[at] = spare_;
  if (num_pending_ > config_.pending_scans) {
    ++report_.superseded;
    drop_pending(0);
  }
  // There is a free one: slots are as many as can wait, be given out, and this one.
  spare_ = free_[--num_free_];
}

void SensorMatcher::add_image(const SensorTime& time) noexcept {
  watch_clock(time);
  const ScanImage& image = next_image();
  const auto camera = std::find_if(cameras_.begin(), cameras_.end(),
                                   [&](const Camera& one) { return one.number == image.camera; });
  if (camera == cameras_.end()) {
    ++report_.unknown_camera;
    return;
  }
  if (!is_timely(image.stamp_us, time, report_.image_stamps)) return;
  const auto first = images_.begin() + static_cast<std::ptrdiff_t>(camera->first);
  if (camera->count > 0 && image.stamp_us <= images_[camera->first + camera->count - 1].stamp_us) {
    ++report_.images_out_of_order;
    return;
  }
  ++report_.images;
  if (camera->count == config_.images) {
    std::rotate(first, first + 1, first + static_cast<std::ptrdiff_t>(config_.images));
    --camera->count;
  }
  std::swap(images_[camera->first + camera->count], images_[spare_image_]);
  ++camera->count;
}

void SensorMatcher::add_pose(const StampedPose& pose, const SensorTime& time) noexcept {
  watch_clock(time);
  if (!is_timely(pose.stamp_us, time, report_.pose_stamps)) return;
  switch (track_.add(pose)) {
    case Status::kOk:
      ++report_.poses;
      return;
    case Status::kMismatch:
      ++report_.poses_out_of_order;
      return;
    default:
      ++report_.poses_not_rigid;
      return;
  }
}

Scan* SensorMatcher::take_ready(const SensorTime& time) noexcept {
  watch_clock(time);
  while (num_pending_ > 0) {
    Scan& scan = slots_[pending_[0]];
    const Partners partners = look_for_partners(scan, has_waited(scan, time));
    if (partners == Partners::kWaits) return nullptr;
    if (partners == Partners::kNever) {
      drop_pending(0);
      continue;
    }
    if (handed_ >= config_.handed_scans) {
      // Keeps the newest that is ready; older ones are lost.
      if (num_pending_ == 1) return nullptr;
      const Scan& next = slots_[pending_[1]];
      const Partners of_next = look_for_partners(next, has_waited(next, time));
      if (of_next == Partners::kWaits) return nullptr;
      if (of_next == Partners::kReady) ++report_.superseded;
      drop_pending(of_next == Partners::kReady ? 0 : 1);
      continue;
    }
    attach(scan);
    mounted(scan)->last_us = scan.stamp_us;
    drop_pending(0);
    --num_free_;  // Not free: it is given to the caller.
    ++handed_;
    ++report_.given;
    return &scan;
  }
  return nullptr;
}

void SensorMatcher::give_back(const Scan* slot) noexcept {
  free_[num_free_++] = static_cast<std::size_t>(slot - slots_.get());
  --handed_;
}

}  // namespace tessera
