// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/sensing_thread.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/monotonic_clock.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

/// Beyond any usable pose, in both directions.
constexpr std::int64_t kFar_us = 3'600'000'000;

/// Why no pose is usable.
const char* reason_of(PoseVerdict verdict) noexcept {
  switch (verdict) {
    case PoseVerdict::kStale:
      return "poses are stale";
    case PoseVerdict::kFrozen:
      return "poses are frozen";
    case PoseVerdict::kJumping:
      return "poses jump";
    case PoseVerdict::kCorrupt:
      return "poses are corrupt";
    case PoseVerdict::kUncertain:
      return "poses are uncertain";
    case PoseVerdict::kRecovering:
      return "too few good poses since they were bad";
    case PoseVerdict::kGood:
    case PoseVerdict::kNone:
    case PoseVerdict::kOutOfOrder:
      break;
  }
  return "there are no poses";
}

}  // namespace

Outcome<std::unique_ptr<SensingThread>> SensingThread::open(const SensorPortConfig& config,
                                                            const PoseGuardConfig& guard,
                                                            VehiclePort* vehicle,
                                                            bool poses_by_bus) {
  std::unique_ptr<SensingThread> sensing(new SensingThread(config, guard, vehicle, poses_by_bus));
  SensorPortConfig with_filter = config;
  with_filter.pose_filter = {
      sensing.get(), [](void* self, const PoseMessage& pose, std::int64_t stamp_now_us) {
        return static_cast<SensingThread*>(self)->may_use(pose, stamp_now_us);
      }};
  // Two sources of poses would contradict each other.
  if (poses_by_bus) with_filter.channels.pose.clear();
  TESSERA_TRY_ASSIGN(std::unique_ptr<SensorPort> port, SensorPort::open(with_filter));
  sensing->port_ = std::move(port);
  return sensing;
}

Outcome<void> SensingThread::start(const ThreadRole& role, MappingThread& mapping,
                                   WakeUp& mapping_wake) {
  mapping_ = &mapping;
  mapping_wake_ = &mapping_wake;
  return thread_.start(
      role, [](void* self) { static_cast<SensingThread*>(self)->run(); }, this);
}

void SensingThread::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  if (port_) port_->wake();
  thread_.join();
}

SourceCounters SensingThread::counters() const noexcept {
  const MatchReport match = port_->report().match;
  return {.offered = match.given, .lost = match.superseded, .unknown_ids = 0};
}

void SensingThread::run() noexcept {
  scan_us_ = MonotonicClock::now_us();
  while (!stopping_.load(std::memory_order_acquire)) {
    heartbeat_.beat(MonotonicClock::now_us());
    take_vehicle_poses();
    port_->step(kTurn_us);
    const SensorReport report = port_->report();
    if (report.match.given != match_.given) mapping_wake_->wake();
    watch_sensors(report, MonotonicClock::now_us());
    match_ = report.match;
    pause_or_go_on();
  }
  heartbeat_.rest();
}

/// Logs changes of the sensors' counters; each line at most once a second.
void SensingThread::watch_sensors(const SensorReport& report, std::int64_t now_us) noexcept {
  const MatchReport& match = report.match;
  if (match.clock_steps != match_.clock_steps)
    log_.say(LogLevel::kWarning, now_us,
             "the sensors' clock was set; waiting messages are dropped");
  const std::uint64_t bare = match.unlabelled + match.partly_unlabelled + match.without_images;
  if (bare != match_.unlabelled + match_.partly_unlabelled + match_.without_images)
    log_.say(LogLevel::kWarning, now_us, "a scan without images of its cameras; % so far",
             static_cast<std::int64_t>(bare));
  if (match.superseded != match_.superseded)
    log_.say(LogLevel::kWarning, now_us, "more scans than can be mapped; % left out so far",
             static_cast<std::int64_t>(match.superseded));
  if (match.given != match_.given) {
    if (sensors_silent_)
      log_.say_change(LogLevel::kInfo, now_us, "scans arrive again after % ms",
                      (now_us - scan_us_) / 1000);
    sensors_silent_ = false;
    scan_us_ = now_us;
  } else if (now_us - scan_us_ > kSilence_us && (!sensors_silent_ || now_us >= silence_due_us_)) {
    now_.silences += sensors_silent_ ? 0U : 1U;
    sensors_silent_ = true;
    silence_due_us_ = now_us + kSayAgain_us;
    say_silence(report, now_us);
  }
  say_poses_are_seldom(match, now_us);
}

/// Measures the rate of poses, whether or not the guard accepts them.
void SensingThread::hear_pose(std::int64_t stamp_us, std::int64_t now_us) noexcept {
  const std::int64_t step_us = stamp_us - pose_stamp_us_;
  const bool follows = pose_heard_us_ != 0 && step_us > 0 && step_us < kSayAgain_us;
  if (follows)
    between_poses_us_ =
        between_poses_us_ == 0 ? step_us : between_poses_us_ + (step_us - between_poses_us_) / 4;
  pose_heard_us_ = now_us;
  pose_stamp_us_ = stamp_us;
}

/// Warns if poses come too far apart for the scans between them, or for the guard.
void SensingThread::say_poses_are_seldom(const MatchReport& match, std::int64_t now_us) noexcept {
  const bool come = pose_heard_us_ != 0 && now_us - pose_heard_us_ < kSilence_us;
  const bool hurts = !was_good_ || match.without_pose != match_.without_pose;
  // A tenth is jitter.
  const bool seldom = between_poses_us_ > most_between_poses_us_ + most_between_poses_us_ / 10;
  if (!come || !hurts || !seldom || now_us < seldom_due_us_) return;
  seldom_due_us_ = now_us + kSayAgain_us;
  log_.say_change(LogLevel::kWarning, now_us,
                  "poses come every % ms; at most % ms are allowed, the least of [sensors] "
                  "max_pose_gap_ms, max_wait_ms and [vehicle] pose_timeout_ms",
                  between_poses_us_ / 1000, most_between_poses_us_ / 1000);
}

/// Logs what happened to scans that were not given out.
void SensingThread::say_silence(const SensorReport& report, std::int64_t now_us) noexcept {
  const MatchReport& match = report.match;
  const std::uint64_t by_stamp =
      match.scans.future + match.scans.ancient + match.duplicates + match.out_of_order;
  log_.say(LogLevel::kWarning, now_us,
           "no scan for % ms; refused by their stamps so far: %, without a pose: %",
           (now_us - scan_us_) / 1000, static_cast<std::int64_t>(by_stamp),
           static_cast<std::int64_t>(match.without_pose));
  const std::uint64_t faults =
      std::accumulate(report.faults.begin(), report.faults.end(), std::uint64_t{0});
  const AssemblerReport& parts = report.link.fragments;
  const std::uint64_t not_whole = parts.malformed + parts.too_large + parts.inconsistent +
                                  parts.torn + parts.timed_out + parts.superseded + parts.evicted;
  if (faults + match.unknown_sensor + not_whole == 0) return;
  log_.say(LogLevel::kWarning, now_us,
           "unreadable messages so far: %, of sensors that are not configured: %, incomplete or "
           "refused long ones: %",
           static_cast<std::int64_t>(faults), static_cast<std::int64_t>(match.unknown_sensor),
           static_cast<std::int64_t>(not_whole));
}

void SensingThread::continue_from(const std::array<double, 12>& T_map_body,
                                  std::int64_t stamp_us) noexcept {
  last_.emplace();
  last_->stamp_us = stamp_us;
  std::copy(T_map_body.begin(), T_map_body.end(), last_->T_map_body.data());
}

/// In the time since then, if its clock still runs: after a restart of the machine it is not known,
/// and a robot that stood still is the likely case.
bool SensingThread::follows_last(const Matrix34d& T_map_body) const noexcept {
  constexpr std::int64_t kMostTime_us = 600'000'000;
  constexpr double kSlack_m = 1.0;
  constexpr double kSlack_rad = 0.3;
  // Farther it was hardly driven while nobody looked; a pose source that was restarted is likelier.
  constexpr double kMost_m = 10.0;
  constexpr double kMost_rad = 1.6;
  const std::int64_t since_us = last_->stamp_us == 0 ? -1 : port_->stamp_now_us() - last_->stamp_us;
  const double time_s =
      since_us >= 0 && since_us <= kMostTime_us ? 1e-6 * static_cast<double>(since_us) : 0.0;
  const Matrix34d moved = product(inverse(last_->T_map_body), T_map_body);
  const double cosine = (moved(0, 0) + moved(1, 1) + moved(2, 2) - 1.0) / 2.0;
  const double angle_rad = std::acos(std::clamp(cosine, -1.0, 1.0));
  return norm(Point3d(moved.col(3))) <=
             std::min(kSlack_m + limits_.max_speed_mps * time_s, kMost_m) &&
         angle_rad <= std::min(kSlack_rad + limits_.max_yaw_rate_radps * time_s, kMost_rad);
}

void SensingThread::note(const StampedPose& pose) noexcept {
  if (last_ && !follows_last(pose.T_map_body)) begin_frame();
  last_.reset();
  ++now_.poses;
  now_.stamp_us = pose.stamp_us;
  std::copy_n(pose.T_map_body.data(), now_.T_map_body.size(), now_.T_map_body.begin());
}

void SensingThread::note_relocations(std::uint64_t relocations) noexcept {
  if (relocations == now_.relocations) return;
  now_.relocations = relocations;
  begin_frame();
}

/// Poses are in another frame now: scans mapped with them would not match the map. They begin
/// another submap; where there are none, a vehicle decides what to do, and without one the map is
/// saved and cleared.
void SensingThread::begin_frame() noexcept {
  // Otherwise a scan between the frames would get a pose half way between them.
  port_->forget_poses();
  if (mapping_->note_jump()) return;
  const std::int64_t now_us = MonotonicClock::now_us();
  if (vehicle_ != nullptr) {
    log_.say_change(
        LogLevel::kError, now_us,
        "poses are of another frame than before; command clear, or start if they are not");
    mapping_->pause(kPausedByNewFrame, true);
  } else {
    log_.say_change(LogLevel::kError, now_us,
                    "poses are of another frame than before: the map is saved, then cleared");
    mapping_->clear_map();
  }
}

bool SensingThread::may_use(const PoseMessage& pose, std::int64_t stamp_now_us) noexcept {
  // Unknown deviations are not counted against a pose.
  const double sigma_m = std::max(pose.position_sigma_m.maxCoeff(), 0.0);
  const std::int64_t now_us = MonotonicClock::now_us();
  // A stamp may be any number.
  const std::int64_t ahead_us =
      std::clamp(pose.stamp_us, stamp_now_us - kFar_us, stamp_now_us + kFar_us) - stamp_now_us;
  const PoseObservation observation{.pose = {now_us + ahead_us, pose.T_map_body},
                                    .received_us = now_us,
                                    .std_position_m = sigma_m,
                                    .std_heading_rad = std::max(pose.rotation_sigma_rad, 0.0)};
  hear_pose(observation.pose.stamp_us, now_us);
  const bool good = guard_.judge(observation) == PoseVerdict::kGood;
  if (good) {
    note(observation.pose);
  } else {
    ++now_.refused;
  }
  note_relocations(guard_.relocations());
  return good;
}

void SensingThread::take_vehicle_poses() noexcept {
  if (!poses_by_bus_) return;
  while (const JudgedPose* const pose = vehicle_->poses().front()) {
    // First, as this pose may be in the new frame already.
    note_relocations(pose->relocations);
    hear_pose(pose->observation.pose.stamp_us, MonotonicClock::now_us());
    if (pose->usable) {
      note(pose->observation.pose);
      StampedPose in_sensors_clock = pose->observation.pose;
      in_sensors_clock.stamp_us += port_->stamp_now_us() - MonotonicClock::now_us();
      // The port counts what does not fit.
      static_cast<void>(port_->add_pose(in_sensors_clock));
    } else {
      ++now_.refused;
    }
    vehicle_->poses().pop();
  }
}

bool SensingThread::poses_are_good() noexcept {
  VehiclePortState status;
  const bool told = vehicle_ != nullptr && vehicle_->status(status);
  if (!poses_by_bus_) {
    if (told) guard_.moves({.received_us = MonotonicClock::now_us(), .state = status.motion});
    now_.verdict = guard_.state(MonotonicClock::now_us());
    return now_.verdict == PoseVerdict::kGood;
  }
  if (!told) return was_good_;
  now_.verdict = status.bus.pose_verdict;
  return status.bus.pose_source != PoseSource::kNone;
}

void SensingThread::pause_or_go_on() noexcept {
  const bool good = poses_are_good();
  if (good != was_good_) {
    mapping_->pause(kPausedByPose, !good);
    now_.pauses += good ? 0U : 1U;
    log_.say_change(good ? LogLevel::kInfo : LogLevel::kWarning, MonotonicClock::now_us(),
                    good ? "poses are good" : reason_of(now_.verdict));
    was_good_ = good;
  }
  state_.set(now_);
}

}  // namespace tessera
