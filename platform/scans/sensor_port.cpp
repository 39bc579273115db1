// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/sensor_port.hpp"

#include <time.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/monotonic_clock.hpp"
#include "link/short_message.hpp"

namespace tessera {
namespace {

Outcome<void> check_channels(const SensorChannels& channels) {
  const std::array<const std::string*, 6> names{&channels.semantic_cloud, &channels.cloud,
                                                &channels.label_image,    &channels.depth_image,
                                                &channels.pose,           &channels.correction};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i]->size() > kMaxChannelBytes) {
      return Failure{"invalid LCM channel \"" + one_line(*names[i]) +
                     "\"; choose up to 63 letters, digits and signs"};
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (!names[i]->empty() && *names[i] == *names[j]) {
        return Failure{"duplicate LCM channel \"" + one_line(*names[i]) +
                       "\"; give each kind of message its own channel"};
      }
    }
  }
  return {};
}

}  // namespace

SensorPort::SensorPort(const SensorPortConfig& config, std::unique_ptr<SensorLink> link)
    : config_(config),
      link_(std::move(link)),
      matcher_(config.matcher),
      ready_(std::clamp<std::size_t>(config.matcher.handed_scans, 1, 16)),
      back_(std::clamp<std::size_t>(config.matcher.handed_scans, 1, 16)),
      poses_(kPoseQueue),
      corrections_(config.takes_corrections ? kCorrectionQueue : 1) {}

Outcome<std::unique_ptr<SensorPort>> SensorPort::open(const SensorPortConfig& config) {
  TESSERA_TRY(check_channels(config.channels));
  TESSERA_TRY_ASSIGN(std::unique_ptr<SensorLink> link, SensorLink::open(config.link));
  return std::unique_ptr<SensorPort>(new SensorPort(config, std::move(link)));
}

std::size_t SensorPort::required_bytes(const SensorPortConfig& config) noexcept {
  return sizeof(SensorPort) + SensorLink::required_bytes(config.link) +
         SensorMatcher::required_bytes(config.matcher) + kPoseQueue * sizeof(StampedPose) +
         std::size_t{2} * 16 * sizeof(Scan*) +
         (config.takes_corrections ? kCorrectionQueue : 1) * CorrectionMessage::kMostPoses * 13 * 8;
}

SensorPort::~SensorPort() {
  stop_.store(true, std::memory_order_relaxed);
  link_->wake();
  thread_.join();
}

Outcome<void> SensorPort::start() {
  return thread_.start(
      {.name = "tessera-sense"}, [](void* port) { static_cast<SensorPort*>(port)->run(); }, this);
}

void SensorPort::run() noexcept {
  // The interval of checks while no message comes.
  constexpr std::int64_t kTimeout_us = 5'000;
  while (!stop_.load(std::memory_order_relaxed)) step(kTimeout_us);
}

std::int64_t SensorPort::stamp_now_us() const noexcept {
  if (config_.clock == SensorClock::kMonotonic) return MonotonicClock::now_us();
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000 + std::int64_t{now.tv_nsec} / 1'000;
}

SensorTime SensorPort::time() const noexcept {
  const std::int64_t now_us = MonotonicClock::now_us();
  return {now_us, config_.clock == SensorClock::kMonotonic ? now_us : stamp_now_us()};
}

void SensorPort::step(std::int64_t timeout_us) noexcept {
  link_->receive(timeout_us, *this);
  for (const StampedPose* pose = poses_.front(); pose != nullptr; pose = poses_.front()) {
    matcher_.add_pose(*pose, time());
    poses_.pop();
  }
  hand_over();
  report_.link = link_->report();
  report_.match = matcher_.report();
  report_.poses_queue_full = poses_queue_full_.load(std::memory_order_relaxed);
  shared_report_.store(report_);
}

void SensorPort::hand_over() noexcept {
  for (Scan* const* slot = back_.front(); slot != nullptr; slot = back_.front()) {
    matcher_.give_back(*slot);
    back_.pop();
  }
  const SensorTime now = time();
  for (Scan* scan = matcher_.take_ready(now); scan != nullptr; scan = matcher_.take_ready(now)) {
    // The queues have room for everything that the matcher gives out.
    *ready_.claim() = scan;
    ready_.publish();
    const auto waited_us = static_cast<std::uint64_t>(now.now_us - scan->taken_us);
    report_.longest_match_us = std::max(report_.longest_match_us, waited_us);
  }
}

Scan* SensorPort::front() noexcept {
  Scan* const* const slot = ready_.front();
  return slot == nullptr ? nullptr : *slot;
}

void SensorPort::pop() noexcept {
  *back_.claim() = *ready_.front();
  ready_.pop();
  back_.publish();
}

bool SensorPort::add_pose(const StampedPose& pose) noexcept {
  StampedPose* const slot = poses_.claim();
  if (slot == nullptr) {
    poses_queue_full_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  *slot = pose;
  poses_.publish();
  link_->wake();
  return true;
}

void SensorPort::forget_poses() noexcept {
  while (poses_.front() != nullptr) poses_.pop();
  matcher_.forget_poses();
}

bool SensorPort::is_fine(MessageFault fault) noexcept {
  if (fault == MessageFault::kNone) return true;
  ++report_.faults[static_cast<std::size_t>(fault)];
  return false;
}

void SensorPort::take(std::string_view channel, std::span<const std::byte> payload) noexcept {
  const SensorChannels& channels = config_.channels;
  if (channel == channels.pose) return take_pose(payload);
  if (channel == channels.semantic_cloud) return take_cloud(payload, true);
  if (channel == channels.cloud) return take_cloud(payload, false);
  if (channel == channels.label_image) return take_label_image(payload);
  if (channel == channels.depth_image) return take_depth_image(payload);
  if (channel == channels.correction && config_.takes_corrections) return take_correction(payload);
  ++report_.other_channel;
}

void SensorPort::take_cloud(std::span<const std::byte> payload, bool semantic) noexcept {
  Scan& slot = matcher_.next_scan();
  const CloudMemory memory{slot.points(),  slot.components(), slot.weights(),
                           slot.times_s(), slot.no_return(),  slot.label_weights()};
  CloudHeader header;
  const MessageFault fault = semantic ? decode_semantic_cloud(payload, memory, header)
                                      : decode_cloud(payload, memory, header);
  if (!is_fine(fault)) return;
  slot.kind = ScanKind::kCloud;
  slot.sensor = header.sensor;
  slot.stamp_us = header.stamp_us;
  slot.count = header.count;
  slot.width_px = slot.height_px = 0;
  slot.has_components = header.has_components;
  slot.labels_per_point = header.labels_per_point;
  slot.has_label_weights = header.has_label_weights;
  slot.has_weights = header.has_weights;
  slot.has_times = header.has_times;
  slot.has_no_return = header.has_no_return;
  slot.first_us = header.first_us;
  slot.last_us = header.last_us;
  matcher_.add_scan(time());
}

void SensorPort::take_label_image(std::span<const std::byte> payload) noexcept {
  ScanImage& image = matcher_.next_image();
  ImageHeader header;
  if (!is_fine(decode_label_image(payload, image.memory, header))) return;
  image.camera = header.camera;
  image.stamp_us = header.stamp_us;
  image.width_px = header.width_px;
  image.height_px = header.height_px;
  matcher_.add_image(time());
}

void SensorPort::take_depth_image(std::span<const std::byte> payload) noexcept {
  Scan& slot = matcher_.next_scan();
  ImageHeader header;
  if (!is_fine(decode_depth_image(payload, slot.points(), header))) return;
  slot.kind = ScanKind::kDepthImage;
  slot.sensor = header.camera;
  slot.stamp_us = header.stamp_us;
  slot.count = 0;
  slot.width_px = header.width_px;
  slot.height_px = header.height_px;
  slot.has_components = slot.has_weights = slot.has_times = slot.has_no_return = false;
  slot.labels_per_point = 1;
  slot.has_label_weights = false;
  slot.first_us = slot.last_us = 0;
  matcher_.add_scan(time());
}

void SensorPort::take_pose(std::span<const std::byte> payload) noexcept {
  PoseMessage pose;
  if (!is_fine(decode_pose(payload, pose))) return;
  const auto step = static_cast<std::int32_t>(static_cast<std::uint32_t>(pose.sequence) -
                                              static_cast<std::uint32_t>(last_pose_number_));
  constexpr std::int32_t kMostLost = 1000;  // A larger gap is a restart.
  if (knows_pose_number_ && step > 1 && step <= kMostLost)
    report_.pose_gaps += static_cast<std::uint64_t>(step - 1);
  last_pose_number_ = pose.sequence;
  knows_pose_number_ = true;
  const bool is_wanted = pose.quality == PoseQuality::kGood ||
                         (pose.quality == PoseQuality::kDegraded && config_.takes_degraded_poses);
  if (!is_wanted) {
    ++report_.poses_invalid;
    return;
  }
  const SensorTime now = time();
  const PoseFilter& filter = config_.pose_filter;
  if (filter.may_use != nullptr && !filter.may_use(filter.context, pose, now.stamp_now_us)) {
    ++report_.poses_filtered;
    return;
  }
  matcher_.add_pose({pose.stamp_us, pose.T_map_body}, now);
}

void SensorPort::take_correction(std::span<const std::byte> payload) noexcept {
  CorrectionMessage* const slot = corrections_.claim();
  if (slot == nullptr) {
    ++report_.corrections_dropped;
    return;
  }
  if (!is_fine(decode_correction(payload, {slot->keys, slot->transforms}, slot->header))) return;
  if (slot->header.robot != config_.robot) {
    ++report_.corrections_foreign;
    return;
  }
  ++report_.corrections;
  corrections_.publish();
}

}  // namespace tessera
