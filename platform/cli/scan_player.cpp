// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/scan_player.hpp"

#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "base/monotonic_clock.hpp"
#include "cli/scan_messages.hpp"

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

/// Interval at which the next scan is looked for if nothing wakes the thread.
constexpr std::int64_t kPatience_us = 100'000;

/// Those of clouds; the labels of a depth image belong to its own camera.
std::vector<CameraDescription> cameras_of(const RecordedScans& scans, const PlayerConfig& config) {
  const RegistrarConfig registration = scans.registration();
  if (config.semantic || registration.depth_camera >= 0) return {};
  return registration.cameras;
}

ReplayConfig replay_of(const PlayerConfig& config) {
  return {.rate_hz = 0.0, .order = config.loop ? ScanOrder::kThereAndBack : ScanOrder::kOnce};
}

}  // namespace

ScanPlayer::ScanPlayer(const PlayerConfig& config, const RecordedScans& scans, PlayTimeline there,
                       PlayTimeline back, std::unique_ptr<SensorSender> sender,
                       std::unique_ptr<Registrar> registrar)
    : config_(config),
      scans_(scans),
      there_(std::move(there)),
      back_(std::move(back)),
      sender_(std::move(sender)),
      registrar_(std::move(registrar)),
      cameras_(cameras_of(scans, config)),
      source_(scans, replay_of(config), wake_, registrar_.get()),
      vehicle_({.base_id = config.can_base_id, .max_gap_us = there_.max_gap_us()}) {
  for (const CameraDescription& camera : cameras_)
    earliest_us_ = std::min({earliest_us_, there_.played(camera.offset_us),
                             config_.loop ? back_.played(camera.offset_us) : std::int64_t{0}});
  for (std::size_t i = 0; i < scans_.num_scans(); ++i) {
    if (!there_.track().at(there_.scan_us(i), there_.max_gap_us()).ok()) ++report_.bad_poses;
  }
}

Outcome<std::unique_ptr<ScanPlayer>> ScanPlayer::open(const PlayerConfig& config,
                                                      const RecordedScans& scans) {
  TESSERA_TRY_ASSIGN(std::unique_ptr<SensorSender> sender,
                     SensorSender::open(config.url, config.interface));
  TESSERA_TRY_ASSIGN(PlayTimeline timeline, PlayTimeline::make(scans, config.rate_hz));
  TESSERA_TRY_ASSIGN(PlayTimeline back, timeline.back());
  std::unique_ptr<Registrar> registrar;
  if (config.semantic) {
    TESSERA_TRY_ASSIGN(std::unique_ptr<Registrar> made, Registrar::make(scans.registration()));
    registrar = std::move(made);
  }
  std::unique_ptr<ScanPlayer> player(new ScanPlayer(config, scans, std::move(timeline),
                                                    std::move(back), std::move(sender),
                                                    std::move(registrar)));
  TESSERA_TRY(player->open_bus());
  TESSERA_TRY(player->source_.start({.name = "tessera-read"}, MonotonicClock::now_us()));
  return player;
}

Outcome<void> ScanPlayer::open_bus() {
  if (config_.can_interface.empty()) return {};
  // Receives nothing: the messages of the node to its vehicle are for others.
  TESSERA_TRY_ASSIGN(CanSocket bus, CanSocket::open({.interface = config_.can_interface}, {}));
  bus_ = std::move(bus);
  return {};
}

void ScanPlayer::begin_pass() {
  has_begun_ = false;
  next_scan_ = 0;
  next_pose_ = config_.sends_poses ? 0 : timeline_->track().size();
  next_cycle_us_ = bus_ ? timeline_->track().oldest_us() : kNever;
}

Outcome<void> ScanPlayer::play() {
  begin_pass();
  while (true) {
    std::int64_t due_us = kNever;
    static_cast<void>(next(due_us));
    TESSERA_TRY(fetch_until(due_us));
    const Next what = next(due_us);
    if (what == Next::kNothing) break;
    wait_until(due_us);
    TESSERA_TRY(what == Next::kPose    ? send_pose()
                : what == Next::kCycle ? send_cycle(due_us)
                                       : send_part());
  }
  timeline_ = timeline_ == &there_ ? &back_ : &there_;
  return {};
}

/// Of items that are due at the same time, poses come first.
ScanPlayer::Next ScanPlayer::next(std::int64_t& due_us) const {
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

Outcome<void> ScanPlayer::fetch_until(std::int64_t due_us) {
  while (next_scan_ < scans_.num_scans() &&
         timeline_->scan_us(next_scan_) + earliest_us_ <= due_us) {
    TESSERA_TRY(fetch());
    due_us = std::min(due_us, parts_.front().due_us);
  }
  return {};
}

Outcome<void> ScanPlayer::fetch() {
  Scan* read = source_.front();
  for (; read == nullptr; read = source_.front()) {
    if (source_.ended()) return source_.outcome();
    wake_.sleep_until(MonotonicClock::now_us() + kPatience_us);
  }
  // Several scans are held at a time, as images may be due long before or after their clouds.
  const auto scan = std::make_shared<Scan>(source_.limits());
  std::swap(*scan, *read);
  source_.pop();
  const std::int64_t stamp_us = timeline_->scan_us(next_scan_++);
  for (std::size_t i = 0; !config_.semantic && i < scan->num_images; ++i) {
    const std::int64_t offset_us = cameras_.empty() ? 0 : cameras_[i].offset_us;
    const std::int64_t taken_us = stamp_us + timeline_->played(offset_us);
    parts_.push_back({taken_us, taken_us, 0, static_cast<int>(i), scan});
  }
  // A sweep is sent when it has ended: on the way back, with what was measured first.
  std::int64_t ends_us = 0;
  if (!config_.semantic && scan->has_times) {
    for (const float time_s : scan->times_s().first(scan->count)) {
      const double recorded_us = 1e6 * std::clamp(static_cast<double>(time_s), -1.0, 1.0);
      ends_us = std::max(ends_us, timeline_->played(std::llround(recorded_us)));
    }
  }
  parts_.push_back({stamp_us + ends_us, stamp_us, 0, kMeasurement, scan});
  std::stable_sort(parts_.begin(), parts_.end(),
                   [](const Part& a, const Part& b) { return a.due_us < b.due_us; });
  return {};
}

void ScanPlayer::wait_until(std::int64_t due_us) {
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
void ScanPlayer::put_off(std::int64_t due_us, std::int64_t by_us) {
  ++report_.late;
  for (Part& part : parts_) {
    if (part.begin_us == 0 && part.stamp_us < due_us) part.begin_us = begin_us_;
  }
  begin_us_ += by_us;
}

Outcome<void> ScanPlayer::send(const std::string& channel, const std::vector<std::byte>& message) {
  if (sender_->send(channel, message)) return {};
  return Failure{
      "cannot send to " + config_.url + ": " + std::strerror(errno) + "; run tessera doctor",
      FailureKind::kFailure};
}

Outcome<void> ScanPlayer::send_pose() {
  const StampedPose& pose = timeline_->track()[next_pose_++];
  const PoseMessage message{.stamp_us = begin_us_ + pose.stamp_us + clock_ahead_us_,
                            .sequence = static_cast<std::int32_t>(report_.poses++),
                            .quality = PoseQuality::kGood,
                            .T_map_body = pose.T_map_body,
                            .position_sigma_m = Point3d::Constant(-1.0),
                            .rotation_sigma_rad = -1.0};
  return send(config_.channels.pose, encode(message));
}

Outcome<void> ScanPlayer::send_cycle(std::int64_t due_us) {
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

Outcome<void> ScanPlayer::send_part() {
  const Part part = std::move(parts_.front());
  parts_.erase(parts_.begin());
  Scan& scan = *part.scan;
  const ScanToSend to_send{.stamp_us = stamp_of(part),
                           .sensor = config_.sensor,
                           .semantic = config_.semantic,
                           .stretch = timeline_->stretch()};
  if (part.camera != kMeasurement) {
    ++report_.images;
    const ScanImage& image = scan.images()[static_cast<std::size_t>(part.camera)];
    // A depth camera has one number for its depths and its labels.
    const std::int32_t camera = cameras_.empty() ? config_.sensor : image.camera;
    return send(config_.channels.label_image, label_message(image, to_send.stamp_us, camera));
  }
  ++report_.scans;
  if (config_.progress) config_.progress(report_.scans);
  if (scan.kind == ScanKind::kDepthImage) {
    TESSERA_TRY(send(config_.channels.depth_image, depth_message(scan, to_send)));
  } else {
    TESSERA_TRY_ASSIGN(const std::vector<std::byte> cloud, cloud_message(scan, to_send));
    const bool semantic = is_semantic(scan, to_send);
    TESSERA_TRY(send(semantic ? config_.channels.semantic_cloud : config_.channels.cloud, cloud));
  }
  if (config_.corrections.empty()) return {};
  sent_us_.push_back(to_send.stamp_us);
  return send_corrections();
}

/// With the stamps under which the scans were sent: what a pose graph would say.
Outcome<void> ScanPlayer::send_corrections() {
  for (const CorrectionFile& file : config_.corrections) {
    const std::vector<Matrix34d>& poses = file.rows.T_map_sensor;
    if (std::min(poses.size(), scans_.num_scans()) != sent_us_.size()) continue;
    ++report_.corrections;
    TESSERA_TRY(
        send(config_.channels.correction,
             encode(CorrectionToSend{.robot = config_.robot,
                                     .revision = static_cast<std::uint32_t>(report_.corrections),
                                     .keys = sent_us_,
                                     .poses = std::span(poses).first(sent_us_.size())})));
  }
  return {};
}

}  // namespace tessera
