// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The maps that a node writes: while it runs, and at the end.
#include <fmt/core.h>

#include <string_view>

#include "base/allocation_counter.hpp"
#include "base/monotonic_clock.hpp"
#include "maps/whole_map_file.hpp"
#include "node/kept_maps.hpp"
#include "node/node.hpp"
#include "node/published_map.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

MapIdentity Node::identity_of(MapKind kind) const {
  // For a global map: the robot that made it, and the start. Its settings name its robots.
  MapIdentity identity{.kind = kind, .robot = config_.robot, .epoch = epoch_.load()};
  Json settings;
  if (kind == MapKind::kLocal) {
    identity.has_T_global_map = true;
    identity.T_global_map = setup_.robot.T_global_map;
    if (config_.frames != FrameMode::kGiven) {
      // Where links have it by now. A frame that is this robot's alone says nothing to others.
      const FramesState frames = frames_.view();
      const auto T = T_team_world(frames, config_.robot);
      identity.has_T_global_map = T && frames.joined;
      if (T) identity.T_global_map = product(*T, setup_.robot.T_global_map);
    }
    settings = settings_of(to_json(config_.map, setup_.map));
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
  // The map is worth more than its record.
  if (!record_settings(settings, identity).ok())
    failed_records_.fetch_add(1, std::memory_order_relaxed);
  return identity;
}

/// Keeps the maps that this start would overwrite.
Outcome<void> Node::keep_earlier_maps() {
  if (!config_.keep_maps) return {};
  for (const std::string& path : {config_.local_map, config_.global_map, config_.contribution}) {
    if (path.empty() || (path == config_.local_map && is_continued(path))) continue;
    TESSERA_TRY_ASSIGN(const std::string kept, keep_earlier_map(path));
    if (!kept.empty()) run_.kept_maps.push_back(kept);
  }
  return {};
}

void Node::save_local_map() {
  if (config_.local_map.empty()) {
    log_.say(LogLevel::kWarning, MonotonicClock::now_us(),
             "a save was requested, but [output] local_map names no file");
    failed_saves_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  // Only of this thread: the sharing thread may write a snapshot meanwhile.
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  const Outcome<void> saved = save_while_mapping();
  // A full disk may have room later: the node continues.
  if (!saved.ok()) {
    failed_saves_.fetch_add(1, std::memory_order_relaxed);
    // This thread writes the log, so the text stays valid until it is written.
    save_failure_ = "the map could not be saved: " + saved.failure().text(Speaker::kFile);
    log_.say(LogLevel::kError, MonotonicClock::now_us(), save_failure_.c_str());
  } else {
    saves_.fetch_add(1, std::memory_order_relaxed);
  }
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

/// While there is no room for it, mapping continues in the current submap.
void Node::keep_submaps(std::int64_t now_us) {
  constexpr std::int64_t kTryAgain_us = 10'000'000;
  if (!kept_ || now_us < submaps_due_us_ ||
      !robot_->maps().ended(LocalMaps::User::kKeeping).has_value())
    return;
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  const Outcome<void> kept = keep_ended();
  if (!kept.ok()) {
    submaps_due_us_ = now_us + kTryAgain_us;
    submap_failure_ = "a submap cannot be kept, so the current one continues: " +
                      kept.failure().text(Speaker::kFile) + "; the next try is in 10 s";
    log_.say_change(LogLevel::kError, now_us, submap_failure_.c_str());
  }
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

Outcome<void> Node::keep_ended() {
  return kept_->keep_ended(robot_->mapper().maps(), identity_of(MapKind::kLocal));
}

/// Mapping pauses or has ended.
KeptSubmaps::CurrentSubmap Node::current_submap() const {
  return {robot_->map(), robot_->maps().number(), (*robot_).mapper().submap_note()};
}

std::vector<KeptSubmaps::Frame> Node::submap_frames() const {
  // The last correction may have come after the last tick.
  if (has_stopped_) return KeptSubmaps::frames_of((*robot_).sharer().frames());
  const auto state = std::make_unique<SubmapFramesState>();
  std::vector<KeptSubmaps::Frame> frames;
  if (!sharing_->frames().get(*state)) return frames;
  for (std::uint32_t i = 0; i < state->count; ++i) {
    const SubmapFrame& frame = state->frames[i];
    frames.push_back({state->first + i, frame.frame, frame.revision});
  }
  return frames;
}

/// This thread owns the map while mapping pauses; the sharing thread continues to read it. With an
/// archive mapping pauses only until what is in memory is copied.
Outcome<void> Node::save_while_mapping() {
  const std::uint64_t call = mapping_->pause(kPausedToSave, true);
  while (!mapping_->has_taken(call)) service_.sleep_until(MonotonicClock::now_us() + 1'000);
  if (!archive_) {
    const Outcome<MapSummary> saved = save_paused_map(config_.local_map);
    mapping_->pause(kPausedToSave, false);
    return saved.ok() ? Outcome<void>() : saved.failure();
  }
  const Outcome<std::unique_ptr<MapSnapshot>> snapshot =
      MapSnapshot::take(robot_->map(), **archive_, config_.local_map);
  mapping_->pause(kPausedToSave, false);
  if (!snapshot.ok()) return snapshot.failure();
  TESSERA_TRY((*snapshot)->save(identity_of(MapKind::kLocal), config_.local_map));
  return {};
}

/// All of the local map, with what is archived of it; nothing writes to either.
Outcome<MapSummary> Node::save_paused_map(const std::string& path) {
  const LocalMap& map = robot_->map();
  const MapIdentity identity = identity_of(MapKind::kLocal);
  if (kept_) {
    TESSERA_TRY(keep_ended());
    return kept_->save_as(path, current_submap(), submap_frames(), identity);
  }
  if (archive_) return save_whole(map, **archive_, identity, path);
  std::vector<KeyedIndex> workspace = workspace_for(map);
  return save_map(map, identity, workspace, path);
}

/// Mapping is paused since the clear was requested, so no deadline is affected.
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
    keep_text_ =
        "the map is not cleared, and mapping is paused, as the map cannot be saved first: " +
        kept.failure().text(Speaker::kFile) + "; the next try is in 10 s";
    log_.say_change(LogLevel::kError, MonotonicClock::now_us(), keep_text_.c_str());
  }
  mapping_->pause(kPausedToSave, false);
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

/// Writes next to the local map; if none is configured, into the folder of the robot's state.
Outcome<void> Node::keep_map() {
  const bool archived =
      (archive_ && (*archive_)->blocks().index().size() > 0) || (kept_ && !kept_->rows().empty());
  if (robot_->map().block_count() == 0 && !archived) return {};
  const std::string beside = config_.local_map.empty()
                                 ? fmt::format("{}/robot_{}.tsm", config_.state, config_.robot)
                                 : config_.local_map;
  TESSERA_TRY_ASSIGN(const std::string name, free_epoch_name(beside, epoch_.load()));
  TESSERA_TRY(save_paused_map(name));
  run_.kept_maps.push_back(name);
  say_kept(name);
  return {};
}

void Node::say_kept(const std::string& name) {
  keep_text_ = "the earlier map is kept as " + name;
  log_.say_change(LogLevel::kInfo, MonotonicClock::now_us(), keep_text_.c_str());
}

Outcome<void> Node::write_maps() {
  const std::int64_t start_us = MonotonicClock::now_us();
  const bool hurried = std::string_view(run_.ended_by) == "signal";
  bool behind = true;
  while (behind && (!hurried || MonotonicClock::now_us() - start_us < kMostFinish_us))
    behind = robot_->fuse_in_spare_time();
  run_.map_is_behind = behind;
  Outcome<void> written = write_what_is_named();
  // What it holds is written, or nobody wants it.
  if (written.ok() && archive_) (*archive_)->remove();
  if (written.ok() && kept_ && !durable_) kept_->remove();
  keep_at_end();
  run_.save_us = MonotonicClock::now_us() - start_us;
  return written;
}

Outcome<std::uint64_t> Node::local_digest() {
  if (archive_) return digest_of_whole(robot_->map(), **archive_);
  if (kept_) {
    TESSERA_TRY(keep_ended());
    return kept_->digest_with(current_submap(), submap_frames());
  }
  std::vector<KeyedIndex> workspace = workspace_for(robot_->map());
  return digest(robot_->map(), workspace);
}

/// Writes each of them even if others fail; fails as the first that does.
Outcome<void> Node::write_what_is_named() {
  const LocalMap& global = robot_->global().map();
  std::vector<KeyedIndex> workspace = workspace_for(global);
  Outcome<void> outcome;
  const auto note = [&outcome](const auto& done) {
    if (outcome.ok() && !done.ok()) outcome = done.failure();
  };
  // What saving has counted is not counted again.
  const auto digest_noted = [&note](const Outcome<MapSummary>& done) {
    note(done);
    return done.ok() ? std::optional(done->digest) : std::nullopt;
  };
  std::optional<std::uint64_t> saved;
  if (!config_.global_map.empty())
    saved = digest_noted(
        save_map(global, identity_of(MapKind::kGlobal), workspace, config_.global_map));
  global_digest_ = saved ? *saved : digest(global, workspace);
  saved.reset();
  if (!config_.local_map.empty()) saved = digest_noted(save_paused_map(config_.local_map));
  const Outcome<std::uint64_t> local = saved ? Outcome<std::uint64_t>(*saved) : local_digest();
  if (local.ok()) local_digest_ = *local;
  note(local);
  if (config_.contribution.empty()) return outcome;
  const Outcome<std::unique_ptr<PublishedMap>> published = published_map(*robot_);
  if (!published.ok()) {
    note(published);
    return outcome;
  }
  std::vector<KeyedIndex> published_workspace = workspace_for((*published)->map);
  note(save_map((*published)->map, identity_of(MapKind::kLocal), published_workspace,
                config_.contribution));
  return outcome;
}

}  // namespace tessera
