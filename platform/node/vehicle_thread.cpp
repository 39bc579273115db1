// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/vehicle_thread.hpp"

#include <algorithm>

#include "base/monotonic_clock.hpp"
#include "tessera/base/arena.hpp"
#include "tessera/base/version.hpp"

namespace tessera {

Outcome<std::unique_ptr<VehicleThread>> VehicleThread::make(
    const VehicleThreadConfig& config, const LocalMaps& maps, VehiclePort& port,
    MappingThread& mapping, const SharingThread& sharing, SensingThread* sensing,
    const SaveRequests& saves) {
  std::unique_ptr<VehicleThread> made(
      new VehicleThread(config, maps, port, mapping, sharing, sensing, saves));
  TESSERA_TRY_ASSIGN(ArenaMemory memory,
                     ArenaMemory::allocate(ObstacleSectors::required_bytes(maps.map())));
  made->memory_ = std::move(memory);
  Arena arena(made->memory_.span());
  Result<ObstacleSectors> sectors = ObstacleSectors::make(config.sectors, maps.map(), arena);
  if (!sectors.ok()) {
    return Failure{std::string("the obstacle sectors cannot be set up: ") +
                   to_string(sectors.status()) + "; see [vehicle] sector_range_m and related keys"};
  }
  made->sectors_ = std::move(*sectors);
  return made;
}

Outcome<void> VehicleThread::start(const ThreadRole& role) {
  start_us_ = MonotonicClock::now_us();
  return thread_.start(
      role, [](void* self) { static_cast<VehicleThread*>(self)->run(); }, this);
}

void VehicleThread::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  wake_.wake();
  thread_.join();
}

void VehicleThread::run() noexcept {
  std::int64_t due_us = MonotonicClock::now_us();
  while (!stopping_.load(std::memory_order_acquire)) {
    const std::int64_t now_us = MonotonicClock::now_us();
    if (now_us - due_us >= kPeriod_us) {
      ++counted_.late;
      due_us = now_us;
    }
    heartbeat_.beat(now_us);
    turn(now_us);
    due_us += kPeriod_us;
    wake_.sleep_until(due_us);
  }
  told_.state = MappingState::kStopping;
  port_.report(told_);
  heartbeat_.rest();
}

void VehicleThread::turn(std::int64_t now_us) noexcept {
  take_commands(now_us);
  watch_bus(now_us);
  sweep();
  tell_state(now_us);
  ++counted_.reports;
  port_.report(told_);
  report_.set(counted_);
}

void VehicleThread::take_commands(std::int64_t now_us) noexcept {
  while (const TakenCommand* const command = port_.commands().front()) {
    carry_out(*command, now_us);
    port_.commands().pop();
  }
  note_pending();
}

void VehicleThread::carry_out(const TakenCommand& command, std::int64_t now_us) noexcept {
  ++counted_.commands;
  told_.command_number = command.number;
  told_.command_result = CommandResult::kDone;
  log_.say_change(LogLevel::kInfo, now_us, "command % of the vehicle",
                  static_cast<std::int64_t>(command.command));
  switch (command.command) {
    case VehicleCommand::kStart:
      mapping_.pause(kPausedByCommand, false);
      mapping_.pause(kPausedByNewFrame, false);
      return;
    case VehicleCommand::kPause:
      mapping_.pause(kPausedByCommand, true);
      return;
    case VehicleCommand::kClear:
    case VehicleCommand::kSave:
      return begin(command);
    case VehicleCommand::kNone:
      break;
  }
  told_.command_result = CommandResult::kDenied;
}

void VehicleThread::begin(const TakenCommand& command) noexcept {
  told_.command_result = CommandResult::kAccepted;
  pending_ = {.command = command.command, .number = command.number};
  if (command.command == VehicleCommand::kClear) {
    MappingThreadState mapping;
    static_cast<void>(mapping_.state().get(mapping));
    pending_.done = mapping.clears;
    mapping_.clear_map();
    mapping_.pause(kPausedByNewFrame, false);
    return;
  }
  pending_.done = saves_.done.load(std::memory_order_relaxed);
  pending_.failed = saves_.failed.load(std::memory_order_relaxed);
  saves_.asked.store(true, std::memory_order_relaxed);
}

void VehicleThread::watch_bus(std::int64_t now_us) noexcept {
  VehiclePortState port;
  if (!port_.status(port) || port.bus.bus == bus_) return;
  bus_ = port.bus.bus;
  const bool well = bus_ == BusState::kActive;
  log_.say_change(well ? LogLevel::kInfo : LogLevel::kWarning, now_us,
                  well                         ? "the bus is active again"
                  : bus_ == BusState::kPassive ? "the bus is error passive"
                  : bus_ == BusState::kOff     ? "the bus is off; its driver must restart it"
                                               : "the bus is down: its interface is down or gone");
}

/// Reports the result only while no other command arrived.
void VehicleThread::note_pending() noexcept {
  if (pending_.command == VehicleCommand::kNone) return;
  std::uint64_t done = saves_.done.load(std::memory_order_relaxed);
  std::uint64_t failed = saves_.failed.load(std::memory_order_relaxed);
  if (pending_.command == VehicleCommand::kClear) {
    MappingThreadState mapping;
    if (!mapping_.state().get(mapping)) return;
    done = mapping.clears;
    failed = pending_.failed;
  }
  if (done == pending_.done && failed == pending_.failed) return;
  if (told_.command_number == pending_.number)
    told_.command_result =
        failed != pending_.failed ? CommandResult::kDenied : CommandResult::kDone;
  pending_ = {};
}

/// The last known pose: of the sensors, or of the last scan.
bool VehicleThread::find_pose(Matrix34d& T_map_body, std::int64_t& stamp_us) const noexcept {
  if (sensing_ != nullptr) {
    SensingThreadState sensing;
    if (!sensing_->state().get(sensing) || sensing.poses == 0) return false;
    std::copy(sensing.T_map_body.begin(), sensing.T_map_body.end(), T_map_body.data());
    stamp_us = sensing.stamp_us;
    return true;
  }
  MappingThreadState mapping;
  if (!mapping_.state().get(mapping) || mapping.cycles == 0) return false;
  std::copy(mapping.T_map_sensor.begin(), mapping.T_map_sensor.end(), T_map_body.data());
  stamp_us = mapping.end_us;
  return true;
}

void VehicleThread::sweep() noexcept {
  Matrix34d T_map_body;
  std::int64_t stamp_us = 0;
  if (!sectors_.is_sweeping() && !mapping_.paused() && find_pose(T_map_body, stamp_us))
    static_cast<void>(sectors_.begin(T_map_body, stamp_us) == Status::kOk);
  if (sectors_.is_sweeping() && sectors_.step(reader_, kBlocksPerTurn)) {
    ++counted_.sweeps;
    tell_sectors();
  }
}

void VehicleThread::tell_sectors() noexcept {
  const ObstacleSummary& summary = sectors_.latest();
  told_.sectors.count = summary.count;
  told_.sectors.pose_stamp_us = summary.stamp_us;
  told_.sectors.max_range_m = static_cast<float>(config_.sectors.max_range_m);
  told_.sectors.min_height_m = static_cast<float>(config_.sectors.min_height_m);
  told_.sectors.max_height_m = static_cast<float>(config_.sectors.max_height_m);
  for (std::size_t i = 0; i < static_cast<std::size_t>(summary.count); ++i) {
    const ObstacleSector& from = summary.sectors[i];
    told_.sectors.sectors[i] = {.available = from.available,
                                .occupied = from.occupied,
                                .label = static_cast<std::uint8_t>(from.label),
                                .distance_m = static_cast<float>(from.distance_m),
                                .occupancy = static_cast<float>(from.occupancy),
                                .free_up_to_m = static_cast<float>(from.free_up_to_m)};
  }
  TeammatesState teammates;
  if (sharing_.teammates().get(teammates))
    teammates.add_to(told_.sectors, summary.T_map_body, config_.sectors, MonotonicClock::now_us());
}

void VehicleThread::tell_state(std::int64_t now_us) noexcept {
  told_.made_us = now_us;
  told_.version = {static_cast<std::uint8_t>(kVersionMajor),
                   static_cast<std::uint8_t>(kVersionMinor),
                   static_cast<std::uint8_t>(kVersionPatch)};
  told_.robot_id = static_cast<std::uint16_t>(config_.robot);
  told_.started_us = start_us_;
  told_.period_us = config_.period_us;
  MappingThreadState mapping;
  if (mapping_.state().get(mapping)) tell_mapping(mapping, now_us);
  SharingThreadState sharing;
  if (!sharing_.state().get(sharing)) return;
  tell_team(sharing);
  tell_alarm(sharing, now_us);
}

void VehicleThread::tell_mapping(const MappingThreadState& mapping, std::int64_t now_us) noexcept {
  const std::int64_t silent_us = now_us - std::max(mapping.end_us, start_us_);
  const bool is_silent = silent_us > kSilentPeriods * config_.period_us;
  told_.pause_reason = PauseReason::kNone;
  told_.state = mapping.cycles == 0 ? MappingState::kStarting : MappingState::kMapping;
  if (mapping.pause != 0) {
    told_.state = MappingState::kPaused;
    told_.pause_reason = (mapping.pause & kPausedByNewFrame) != 0 ? PauseReason::kJumpingPose
                         : (mapping.pause & kPausedByPose) != 0   ? pose_reason()
                                                                  : PauseReason::kCommand;
  } else if (is_silent && mapping.cycles > 0) {
    told_.state = MappingState::kPaused;
    told_.pause_reason = PauseReason::kNoSensor;
  }
  if (hangs_one(now_us)) told_.state = MappingState::kFault;
  if (told_.state == MappingState::kMapping) told_.pause_reason = shortage(mapping, now_us);
  if (is_stopping_.load(std::memory_order_relaxed)) told_.state = MappingState::kStopping;
  // Without new scans obstacles are outdated, however fresh the pose.
  told_.sectors.state = counted_.sweeps == 0                    ? SectorsState::kNone
                        : told_.state == MappingState::kMapping ? SectorsState::kCurrent
                                                                : SectorsState::kHeld;
  const auto used = static_cast<double>(mapping.usage.used_bytes);
  told_.memory_share = std::min(1.0, used / static_cast<double>(storage_bytes_));
  told_.blocks = mapping.usage.blocks;
  told_.refused_points = mapping.scans.left_out;
  told_.overruns = mapping.missed;
  if (mapping.cycles != cycles_seen_) {
    cycles_.add(mapping.last_cycle_us);
    cycles_seen_ = mapping.cycles;
  }
  told_.cycle_p99_us = cycles_.quantile_us(0.99);
  told_.cycle_worst_us = mapping.worst_cycle_us;
}

/// What did not fit recently, although mapping runs.
PauseReason VehicleThread::shortage(const MappingThreadState& mapping,
                                    std::int64_t now_us) noexcept {
  const std::uint64_t refused = mapping.usage.storage_refused + mapping.usage.blocks_refused;
  if (refused != refused_seen_) refused_us_ = now_us;
  if (mapping.missed != missed_seen_) missed_us_ = now_us;
  refused_seen_ = refused;
  missed_seen_ = mapping.missed;
  const auto is_recent = [now_us](std::int64_t us) { return us != 0 && now_us - us < kTold_us; };
  if (is_recent(refused_us_)) return PauseReason::kMemoryFull;
  return is_recent(missed_us_) ? PauseReason::kOverload : PauseReason::kNone;
}

/// Why no pose is usable.
PauseReason VehicleThread::pose_reason() const noexcept {
  SensingThreadState sensing;
  if (sensing_ == nullptr || !sensing_->state().get(sensing)) return PauseReason::kNoPose;
  switch (sensing.verdict) {
    case PoseVerdict::kStale:
      return PauseReason::kStalePose;
    case PoseVerdict::kFrozen:
      return PauseReason::kFrozenPose;
    case PoseVerdict::kJumping:
      return PauseReason::kJumpingPose;
    case PoseVerdict::kCorrupt:
      return PauseReason::kCorruptPose;
    case PoseVerdict::kUncertain:
      return PauseReason::kUncertainPose;
    case PoseVerdict::kRecovering:
      return PauseReason::kRecoveringPose;
    case PoseVerdict::kGood:
    case PoseVerdict::kNone:
    case PoseVerdict::kOutOfOrder:
      break;
  }
  return PauseReason::kNoPose;
}

void VehicleThread::tell_team(const SharingThreadState& sharing) noexcept {
  const ExchangeReport& exchange = sharing.exchange;
  told_.peers = sharing.in_reach;
  told_.contributions_known = exchange.contributions;
  told_.contributions_whole = exchange.complete;
  const bool whole = exchange.holds_all();
  told_.peers_agreeing = whole ? std::min(sharing.agreeing, sharing.in_reach) : 0;
  told_.convergence = sharing.in_reach == 0                      ? Convergence::kAlone
                      : told_.peers_agreeing == sharing.in_reach ? Convergence::kAgree
                                                                 : Convergence::kDiffer;
}

}  // namespace tessera
