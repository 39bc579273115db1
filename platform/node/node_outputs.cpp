// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The maps that a node writes: while it runs, and in the end.
#include <string_view>

#include "node/kept_maps.hpp"
#include "node/node.hpp"
#include "node/published_map.hpp"
#include "posix/allocation_counter.hpp"
#include "posix/monotonic_clock.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

MapIdentity Node::identity_of(MapKind kind) const {
  MapIdentity identity{.kind = kind};
  Json settings;
  if (kind == MapKind::kLocal) {
    identity.robot = config_.robot;
    identity.epoch = setup_.robot.epoch;
    identity.has_T_global_map = true;
    identity.T_global_map = setup_.robot.T_global_map;
    settings = to_json(config_.map, setup_.map);
    for (const char* const key :
         {"dataset", "out", "report", "continue", "memory", "first", "last", "window", "archive"})
      settings.erase(key);
  } else {
    settings = config_.values.value("fusion", Json::object());
    settings.erase("memory");
    settings["max_range"] = config_.map.max_range_m;
    Json robots = Json::array();
    const Replicas& replicas = robot_->global().replicas();
    for (const Replicas::Slot slot : replicas.in_order()) {
      const Json robot = replicas.contribution(slot).id.robot;
      if (robots.empty() || robots.back() != robot) robots.push_back(robot);
    }
    settings["robots"] = std::move(robots);
  }
  static_cast<void>(record_settings(settings, identity));
  return identity;
}

void Node::save_local_map() {
  if (config_.local_map.empty()) {
    log_.say(LogLevel::kWarning, MonotonicClock::now_us(),
             "a save was asked for, but [output] local_map names no file");
    failed_saves_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  // The map is this thread's while mapping pauses; what shares goes on reading it.
  const std::uint64_t call = mapping_->pause(kPausedToSave, true);
  while (!mapping_->has_taken(call)) service_.sleep_until(MonotonicClock::now_us() + 1'000);
  // Of this thread alone: the sharing thread may write a snapshot meanwhile.
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  std::vector<KeyedIndex> workspace = workspace_for(robot_->map());
  const Outcome<void> saved =
      save_map(robot_->map(), identity_of(MapKind::kLocal), workspace, config_.local_map);
  mapping_->pause(kPausedToSave, false);
  // A disk that is full now may have room later: the node goes on.
  if (!saved.ok()) {
    failed_saves_.fetch_add(1, std::memory_order_relaxed);
    // The writer of the log is this thread: the text stays until it has written it.
    save_failure_ = "the map could not be saved: " + saved.failure().message;
    log_.say(LogLevel::kError, MonotonicClock::now_us(), save_failure_.c_str());
  } else {
    saves_.fetch_add(1, std::memory_order_relaxed);
  }
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

/// Mapping pauses since the clearing was asked for, so no deadline is at stake.
void Node::keep_before_clear(std::int64_t now_us) {
  constexpr std::int64_t kTryAgain_us = 10'000'000;
  const std::uint32_t asked = mapping_->clears_asked();
  if (asked == clears_kept_ || now_us < keep_due_us_) return;
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  const std::uint64_t call = mapping_->pause(kPausedToSave, true);
  while (!mapping_->has_taken(call)) service_.sleep_until(MonotonicClock::now_us() + 1'000);
  const Outcome<void> kept = config_.keep_maps ? keep_map() : Outcome<void>();
  if (kept.ok()) {
    clears_kept_ = asked;
    mapping_->permit_clear(asked);
  } else {
    ++run_.failed_keeps;
    keep_due_us_ = MonotonicClock::now_us() + kTryAgain_us;
    keep_text_ = "the map is not cleared, and mapping pauses, as it cannot be saved before: " +
                 kept.failure().message + "; the next try is in 10 s";
    log_.say_change(LogLevel::kError, MonotonicClock::now_us(), keep_text_.c_str());
  }
  mapping_->pause(kPausedToSave, false);
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

/// Beside the local map; where none is configured, in the folder of the counter of starts.
Outcome<void> Node::keep_map() {
  if (robot_->map().block_count() == 0) return {};
  const std::string beside =
      config_.local_map.empty() ? config_.state + "/robot_" + std::to_string(config_.robot) + ".tsm"
                                : config_.local_map;
  const Outcome<std::string> name = free_epoch_name(beside, setup_.robot.epoch);
  if (!name.ok()) return name.failure();
  std::vector<KeyedIndex> workspace = workspace_for(robot_->map());
  const Outcome<void> saved =
      save_map(robot_->map(), identity_of(MapKind::kLocal), workspace, *name);
  if (!saved.ok()) return saved.failure();
  run_.kept_maps.push_back(*name);
  say_kept();
  return {};
}

void Node::say_kept() {
  keep_text_ = "the map of before is kept as " + run_.kept_maps.back();
  log_.say_change(LogLevel::kInfo, MonotonicClock::now_us(), keep_text_.c_str());
}

Outcome<void> Node::write_maps() {
  const std::int64_t start_us = MonotonicClock::now_us();
  const bool hurried = std::string_view(run_.ended_by) == "signal";
  bool behind = true;
  while (behind && (!hurried || MonotonicClock::now_us() - start_us < kMostFinish_us))
    behind = robot_->fuse_in_spare_time();
  run_.map_is_behind = behind;
  const Outcome<void> written = write_what_is_named();
  run_.save_us = MonotonicClock::now_us() - start_us;
  return written;
}

/// Each is tried, whatever becomes of the others; fails as the first that does.
Outcome<void> Node::write_what_is_named() {
  const LocalMap& global = robot_->global().map();
  std::vector<KeyedIndex> workspace = workspace_for(global);
  global_digest_ = digest(global, workspace);
  Outcome<void> outcome;
  const auto note = [&outcome](const Outcome<void>& saved) {
    if (outcome.ok()) outcome = saved;
  };
  if (!config_.global_map.empty())
    note(save_map(global, identity_of(MapKind::kGlobal), workspace, config_.global_map));
  std::vector<KeyedIndex> local_workspace = workspace_for(robot_->map());
  local_digest_ = digest(robot_->map(), local_workspace);
  if (!config_.local_map.empty()) {
    note(save_map(robot_->map(), identity_of(MapKind::kLocal), local_workspace, config_.local_map));
  }
  if (config_.contribution.empty()) return outcome;
  const Outcome<std::unique_ptr<PublishedMap>> published = published_map(*robot_);
  if (!published.ok()) {
    note(published.failure());
    return outcome;
  }
  std::vector<KeyedIndex> published_workspace = workspace_for((*published)->map);
  note(save_map((*published)->map, identity_of(MapKind::kLocal), published_workspace,
                config_.contribution));
  return outcome;
}

}  // namespace tessera
