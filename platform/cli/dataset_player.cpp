// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/dataset_player.hpp"

#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include "base/monotonic_clock.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
/// Number of retries when the queue of the bus is full, a millisecond apart.
constexpr int kTries = 10;

std::int64_t wall_now_us() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000 + std::int64_t{now.tv_nsec} / 1'000;
}

void sleep_until(std::int64_t us) {
  const timespec until{us / 1'000'000, us % 1'000'000 * 1'000};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

/// Cameras whose images the dataset has.
Outcome<std::vector<CameraDescription>> cameras_of(const Dataset& dataset, const std::string& dir) {
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::path(dir) / "cameras.toml", error))
    return std::vector<CameraDescription>();
  const Outcome<std::unique_ptr<CameraLabels>> labels = CameraLabels::open(dir);
  if (!labels.ok()) return labels.failure();
  std::vector<int> numbers;
  for (std::size_t i = 0; i < dataset.num_scans(); ++i) numbers.push_back(dataset.scan_number(i));
  const Outcome<void> there = (*labels)->check_images(numbers);
  if (!there.ok()) return there.failure();
  return (*labels)->cameras();
}

}  // namespace

DatasetPlayer::DatasetPlayer(const PlayerConfig& config, const Dataset& dataset, PlayTimeline there,
                             PlayTimeline back, std::unique_ptr<SensorSender> sender,
                             ScanAhead::Source source)
    : config_(config),
      dataset_(dataset),
      there_(std::move(there)),
      back_(std::move(back)),
      sender_(std::move(sender)),
      cameras_(source.cameras),
      ahead_(std::move(source)),
      vehicle_({.base_id = config.can_base_id, .max_gap_us = there_.max_gap_us()}) {
  for (const CameraDescription& camera : cameras_)
    earliest_us_ = std::min({earliest_us_, there_.played(camera.offset_us),
                             config_.loop ? back_.played(camera.offset_us) : std::int64_t{0}});
  for (std::size_t i = 0; i < dataset_.num_scans(); ++i) {
    if (!there_.track().at(there_.scan_us(i), there_.max_gap_us()).ok()) ++report_.bad_poses;
  }
}

Outcome<std::unique_ptr<DatasetPlayer>> DatasetPlayer::open(const PlayerConfig& config,
                                                            const Dataset& dataset,
                                                            const std::string& dir) {
  Outcome<std::unique_ptr<SensorSender>> sender = SensorSender::open(config.url, config.interface);
  if (!sender.ok()) return sender.failure();
  Outcome<PlayTimeline> timeline = PlayTimeline::make(dataset, config.rate_hz);
  if (!timeline.ok()) return timeline.failure();
  Outcome<PlayTimeline> back = timeline->back();
  if (!back.ok()) return back.failure();
  ScanAhead::Source source{
      .dataset = &dataset, .dir = dir, .cameras = {}, .there_and_back = config.loop};
  if (!config.semantic) {
    Outcome<std::vector<CameraDescription>> cameras = cameras_of(dataset, dir);
    if (!cameras.ok()) return cameras.failure();
    source.cameras = std::move(*cameras);
    source.with_times = dataset.has_times();
  }
  std::unique_ptr<DatasetPlayer> player(new DatasetPlayer(config, dataset, std::move(*timeline),
                                                          std::move(*back), std::move(*sender),
                                                          std::move(source)));
  const Outcome<void> bus = player->open_bus();
  if (!bus.ok()) return bus.failure();
  const Outcome<void> started = player->ahead_.start();
  if (!started.ok()) return started.failure();
  return player;
}

Outcome<void> DatasetPlayer::open_bus() {
  if (config_.can_interface.empty()) return {};
  // Receives nothing: the messages of the node to its vehicle are for others.
  Outcome<CanSocket> bus = CanSocket::open({.interface = config_.can_interface}, {});
  if (!bus.ok()) return bus.failure();
  bus_ = std::move(*bus);
  return {};
}

void DatasetPlayer::begin_pass() {
  has_begun_ = false;
  next_scan_ = 0;
  next_pose_ = config_.sends_poses ? 0 : timeline_->track().size();
  next_cycle_us_ = bus_ ? timeline_->track().oldest_us() : kNever;
}

Outcome<void> DatasetPlayer::play() {
  begin_pass();
  while (true) {
    std::int64_t due_us = kNever;
    static_cast<void>(next(due_us));
    const Outcome<void> fetched = fetch_until(due_us);
    if (!fetched.ok()) return fetched.failure();
    const Next what = next(due_us);
    if (what == Next::kNothing) break;
    wait_until(due_us);
    const Outcome<void> sent = what == Next::kPose    ? send_pose()
                               : what == Next::kCycle ? send_cycle(due_us)
                                                      : send_part();
    if (!sent.ok()) return sent.failure();
  }
  timeline_ = timeline_ == &there_ ? &back_ : &there_;
  return {};
}

/// Of items that are due at the same time, poses come first.
DatasetPlayer::Next DatasetPlayer::next(std::int64_t& due_us) const {
  Next what = Next::kNothing;
  due_us = kNever;
  const PoseTrack& track = timeline_->track();
  if (next_pose_ < track.size()) {
    what = Next::kPose;
    due_us = track[next_pose_].stamp_us;
  }
  if (next_cycle_us_ < due_us) {
    what = Next::kCycle;
    due_us = next_cycle_us_;
  }
  if (!parts_.empty() && parts_.front().due_us < due_us) {
    what = Next::kPart;
    due_us = parts_.front().due_us;
  }
  return what;
}

Outcome<void> DatasetPlayer::fetch_until(std::int64_t due_us) {
  while (next_scan_ < dataset_.num_scans() &&
         timeline_->scan_us(next_scan_) + earliest_us_ <= due_us) {
    const Outcome<void> fetched = fetch();
    if (!fetched.ok()) return fetched.failure();
    due_us = std::min(due_us, parts_.front().due_us);
  }
  return {};
}

Outcome<void> DatasetPlayer::fetch() {
  Outcome<std::unique_ptr<ScanToPlay>> read = ahead_.next();
  if (!read.ok()) return read.failure();
  const std::shared_ptr<const ScanToPlay> scan = std::move(*read);
  const std::int64_t stamp_us = timeline_->scan_us(next_scan_++);
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const std::int64_t taken_us = stamp_us + timeline_->played(cameras_[i].offset_us);
    parts_.push_back({taken_us, taken_us, 0, static_cast<int>(i), scan});
  }
  // A sweep is sent when it has ended: on the way back, with what was measured first.
  std::int64_t ends_us = 0;
  for (const float time_s : scan->times_s) {
    const double recorded_us = 1e6 * std::clamp(static_cast<double>(time_s), -1.0, 1.0);
    ends_us = std::max(ends_us, timeline_->played(std::llround(recorded_us)));
  }
  parts_.push_back({stamp_us + ends_us, stamp_us, 0, kCloud, scan});
  std::stable_sort(parts_.begin(), parts_.end(),
                   [](const Part& a, const Part& b) { return a.due_us < b.due_us; });
  return {};
}

void DatasetPlayer::wait_until(std::int64_t due_us) {
  const std::int64_t period_us = microseconds(1.0 / config_.rate_hz);
  std::int64_t now_us = MonotonicClock::now_us();
  if (!has_begun_) {
    // A pass begins a period after the last one, so that stamps rise.
    const std::int64_t first_us = last_us_ == 0 ? now_us : std::max(now_us, last_us_ + period_us);
    begin_us_ = first_us - due_us;
    has_begun_ = true;
  }
  const std::int64_t late_us = now_us - (begin_us_ + due_us);
  report_.worst_late_us = std::max(report_.worst_late_us, late_us);
  if (late_us > period_us) put_off(due_us, late_us);
  last_us_ = begin_us_ + due_us;
  sleep_until(last_us_);
  now_us = MonotonicClock::now_us();
  clock_ahead_us_ = config_.clock == SensorClock::kWall ? wall_now_us() - now_us : 0;
}

/// Does not make up for a delay. Measurements that are not sent yet keep their stamps: they belong
/// to poses that were sent.
void DatasetPlayer::put_off(std::int64_t due_us, std::int64_t by_us) {
  ++report_.late;
  for (Part& part : parts_) {
    if (part.begin_us == 0 && part.stamp_us < due_us) part.begin_us = begin_us_;
  }
  begin_us_ += by_us;
}

Outcome<void> DatasetPlayer::send(const std::string& channel,
                                  const std::vector<std::byte>& message) {
  if (sender_->send(channel, message)) return {};
  return Failure{
      "cannot send to " + config_.url + ": " + std::strerror(errno) + "; run tessera doctor",
      FailureKind::kFailure};
}

Outcome<void> DatasetPlayer::send_pose() {
  const StampedPose& pose = timeline_->track()[next_pose_++];
  const PoseMessage message{.stamp_us = begin_us_ + pose.stamp_us + clock_ahead_us_,
                            .sequence = static_cast<std::int32_t>(report_.poses++),
                            .quality = PoseQuality::kGood,
                            .T_map_body = pose.T_map_body,
                            .position_sigma_m = Point3d::Constant(-1.0),
                            .rotation_sigma_rad = -1.0};
  return send(config_.channels.pose, encode(message));
}

Outcome<void> DatasetPlayer::send_cycle(std::int64_t due_us) {
  next_cycle_us_ = due_us + SimulatedVehicle::kCycle_us;
  if (next_cycle_us_ > timeline_->track().latest_us()) next_cycle_us_ = kNever;
  const std::int64_t age_us = MonotonicClock::now_us() - (begin_us_ + due_us);
  for (const CanFrame& frame : vehicle_.cycle(timeline_->track(), due_us, age_us)) {
    CanSocket::Sent sent = bus_->send(frame);
    for (int i = 1; i < kTries && sent == CanSocket::Sent::kNoBuffer; ++i) {
      sleep_until(MonotonicClock::now_us() + 1'000);
      sent = bus_->send(frame);
    }
    if (sent == CanSocket::Sent::kGone)
      return Failure{"the CAN interface " + config_.can_interface + " is gone",
                     FailureKind::kFailure};
    ++(sent == CanSocket::Sent::kSent ? report_.frames : report_.frames_lost);
  }
  report_.poses = vehicle_.poses();
  return {};
}

Outcome<void> DatasetPlayer::send_part() {
  const Part part = std::move(parts_.front());
  parts_.erase(parts_.begin());
  if (part.camera == kCloud) return send_cloud(part);
  const auto camera = static_cast<std::size_t>(part.camera);
  const ImageToSend image{.header = {.stamp_us = stamp_of(part),
                                     .camera = part.camera,
                                     .width_px = cameras_[camera].model.width_px(),
                                     .height_px = cameras_[camera].model.height_px()},
                          .components = part.scan->images[camera]};
  ++report_.images;
  return send(config_.channels.label_image, encode(image));
}

Outcome<void> DatasetPlayer::send_cloud(const Part& part) {
  const ScanToPlay& scan = *part.scan;
  CloudToSend cloud{.stamp_us = stamp_of(part), .sensor = config_.sensor, .xyz = scan.xyz};
  std::vector<std::int32_t> times_us;
  times_us.reserve(scan.times_s.size());
  for (const float time_s : scan.times_s) {
    const double us = 1e6 * timeline_->stretch() * static_cast<double>(time_s);
    if (!(std::abs(us) <= kMostSweep_us)) {
      return Failure{"scan " + std::to_string(dataset_.scan_number(scan.scan)) +
                     " has points over a second from its stamp, played at this rate; give a "
                     "higher --rate"};
    }
    times_us.push_back(static_cast<std::int32_t>(std::lround(us)));
  }
  cloud.times_us = times_us;
  // An empty list of components would make an empty scan one without labels.
  const bool semantic = config_.semantic && !scan.components.empty();
  if (semantic) cloud.components = scan.components;
  ++report_.scans;
  if (config_.progress) config_.progress(report_.scans);
  return send(semantic ? config_.channels.semantic_cloud : config_.channels.cloud, encode(cloud));
}

}  // namespace tessera
