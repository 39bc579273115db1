// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a node does in its sharing thread after each tick: its status, pictures of the global map,
// and whether all is told.
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "node/node.hpp"
#include "posix/allocation_counter.hpp"
#include "posix/monotonic_clock.hpp"

namespace tessera {

namespace {

constexpr std::int64_t kStatusPeriod_us = 1'000'000;
/// What lacks something waits longer for it: others may be about to come back.
constexpr int kIncompletePatience = 3;

std::int64_t wall_clock_us() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000 + std::int64_t{now.tv_nsec} / 1'000;
}

}  // namespace

void Node::after_tick(std::int64_t now_us) {
  say_status(now_us);
  const bool may_write = sharing_outcome_.ok() && counting_.load(std::memory_order_acquire);
  if (!config_.snapshots.empty() && now_us >= snapshot_due_us_ && may_write) {
    snapshot_due_us_ = now_us + microseconds(config_.snapshot_every_s);
    sharing_outcome_ = take_snapshot(now_us);
    if (!sharing_outcome_.ok()) end("failure");
  }
  if (const char* const reason = reason_to_end(now_us); *reason != '\0') end(reason);
}

void Node::say_status(std::int64_t now_us) {
  if (!config_.status || now_us < status_due_us_) return;
  status_due_us_ = now_us + kStatusPeriod_us;
  SharingStatus sharing;
  MappingStatus mapping;
  if (!sharing_->status().get(sharing) || !mapping_->status().get(mapping)) return;
  DurationHistogram& second = sharing_->second();
  const NodeStatus status{.robot = config_.robot,
                          .epoch = setup_.robot.epoch,
                          .peers = sharing.exchange.peers,
                          .stamp_us = wall_clock_us(),
                          .tick_median_us = static_cast<std::int32_t>(second.quantile_us(0.5)),
                          .tick_max_us = static_cast<std::int32_t>(second.max_us()),
                          .label_voxels = static_cast<std::int64_t>(sharing.global.label_voxels),
                          .free_voxels = 0,
                          .digest = sharing.digest,
                          .extra = {static_cast<std::int64_t>(mapping.cycles),
                                    static_cast<std::int64_t>(sharing.exchange.contributions),
                                    static_cast<std::int64_t>(sharing.exchange.complete),
                                    static_cast<std::int64_t>(sharing_->times().overruns),
                                    static_cast<std::int64_t>(sharing.waiting),
                                    static_cast<std::int64_t>(sharing.exchange.records_refused),
                                    static_cast<std::int64_t>(sharing.exchange.refused_tag)}};
  port_->report(status);
  port_->flush();
  second.clear();
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
  SharingStatus sharing;
  if (!mapping_->ended() || !sharing_->status().get(sharing)) return "";
  if (scans_done_us_ == 0) scans_done_us_ = now_us;
  const ExchangeReport& exchange = sharing.exchange;
  const int patience = exchange.complete == exchange.contributions ? 1 : kIncompletePatience;
  const std::int64_t quiet_us = now_us - std::max(sharing.quiet_since_us, scans_done_us_);
  if (exchange.peers >= config_.wait_for_peers &&
      quiet_us >= patience * microseconds(config_.quiet_s))
    return "quiet";
  return now_us - scans_done_us_ >= microseconds(config_.linger_s) ? "linger" : "";
}

}  // namespace tessera
