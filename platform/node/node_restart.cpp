// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a node takes over from the start before, and keeps for the next one.
#include <algorithm>

#include "base/allocation_counter.hpp"
#include "base/boot_id.hpp"
#include "base/monotonic_clock.hpp"
#include "node/node.hpp"

namespace tessera {

namespace {

constexpr double kMicrosecondsPerSecond = 1e6;

}  // namespace

MapName Node::map_name() const { return {config_.state, config_.robot, state_->map_epoch()}; }

/// Before the start is counted, as its epochs follow from it. A map that cannot be continued stays
/// where it is.
Outcome<void> Node::find_earlier_map() {
  if (!config_.continues() || state_->map_epoch() == 0) return {};
  TESSERA_TRY_ASSIGN(std::optional<FoundMap> found, find_map(map_name()));
  if (!found) return {};
  restart_notes_ = found->notes;
  RobotConfig& robot = setup_.robot;
  const bool in_submaps = robot.most_submaps != 0;
  const std::uint64_t count = std::uint64_t{found->last()} + 1 - found->state.first;
  const bool fits = count <= std::max(robot.most_submaps, 1U);
  if (!fits || !can_continue(*found, robot.map, classes(), in_submaps)) {
    const std::string path =
        found->journals.empty() ? found->name.frames() : found->name.journal(found->last());
    restart_notes_.push_back(
        "the map of the start before has other settings or too many submaps, so this one begins "
        "with an empty map; it stays in " +
        path);
    run_.kept_maps.push_back(path);
    return {};
  }
  robot.first_submap = found->first();
  robot.submaps_before = in_submaps ? robot.first_submap - found->state.first : 0;
  found_ = std::move(found);
  return {};
}

/// After the start is counted.
void Node::set_earlier_files_aside() {
  if (found_) return;
  const std::vector<std::string> lines = set_aside(map_name());
  restart_notes_.insert(restart_notes_.end(), lines.begin(), lines.end());
}

/// The file of the local map holds nothing that this start does not have: it was written by an
/// earlier start of the map that is continued.
bool Node::is_continued(const std::string& path) const {
  if (!found_) return false;
  const Outcome<MapFileHeader> header = load_map_header(path);
  return header.ok() && header->identity.robot == config_.robot &&
         header->identity.epoch >= state_->map_epoch();
}

/// After the submaps are kept: one that has ended is written to its file first.
Outcome<void> Node::open_durable_map() {
  if (!config_.continues()) return {};
  MapIdentity identity = identity_of(MapKind::kLocal);
  identity.epoch = state_->map_epoch();
  if (!found_) {
    TESSERA_TRY_ASSIGN(durable_, DurableMap::begin(map_name(), *robot_, identity));
    return {};
  }
  const bool is_wall = config_.sensors.clock == SensorClock::kWall;
  const bool same_clock = is_wall || (boot_id() != 0 && found_->state.boot == boot_id());
  if (!found_->state.kept.empty())
    earlier_ = std::make_unique<EarlierSubmaps>(map_name().stem(), found_->state.kept);
  TESSERA_TRY_ASSIGN(durable_, DurableMap::resume(*found_, *robot_, identity, same_clock));
  restart_notes_ = found_->notes;
  found_.reset();
  if (sensing_ && durable_->resumed())
    sensing_->continue_from(durable_->resumed()->T_map_body, durable_->resumed()->stamp_us);
  return {};
}

/// Reading a file takes memory for its map, until it is published.
void Node::look_for_earlier_submaps(std::int64_t now_us) {
  if (!earlier_) return;
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  if (const Outcome<void> looked = earlier_->look(); !looked.ok()) {
    durable_failure_ =
        "an earlier submap is not published again: " + looked.failure().text(Speaker::kFile);
    log_.say_change(LogLevel::kError, now_us, durable_failure_.c_str());
  }
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

/// The same for maps of earlier days. Its text must stay until it is written: one a turn.
void Node::look_for_sessions(std::int64_t now_us) {
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  SessionLoader::News news = sessions_.look(setup_.robot.map, classes());
  if (!news.text.empty()) {
    session_text_ = std::move(news.text);
    log_.say_change(news.is_error ? LogLevel::kError : LogLevel::kInfo, now_us,
                    session_text_.c_str());
  }
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

void Node::say_restart(LogWriter& writer, std::span<LogQueue* const> queues) {
  for (const std::string& note : restart_notes_) {
    log_.say_change(LogLevel::kWarning, run_.start_us, note.c_str());
    writer.write(queues);
  }
  run_.restart_notes = restart_notes_.size();
  if (!durable_ || durable_->resumed_blocks() == 0) return;
  log_.say_change(LogLevel::kInfo, run_.start_us, "continues the map of epoch %: % blocks",
                  state_->map_epoch(), static_cast<std::int64_t>(durable_->resumed_blocks()));
  if (durable_->left_out_blocks() != 0)
    log_.say_change(LogLevel::kWarning, run_.start_us,
                    "% blocks of the kept map are of no map and are left out",
                    static_cast<std::int64_t>(durable_->left_out_blocks()));
  if (durable_->damaged_bytes() != 0)
    log_.say_change(LogLevel::kWarning, run_.start_us,
                    "% bytes of the kept map were damaged and are left out",
                    static_cast<std::int64_t>(durable_->damaged_bytes()));
  if (durable_->torn_bytes() != 0)
    log_.say_change(LogLevel::kInfo, run_.start_us,
                    "the last append to the kept map was not finished: % bytes are left out",
                    static_cast<std::int64_t>(durable_->torn_bytes()));
}

/// Twice in the time that may be lost, as it takes some time itself; and at once where a submap has
/// begun or the map was cleared.
void Node::keep_durable(std::int64_t now_us) {
  if (!durable_) return;
  MappingThreadState mapping;
  if (!mapping_->state().get(mapping)) return;
  // What failed is not tried again at once.
  const bool is_urgent = durable_->is_behind(mapping) && !durable_failed_;
  if (now_us < durable_due_us_ && !is_urgent) return;
  durable_due_us_ =
      now_us + static_cast<std::int64_t>(kMicrosecondsPerSecond * config_.state_loss_s / 2.0);
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  const auto frames = std::make_unique<SubmapFramesState>();
  // Before the first tick there are none.
  const bool has_frames = sharing_->frames().get(*frames) && frames->count != 0;
  note_durable(durable_->keep(mapping, has_frames ? frames.get() : nullptr, kept_.get(), now_us),
               now_us);
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

/// now_us: when it began. What was mapped right after the time before began is durable only now.
void Node::note_durable(const Outcome<void>& kept, std::int64_t now_us) {
  if (durable_us_ != 0)
    run_.most_lost_us = std::max(run_.most_lost_us, MonotonicClock::now_us() - durable_us_);
  durable_failed_ = !kept.ok();
  if (kept.ok()) {
    if (durable_->is_whole()) durable_us_ = now_us;
    return;
  }
  ++run_.failed_states;
  durable_failure_ =
      "the map is not durable, see [robot] state: " + kept.failure().text(Speaker::kFile);
  log_.say(LogLevel::kError, now_us, durable_failure_.c_str());
}

/// No other thread runs any more: all of it.
void Node::keep_at_end() {
  if (!durable_) return;
  const auto all = std::make_unique<SubmapFramesState>();
  all->take((*robot_).sharer().frames());
  note_durable(durable_->keep(run_.mapping, all.get(), kept_.get(), DurableMap::kAtEnd),
               MonotonicClock::now_us());
}

}  // namespace tessera
