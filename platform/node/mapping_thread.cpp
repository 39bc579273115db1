// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/mapping_thread.hpp"

#include <algorithm>

#include "base/monotonic_clock.hpp"
#include "scans/scan_losses.hpp"

namespace tessera {

Outcome<void> MappingThread::start(const ThreadRole& role) {
  return thread_.start(
      role, [](void* self) { static_cast<MappingThread*>(self)->run(); }, this);
}

void MappingThread::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  wake_.wake();
  thread_.join();
}

std::uint64_t MappingThread::pause(MappingPause reason, bool on) noexcept {
  constexpr std::uint64_t kCall = std::uint64_t{1} << 32U;
  std::uint64_t before = pause_.load(std::memory_order_relaxed);
  std::uint64_t after = 0;
  do {
    after = (on ? before | reason : before & ~std::uint64_t{reason}) + kCall;
  } while (!pause_.compare_exchange_weak(before, after, std::memory_order_acq_rel));
  wake_.wake();
  return after;
}

void MappingThread::run() noexcept {
  thread_number_ = tessera::thread_number();
  const PageFaults before = thread_page_faults();
  while (!stopping_.load(std::memory_order_acquire)) work();
  const PageFaults after = thread_page_faults();
  page_faults_ = {.minor = after.minor - before.minor, .major = after.major - before.major};
  heartbeat_.rest();
}

/// One turn: maps a scan, or sleeps.
void MappingThread::work() noexcept {
  const std::int64_t now_us = MonotonicClock::now_us();
  heartbeat_.beat(now_us);
  note_pause(now_us);
  if ((now_.pause & kPausedToSave) == 0) clear_if_permitted();
  if (Scan* const scan = source_.front(); scan != nullptr) {
    if (paused()) {
      ++now_.paused;
      state_.set(now_);
    } else {
      take(*scan, now_us);
    }
    source_.pop();
    return;
  }
  if (source_.ended()) ended_.store(true, std::memory_order_release);
  wake_.sleep_until(now_us + config_.period_us);
}

void MappingThread::note_pause(std::int64_t now_us) noexcept {
  const std::uint64_t asked = pause_.load(std::memory_order_acquire);
  if (asked == taken_.load(std::memory_order_relaxed)) return;
  const auto reasons = static_cast<std::uint32_t>(asked & kReasons);
  if (reasons != now_.pause) {
    log_.say_change(LogLevel::kInfo, now_us, reasons != 0 ? "paused, reasons %" : "resumes",
                    reasons);
    now_.pause = reasons;
    state_.set(now_);
  }
  // A thread that sees this value also sees the work before it.
  taken_.store(asked, std::memory_order_release);
}

void MappingThread::clear_if_permitted() noexcept {
  const std::uint32_t permitted = clears_permitted_.load(std::memory_order_acquire);
  if (permitted == cleared_) return;
  if (!mapper_.clear()) return;
  cleared_ = permitted;
  ++now_.clears;
  now_.usage = mapper_.map().usage();
  state_.set(now_);
}

void MappingThread::take(Scan& scan, std::int64_t now_us) noexcept {
  const std::int64_t late_us = now_us - scan.taken_us;
  now_.worst_late_us = std::max(now_.worst_late_us, late_us);
  if (late_us > config_.period_us) ++now_.late;
  ScanView view;
  if (!registrar_.view(scan, view)) return;
  if (teammates_ != nullptr && teammates_->get(teammates_now_))
    view.teammates = std::span(boxes_).first(teammates_now_.place(scan.taken_us, boxes_));
  if (watched_ != nullptr && watched_->get(watched_now_)) view.watched = watched_now_.all();
  if (config_.may_wait) wait_for_room(view, now_us);
  const ScanReport report = mapper_.integrate(view, now_us);
  const std::int64_t end_us = MonotonicClock::now_us();
  if (report.pose == Status::kBusy) {  // beyond a jump: it is in no map
    say_submaps(end_us);
    return state_.set(now_);
  }
  if (!view.watched.empty() && watched_now_.submap == mapper_.maps().number()) {
    watched_now_.taken_us = scan.taken_us;
    seen_.set(watched_now_);
  }
  cycles_.add(end_us - now_us);
  now_.last_cycle_us = end_us - now_us;
  now_.worst_cycle_us = std::max(now_.worst_cycle_us, now_.last_cycle_us);
  latencies_.add(end_us - scan.taken_us);
  if (now_.cycles == 0) log_.say(LogLevel::kInfo, end_us, "integrated the first scan");
  ++now_.cycles;
  now_.scans.add(report);
  now_.shed += report.left_out() != 0 ? 1U : 0U;
  now_.bad_poses += report.pose == Status::kInvalidArgument ? 1U : 0U;
  say_submaps(end_us);
  say_losses(report, end_us);
  if (end_us - now_us > config_.period_us) {
    ++now_.missed;
    log_.say(LogLevel::kWarning, end_us, "a cycle took % us of %", end_us - now_us,
             config_.period_us);
  }
  now_.stamp_us = scan.stamp_us;
  now_.taken_us = scan.taken_us;
  if (now_.first_us == 0) now_.first_us = end_us;
  now_.end_us = end_us;
  const Matrix34d& T_map_body = config_.has_body ? scan.T_map_body : view.T_map_sensor;
  std::copy_n(view.T_map_sensor.data(), now_.T_map_sensor.size(), now_.T_map_sensor.begin());
  std::copy_n(T_map_body.data(), now_.T_map_body.size(), now_.T_map_body.begin());
  now_.submap = mapper_.maps().number();
  now_.submap_note = mapper_.submap_note();
  now_.map_revision = mapper_.map().revision();
  now_.usage = mapper_.map().usage();
  say_window(end_us);
  state_.set(now_);
}

/// Blocks leave by way of the thread that publishes, some thousands each of its ticks. Ends too
/// where none has left for kMostWait_us: then nothing makes room.
void MappingThread::wait_for_room(const ScanView& view, std::int64_t now_us) noexcept {
  constexpr std::int64_t kMostWait_us = 2'000'000;
  constexpr std::int64_t kPause_us = 5'000;
  std::uint64_t evicted = mapper_.window().evicted;
  std::int64_t since_us = now_us;
  std::int64_t at_us = now_us;
  while (!mapper_.make_room(view) && !stopping_.load(std::memory_order_acquire)) {
    at_us = MonotonicClock::now_us();
    if (mapper_.window().evicted != evicted) since_us = at_us;
    if (at_us - since_us > kMostWait_us) break;
    evicted = mapper_.window().evicted;
    heartbeat_.beat(at_us);
    wake_.sleep_until(at_us + kPause_us);
    at_us = MonotonicClock::now_us();
  }
  now_.waited_us += at_us - now_us;
}

void MappingThread::say_submaps(std::int64_t now_us) noexcept {
  const SubmapCounts& now = mapper_.submaps();
  if (now.by_jump != now_.submaps.by_jump)
    log_.say_change(LogLevel::kInfo, now_us,
                    "poses are of another frame than before: submap % begins",
                    mapper_.maps().number());
  if (now.left_out != now_.submaps.left_out)
    log_.say(LogLevel::kWarning, now_us,
             "% scans left out, as poses jumped and no submap can begin yet",
             static_cast<std::int64_t>(now.left_out));
  now_.submaps = now;
}

void MappingThread::say_window(std::int64_t now_us) noexcept {
  const WindowReport& window = mapper_.window();
  const auto failed = static_cast<std::int64_t>(window.reloads_failed - now_.window.reloads_failed);
  if (failed != 0)
    log_.say(LogLevel::kError, now_us,
             "% blocks could not be read from the archive; see [map] archive", failed);
  const auto near = static_cast<std::int64_t>(window.near_evicted - now_.window.near_evicted);
  if (near != 0)
    log_.say(
        LogLevel::kWarning, now_us,
        "the map's memory is full: % blocks within the window went to the archive, it reaches % "
        "edges of a block; see [map] memory",
        near, static_cast<std::int64_t>(window.reach_blocks));
  now_.window = window;
}

/// Each line is logged at most once a second.
void MappingThread::say_losses(const ScanReport& report, std::int64_t now_us) noexcept {
  ScanTotals of_scan;
  of_scan.add(report);
  // Those over capacity have a line of their own.
  const auto memory =
      static_cast<std::int64_t>(left_out_for_memory(of_scan) - report.over_capacity);
  const bool by_scratch = report.refused_tiles + report.refused_ray_blocks > report.refused_storage;
  if (memory != 0 && by_scratch) {
    log_.say(LogLevel::kWarning, now_us,
             "the scratch memory is full: % points and rays left out; see [map] memory", memory);
  } else if (memory != 0) {
    log_.say(LogLevel::kWarning, now_us,
             "the map's memory is full: % points and rays left out; see [map] memory", memory);
  }
  if (report.over_capacity != 0)
    log_.say(LogLevel::kWarning, now_us,
             "a scan has % points too many; the rest was sampled evenly", report.over_capacity);
  const auto work = static_cast<std::int64_t>(left_out_for_work(of_scan));
  if (work != 0)
    log_.say(LogLevel::kWarning, now_us,
             "% points and rays left out, as the work budget was spent; see [map] work_budget",
             work);
  const std::uint32_t time = report.left_out_deadline();
  if (time != 0)
    log_.say(LogLevel::kWarning, now_us, "% points and rays left out, to be in time", time);
}

}  // namespace tessera
