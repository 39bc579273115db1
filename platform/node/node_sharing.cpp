// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The work of a node in its sharing thread after each tick: its status, snapshots of the global
// map, and the check whether everything is shared.
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "base/allocation_counter.hpp"
#include "base/monotonic_clock.hpp"
#include "node/node.hpp"

namespace tessera {

namespace {

constexpr std::int64_t kStatusPeriod_us = 1'000'000;
/// Between two checks of the exclude lists of other robots.
constexpr std::int64_t kFleetPeriod_us = 250'000;
/// Between two watchdog notifications to the service manager.
constexpr std::int64_t kNotice_us = 500'000;
/// A robot with incomplete contributions waits longer: others may come back.
constexpr int kIncompletePatience = 3;

std::int64_t wall_clock_us() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000 + std::int64_t{now.tv_nsec} / 1'000;
}

}  // namespace

void Node::after_tick(std::int64_t now_us) {
  look_for_life(now_us);
  apply_security();
  take_corrections(now_us);
  if (earlier_) earlier_->tick(robot_->sharer(), now_us, robot_->exchange().report().records_taken);
  sessions_.tick(robot_->sharer());
  frames_.look(robot_->sharer(), config_.robot, now_us, sharing_log_);
  say_status(now_us);
  hear_statuses(now_us);
  listen_for_scans(now_us);
  const bool may_write = counting_.load(std::memory_order_acquire);
  if (!config_.snapshots.empty() && now_us >= snapshot_due_us_ && may_write) {
    snapshot_due_us_ = now_us + microseconds(config_.snapshot_every_s);
    // Only of this thread: the first thread may save the local map meanwhile.
    const std::uint64_t before = thread_heap_allocations().value_or(0);
    const bool taken = take_snapshot(now_us).ok();
    snapshot_allocations_ += thread_heap_allocations().value_or(0) - before;
    if (!taken) {
      ++run_.failed_snapshots;
      sharing_log_.say(LogLevel::kError, now_us, "a snapshot could not be written");
    }
  }
  if (const char* const reason = reason_to_end(now_us); *reason != '\0') end(reason);
}

/// At most one a tick: its cost is that of all submaps.
void Node::take_corrections(std::int64_t now_us) {
  const CorrectionMessage* const message = sensing_ ? sensing_->correction() : nullptr;
  if (message == nullptr) return;
  const CorrectionHeader& header = message->header;
  const std::span<const double> transforms =
      std::span(message->transforms).first(std::size_t{12} * header.count);
  const std::span<const std::int64_t> keys = std::span(message->keys).first(header.count);
  Sharer& sharer = robot_->sharer();
  CorrectionReport report;
  if (header.of_submaps) {
    // A number that is none of a submap stays one.
    std::transform(keys.begin(), keys.end(), corrected_submaps_.begin(), [](std::int64_t key) {
      return key < 0 || key > UINT32_MAX ? UINT32_MAX : static_cast<std::uint32_t>(key);
    });
    report = sharer.correct(
        CorrectedFrames{std::span(corrected_submaps_).first(header.count), transforms},
        header.revision);
  } else {
    report = sharer.correct(CorrectedTrajectory{keys, transforms}, header.revision);
  }
  if (report.status == Status::kOk) {
    sharing_log_.say_change(LogLevel::kInfo, now_us, "correction %: % submaps moved",
                            header.revision, report.moved);
  } else {
    sharing_log_.say(LogLevel::kWarning, now_us,
                     "correction % is refused: its revision is not above %, or its poses are none "
                     "of this robot's",
                     header.revision, report.revision);
  }
  sensing_->pop_correction();
}

/// Checked here, as this thread neither saves maps on request nor writes the log. The first thread
/// checks this one.
void Node::look_for_life(std::int64_t now_us) {
  struct Watched {
    const Heartbeat* heart;
    const char* silent;
  };
  const Watched all[] = {
      {&mapping_->heartbeat(), "the mapping thread does not respond"},
      {sensing_ ? &sensing_->heartbeat() : nullptr, "the sensing thread does not respond"},
      {vehicle_ ? &vehicle_->heartbeat() : nullptr, "the vehicle thread does not respond"}};
  bool alive = true;
  for (std::uint32_t i = 0; i < std::size(all); ++i) {
    if (all[i].heart == nullptr) continue;
    const std::uint32_t bit = 1U << i;
    const bool late = all[i].heart->is_late(now_us);
    alive = alive && !late;
    if (late && (late_threads_ & bit) == 0) {
      ++run_.silences;
      sharing_log_.say_change(LogLevel::kError, now_us, all[i].silent);
    }
    late_threads_ = late ? late_threads_ | bit : late_threads_ & ~bit;
  }
  // Without it the service manager restarts this process.
  if (!alive || now_us < notice_due_us_) return;
  notice_.tell("WATCHDOG=1");
  notice_due_us_ = now_us + kNotice_us;
}

void Node::say_status(std::int64_t now_us) {
  if (!config_.status || now_us < status_due_us_) return;
  status_due_us_ = now_us + kStatusPeriod_us;
  SharingThreadState sharing;
  MappingThreadState mapping;
  if (!sharing_->state().get(sharing) || !mapping_->state().get(mapping)) return;
  DurationHistogram& second = sharing_->second();
  NodeState status{.robot = config_.robot,
                   .epoch = epoch_.load(),
                   .peers = sharing.in_reach,
                   .session = setup_.robot.exchange.session,
                   .stamp_us = wall_clock_us(),
                   .tick_median_us = static_cast<std::int32_t>(second.quantile_us(0.5)),
                   .tick_max_us = static_cast<std::int32_t>(second.max_us()),
                   .label_voxels = static_cast<std::int64_t>(sharing.global.label_voxels),
                   .free_voxels = 0,
                   .digest = sharing.digest,
                   .exclude_digest = exclude_digest_,
                   .extra = {static_cast<std::int64_t>(mapping.cycles),
                             static_cast<std::int64_t>(sharing.exchange.contributions),
                             static_cast<std::int64_t>(sharing.exchange.complete),
                             static_cast<std::int64_t>(sharing_->times().overruns),
                             static_cast<std::int64_t>(sharing.waiting),
                             static_cast<std::int64_t>(sharing.exchange.records_refused),
                             static_cast<std::int64_t>(sharing.twins()),
                             static_cast<std::int64_t>(sharing.exchange.twins),
                             static_cast<std::int64_t>(sharing.exchange.conflicts)}};
  const DoubtedRobots doubted = doubts_.view();
  status.doubted = doubted.count;
  for (std::size_t i = 0; i < std::min(doubted.all().size(), status.first_doubted.size()); ++i)
    status.first_doubted[i] = {doubted.robots[i].robot, doubted.robots[i].classes};
  port_->report(status);
  port_->flush();
  second.clear();
}

/// A bounded number per tick; the table bounds the checks of signatures.
void Node::hear_statuses(std::int64_t now_us) {
  std::array<std::byte, kMaxMessageBytes> buffer;
  for (std::size_t i = 0; i < StatusTable::kMostRobots; ++i) {
    const std::span<const std::byte> status = port_->receive_status(buffer);
    if (status.empty()) break;
    fleet_->hear(status, now_us, &robot_->exchange().peers());
  }
  if (now_us < fleet_due_us_) return;
  fleet_due_us_ = now_us + kFleetPeriod_us;
  fleet_->look(exclude_digest_, now_us, sharing_log_);
  doubts_.look(robot_->global(), now_us, sharing_log_);
}

Outcome<void> Node::take_snapshot(std::int64_t now_us) {
  const GlobalMap& global = robot_->global();
  if (!global.settled()) return {};  // A move is being copied; tries again with the next tick.
  std::array<char, 32> name{};
  static_cast<void>(
      std::snprintf(name.data(), name.size(), "/global_%04zu.tsm", run_.snapshots.size()));
  Snapshot snapshot{config_.snapshots + name.data(),
                    1e-6 * static_cast<double>(now_us - run_.start_us),
                    global.map().usage().label_voxels};
  std::vector<KeyedIndex> workspace = workspace_for(global.map());
  TESSERA_TRY(save_map(global.map(), identity_of(MapKind::kGlobal), workspace, snapshot.path));
  run_.snapshots.push_back(std::move(snapshot));
  return {};
}

/// Counts scans that are left out too, as mapping pauses or a pose is missing.
void Node::listen_for_scans(std::int64_t now_us) {
  if (!sensing_ || config_.silence_s <= 0.0) return;
  const MatchReport m = sensing_->report().match;
  const std::uint64_t heard = m.given + m.scans.future + m.scans.ancient + m.duplicates +
                              m.out_of_order + m.without_pose + m.without_images + m.superseded +
                              m.dropped_by_step;
  if (heard != scans_heard_) scan_heard_us_ = now_us;
  scans_heard_ = heard;
}

/// For a dataset, when all scans are processed; for sensors, when they have been silent for the
/// configured time.
bool Node::no_scan_will_come(std::int64_t now_us) const {
  if (mapping_->ended()) return true;
  MappingThreadState mapping;
  if (!config_.sensors.enabled || config_.silence_s <= 0.0 || !mapping_->state().get(mapping))
    return false;
  const std::int64_t last_us = std::max(scan_heard_us_, mapping.end_us);
  return scans_heard_ > 0 && now_us - last_us >= microseconds(config_.silence_s);
}

const char* Node::reason_to_end(std::int64_t now_us) {
  if (config_.duration_s > 0.0 && now_us - run_.start_us >= microseconds(config_.duration_s))
    return "duration";
  SharingThreadState sharing;
  if (!no_scan_will_come(now_us)) {
    scans_done_us_ = 0;
    return "";
  }
  if (!sharing_->state().get(sharing)) return "";
  if (scans_done_us_ == 0) scans_done_us_ = now_us;
  const ExchangeReport& exchange = sharing.exchange;
  const int patience = exchange.holds_all() ? 1 : kIncompletePatience;
  const std::int64_t quiet_us = now_us - std::max(sharing.quiet_since_us, scans_done_us_);
  if (sharing.matching >= config_.wait_for_peers && sessions_.is_settled() &&
      quiet_us >= patience * microseconds(config_.quiet_s))
    return "quiet";
  return now_us - scans_done_us_ >= microseconds(config_.linger_s) ? "linger" : "";
}

}  // namespace tessera
