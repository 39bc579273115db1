// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The node's loop: nothing in it uses the heap but what writes snapshots.
#include "node/node.hpp"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "posix/allocation_counter.hpp"
#include "posix/monotonic_clock.hpp"

namespace tessera {

namespace {

constexpr std::int64_t kStatusPeriod_us = 1'000'000;
/// What lacks something waits longer for it: others may be about to come back.
constexpr int kIncompletePatience = 3;

double cpu_s() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::int64_t wall_clock_us() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000 + std::int64_t{now.tv_nsec} / 1'000;
}

}  // namespace

Outcome<void> Node::run(const std::atomic<bool>& stop) {
  const std::uint64_t total = config_.loop ? 1 : dataset_.num_scans();
  Progress progress("mapping", total);
  const std::optional<std::uint64_t> before = heap_allocations();
  const double cpu_before_s = cpu_s();
  run_.start_us = MonotonicClock::now_us();
  first_scan_us_ = scan_due_us_ = run_.start_us + microseconds(config_.start_delay_s);
  loop_.emplace(*robot_, *port_, run_.start_us, 1000 * config_.tick_ms);
  quiet_since_us_ = status_due_us_ = snapshot_due_us_ = run_.start_us;
  while (true) {
    std::int64_t now_us = MonotonicClock::now_us();
    loop_->receive(now_us);
    if (!scans_done_ && now_us >= scan_due_us_) {
      const Outcome<void> integrated = integrate_next(now_us);
      if (!integrated.ok()) return integrated.failure();
      show(progress);
      now_us = MonotonicClock::now_us();
    }
    if (now_us >= loop_->tick_due_us()) {
      const Outcome<void> done = tick(now_us);
      if (!done.ok()) return done.failure();
      run_.ended_by = stop.load(std::memory_order_relaxed) ? "signal" : reason_to_end(now_us);
      if (*run_.ended_by != '\0') break;
    }
    loop_->send(now_us);
    const std::int64_t next_us =
        scans_done_ ? loop_->tick_due_us() : std::min(loop_->tick_due_us(), scan_due_us_);
    loop_->wait_until(next_us);
  }
  robot_->exchange().leave();
  loop_->send(MonotonicClock::now_us());
  port_->close();
  run_.end_us = MonotonicClock::now_us();
  run_.cpu_s = cpu_s() - cpu_before_s;
  const std::optional<std::uint64_t> after = heap_allocations();
  if (before && after) run_.heap_allocations = *after - *before - snapshot_allocations_;
  progress.finish();
  return {};
}

Outcome<void> Node::integrate_next(std::int64_t now_us) {
  const Outcome<DatasetScan> scan = dataset_.read(next_scan_, buffer_);
  if (!scan.ok()) return scan.failure();
  run_.worst_late_us = std::max(run_.worst_late_us, now_us - scan_due_us_);
  const std::int64_t start_us = MonotonicClock::now_us();
  const ScanReport report = robot_->integrate(scan->view(), start_us);
  run_.scan_times.add(MonotonicClock::now_us() - start_us);
  ++run_.scans;
  run_.points += report.points;
  run_.unknown_ids += scan->unknown.points;
  run_.bad_poses += report.pose == Status::kOk ? 0U : 1U;
  run_.left_out += report.left_out();
  // From the first scan on, so that delays do not add up; without a rate, after a look around.
  scan_due_us_ =
      config_.rate_hz > 0.0
          ? first_scan_us_ + microseconds(static_cast<double>(run_.scans) / config_.rate_hz)
          : now_us;
  if (++next_scan_ < dataset_.num_scans()) return {};
  next_scan_ = 0;
  scans_done_ = !config_.loop;
  scans_done_us_ = MonotonicClock::now_us();
  return {};
}

Outcome<void> Node::tick(std::int64_t now_us) {
  second_.add(loop_->tick(now_us));
  say_status(now_us);
  if (config_.snapshots.empty() || now_us < snapshot_due_us_) return {};
  snapshot_due_us_ = now_us + microseconds(config_.snapshot_every_s);
  return take_snapshot(now_us);
}

void Node::say_status(std::int64_t now_us) {
  if (!config_.status || now_us < status_due_us_) return;
  status_due_us_ = now_us + kStatusPeriod_us;
  const ExchangeReport exchange = robot_->exchange().report();
  const MapUsage usage = robot_->global().map().usage();
  const NodeStatus status{.robot = config_.robot,
                          .epoch = setup_.robot.epoch,
                          .peers = exchange.peers,
                          .stamp_us = wall_clock_us(),
                          .tick_median_us = static_cast<std::int32_t>(second_.quantile_us(0.5)),
                          .tick_max_us = static_cast<std::int32_t>(second_.max_us()),
                          .label_voxels = static_cast<std::int64_t>(usage.label_voxels),
                          .free_voxels = 0,
                          .digest = robot_->exchange().digest(),
                          .extra = {static_cast<std::int64_t>(run_.scans),
                                    static_cast<std::int64_t>(exchange.contributions),
                                    static_cast<std::int64_t>(exchange.complete),
                                    static_cast<std::int64_t>(loop_->times().overruns),
                                    static_cast<std::int64_t>(robot_->global().waiting()),
                                    static_cast<std::int64_t>(exchange.records_refused),
                                    static_cast<std::int64_t>(exchange.refused_tag)}};
  port_->report(status);
  port_->flush();
  second_.clear();
}

Outcome<void> Node::take_snapshot(std::int64_t now_us) {
  const GlobalMap& global = robot_->global();
  if (!global.settled()) return {};  // A move is being copied; the next tick will do.
  const std::optional<std::uint64_t> before = heap_allocations();
  std::array<char, 32> name{};
  static_cast<void>(
      std::snprintf(name.data(), name.size(), "/global_%04zu.tsm", run_.snapshots.size()));
  Snapshot snapshot{config_.snapshots + name.data(),
                    1e-6 * static_cast<double>(now_us - run_.start_us),
                    global.map().usage().label_voxels};
  std::vector<KeyedIndex> workspace = workspace_for(global.map());
  const Outcome<void> saved =
      save_map(global.map(), identity_of(MapKind::kGlobal), workspace, snapshot.path);
  if (!saved.ok()) return saved.failure();
  run_.snapshots.push_back(std::move(snapshot));
  const std::optional<std::uint64_t> after = heap_allocations();
  if (before && after) snapshot_allocations_ += *after - *before;
  return {};
}

const char* Node::reason_to_end(std::int64_t now_us) {
  if (config_.duration_s > 0.0 && now_us - run_.start_us >= microseconds(config_.duration_s))
    return "duration";
  const ExchangeReport exchange = robot_->exchange().report();
  const Activity activity{exchange.records_taken, exchange.published_parts,
                          exchange.fresh_chunks + exchange.answer_chunks, exchange.contributions};
  if (!scans_done_ || !robot_->idle() || activity != activity_) quiet_since_us_ = now_us;
  activity_ = activity;
  if (!scans_done_) return "";
  const int patience = exchange.complete == exchange.contributions ? 1 : kIncompletePatience;
  if (exchange.peers >= config_.wait_for_peers &&
      now_us - quiet_since_us_ >= patience * microseconds(config_.quiet_s))
    return "quiet";
  return now_us - scans_done_us_ >= microseconds(config_.linger_s) ? "linger" : "";
}

void Node::show(Progress& progress) const {
  const ExchangeReport exchange = robot_->exchange().report();
  std::array<char, 48> suffix{};
  static_cast<void>(std::snprintf(suffix.data(), suffix.size(), "%u of %u contributions whole",
                                  exchange.complete, exchange.contributions));
  progress.update(config_.loop ? 0 : run_.scans, suffix.data());
}

}  // namespace tessera
