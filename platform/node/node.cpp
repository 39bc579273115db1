// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A running node: only writing maps uses the heap.
#include "node/node.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>

#include "base/allocation_counter.hpp"
#include "base/monotonic_clock.hpp"
#include "node/thread_roles.hpp"

namespace tessera {

namespace {

/// Between two checks of the threads.
constexpr std::int64_t kLook_us = 50'000;
/// Between two lines about another process that uses this robot's number.
constexpr std::int64_t kTwinPeriod_us = 60'000'000;
/// Before the next try after the robot's state could not be written.
constexpr std::int64_t kStateRetry_us = 60'000'000;

double cpu_s() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

Node::~Node() {
  stop_threads();
  // Until the maps are written the vehicle is notified that the node stops.
  if (vehicle_) vehicle_->stop();
}

Outcome<void> Node::run(NodeRequests& requests) {
  Progress progress(endless() ? "scans mapped" : "mapping",
                    endless() ? Progress::kEndless : recorded_.scans->num_scans());
  const double cpu_before_s = cpu_s();
  TESSERA_TRY(make_vehicle(requests));
  TESSERA_TRY(start_threads());
  if (view_) std::fprintf(stderr, "the maps are shown at %s\n", view_->url().c_str());
  const std::optional<std::uint64_t> before = heap_allocations();
  counting_.store(true, std::memory_order_release);
  if (view_) view_->begin();
  run_.start_resident_bytes = resident_bytes();
  notice_.tell("READY=1");
  look_after(requests, progress);
  notice_.tell("STOPPING=1");
  stop_threads();
  run_.silences += sharing_silences_;
  run_.end_us = MonotonicClock::now_us();
  run_.end_resident_bytes = resident_bytes();
  run_.cpu_s = cpu_s() - cpu_before_s;
  const std::optional<std::uint64_t> after = heap_allocations();
  if (before && after)
    run_.heap_allocations = *after - *before - snapshot_allocations_ - save_allocations_ -
                            (view_ ? view_->heap_allocations() : 0);
  static_cast<void>(mapping_->state().get(run_.mapping));
  run_.source = source().counters();
  if (archive_)
    window_ = totals_of(robot_->mapper().window(), setup_.map.window->radius_m, &*archive_);
  progress.finish();
  return replay_ ? replay_->outcome() : Outcome<void>();
}

void Node::look_after(NodeRequests& requests, Progress& progress) {
  const bool for_journal = std::getenv("JOURNAL_STREAM") != nullptr;
  LogWriter writer(Progress::kStandardError, for_journal);
  std::array<LogQueue*, 5> all{&log_, &sharing_log_, &mapping_->log()};
  std::size_t count = 3;
  if (sensing_) all[count++] = &sensing_->log();
  if (vehicle_) all[count++] = &vehicle_->log();
  const std::span<LogQueue* const> queues = std::span(all).first(count);
  say_what_is_missing();
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  say_restart(writer, queues);
  for (const std::string& name : run_.kept_maps) {
    say_kept(name);
    writer.write(queues);  // The next one overwrites its text.
  }
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
  while (true) {
    const std::int64_t now_us = MonotonicClock::now_us();
    keep_before_clear(now_us);
    keep_submaps(now_us);
    look_for_sharing(now_us);
    look_for_others(now_us);
    writer.write(queues);
    keep_durable(now_us);
    look_for_earlier_submaps(now_us);
    look_for_sessions(now_us);
    show(progress);
    run_.ended_by = ended_by_.load(std::memory_order_acquire);
    if (run_.ended_by == nullptr && requests.stop.load(std::memory_order_relaxed))
      run_.ended_by = "signal";
    if (run_.ended_by != nullptr) break;
    if (requests.save.exchange(false, std::memory_order_relaxed)) save_local_map();
    // Waits for the next turn while the sharing thread has not taken the last update.
    if (!updates_.is_waiting() && requests.reload.exchange(false, std::memory_order_relaxed))
      reload();
    service_.sleep_until(now_us + kLook_us);
  }
  writer.write(queues);
}

void Node::say_what_is_missing() {
  if (!run_.not_locked.empty())
    log_.say(LogLevel::kWarning, run_.start_us, "memory is not locked; see the report");
  if (run_.missing.priority != 0)
    log_.say(LogLevel::kWarning, run_.start_us,
             "no right to priority %; see docs/reference/operations.md", run_.missing.priority);
  if (run_.missing.cpus)
    log_.say(LogLevel::kWarning, run_.start_us,
             "processors of mapping_cpus or other_cpus are not permitted or do not exist");
  // Else it would go unnoticed until others have mapped the robot.
  if (setup_.map.inference.body.count != 0 && !robot_->sharer().tells_place())
    log_.say(LogLevel::kWarning, run_.start_us,
             "[robot] body is too large to be sent: over 16 m along an axis, or over 10.16 m from "
             "the body's origin; other robots do not learn where this one is, and map it");
}

/// Checked here, as the sharing thread checks the others.
void Node::look_for_sharing(std::int64_t now_us) {
  const bool late = sharing_->heartbeat().is_late(now_us);
  if (late && !sharing_is_late_) {
    ++sharing_silences_;
    log_.say_change(LogLevel::kError, now_us, "the sharing thread does not respond");
  }
  sharing_is_late_ = late;
}

void Node::look_for_others(std::int64_t now_us) {
  SharingThreadState sharing;
  if (!sharing_->state().get(sharing)) return;
  if (sharing.in_reach != peers_seen_)
    log_.say_change(LogLevel::kInfo, now_us, "robots in reach: %, before: %", sharing.in_reach,
                    peers_seen_);
  peers_seen_ = sharing.in_reach;
  refusals_.look({.link = port_->link().report(),
                  .exchange = sharing.exchange,
                  .statuses = port_->link().side_report(),
                  .table = fleet_->view().counters,
                  .global_map = sharing.global_counts,
                  .floors_refused = sharing.floors_refused + state_->floors_refused()},
                 now_us, log_);
  look_for_twins(sharing, now_us);
  look_for_conflicts(sharing, now_us);
  keep_state(sharing, now_us);
  leave_epoch(sharing, now_us);
}

/// Logs at once, and then once a minute while it lasts.
void Node::look_for_twins(const SharingThreadState& sharing, std::int64_t now_us) {
  const std::uint64_t twins = sharing.twins();
  if (twins == twins_told_ || now_us < twins_due_us_) return;
  log_.say_change(
      LogLevel::kError, now_us,
      "another process uses the number of robot %, heard % times; give each robot its own "
      "[robot] id and state",
      config_.robot, static_cast<std::int64_t>(twins - twins_told_));
  twins_told_ = twins;
  twins_due_us_ = now_us + kTwinPeriod_us;
}

/// Logs which robot it is, and since when.
void Node::look_for_conflicts(const SharingThreadState& sharing, std::int64_t now_us) {
  for (; conflicts_told_ < sharing.conflict_count; ++conflicts_told_) {
    const ContributionId& id = sharing.conflicts[conflicts_told_];
    log_.say(LogLevel::kError, now_us,
             "robot % signed two contents of one version in its epoch %: its state was copied, or "
             "its key was stolen",
             id.robot, id.epoch);
  }
}

/// This thread may wait for the disk.
void Node::keep_state(const SharingThreadState& sharing, std::int64_t now_us) {
  if (now_us < state_due_us_) return;
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  const bool first = sharing.exchange.published_parts != 0 && state_->published() < state_->epoch();
  const auto floors = std::span(sharing.floors).first(sharing.floor_count);
  if ((first && !state_->note_published(state_->epoch()).ok()) ||
      !state_->note_floors(floors).ok()) {
    log_.say(LogLevel::kError, now_us, "the robot's state could not be written; see [robot] state");
    state_due_us_ = now_us + kStateRetry_us;
  }
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

/// Another process published under this robot's number: the next epoch is durable before it is
/// used, so that no start ever uses it again.
void Node::leave_epoch(const SharingThreadState& sharing, std::int64_t now_us) {
  if (sharing.overtaken == 0 || !reopening_.may_change(now_us)) return;
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  const bool was_mixed = sharing.overtaken - 1 == state_->epoch();
  const bool kept = state_->raise_epoch(sharing.overtaken).ok() &&
                    state_->raise_starts((sharing.highest_session_heard >> 32U) + 1).ok();
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
  if (!kept) {
    reopening_.put_off(now_us);
    log_.say(LogLevel::kError, now_us, "the robot's state could not be written; see [robot] state");
    return;
  }
  reopening_.note_change(now_us);
  epoch_ = state_->epoch();
  log_.say(LogLevel::kError, now_us,
           "another process has published as this robot, up to epoch %: continuing in epoch %",
           static_cast<std::int64_t>(sharing.overtaken - 1), state_->epoch());
  // An epoch that two processes used has two maps.
  sharing_->ask_to_reopen(state_->epoch(), was_mixed ? state_->epoch() : state_->floor());
}

void Node::end(const char* reason) noexcept {
  const char* none = nullptr;
  ended_by_.compare_exchange_strong(none, reason, std::memory_order_acq_rel);
  service_.wake();
}

void Node::show(Progress& progress) const {
  SharingThreadState sharing;
  MappingThreadState mapping;
  if (!sharing_->state().get(sharing) || !mapping_->state().get(mapping)) return;
  std::array<char, 80> suffix{};
  static_cast<void>(std::snprintf(suffix.data(), suffix.size(),
                                  "%u of %u contributions complete, %u far",
                                  sharing.exchange.complete, sharing.exchange.contributions,
                                  sharing.exchange.far_contributions));
  progress.update(mapping.cycles, suffix.data());
}

}  // namespace tessera
