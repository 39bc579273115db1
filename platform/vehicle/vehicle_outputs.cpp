// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/vehicle_outputs.hpp"

#include <algorithm>

namespace tessera {
namespace {

using Data = std::span<std::uint8_t>;

void put(Data data, const Signal& signal, std::uint64_t value) noexcept {
  put_raw(data, signal,
          static_cast<std::uint32_t>(std::min(value, static_cast<std::uint64_t>(signal.most))));
}

template <class Enum>
void put_name(Data data, const Signal& signal, Enum value) noexcept {
  put_raw(data, signal, static_cast<std::uint32_t>(value));
}

double milliseconds(std::int64_t us) noexcept { return static_cast<double>(us) * 1e-3; }

/// Rounds down, so that never more free space is reported than there is; a thousandth of a step
/// compensates the rounding of floats.
double not_more(const Signal& signal, double value) noexcept {
  const double steps = (value - signal.offset) / signal.scale;
  return std::floor(steps + 1e-3) * signal.scale + signal.offset;
}

void write_heartbeat(Data data, const VehicleReport& report, const BusReport& bus,
                     std::int64_t now_us, bool silent) noexcept {
  put_name(data, bus::kMappingState, silent ? MappingState::kFault : report.state);
  put_name(data, bus::kPauseReason, silent ? PauseReason::kSilent : report.pause_reason);
  put_name(data, bus::kPoseVerdict, bus.pose_verdict);
  put_name(data, bus::kPoseSource, bus.pose_source);
  put_name(data, bus::kBusState, bus.bus);
  put_name(data, bus::kCommandResult, report.command_result);
  put(data, bus::kLastCommand, report.command_number);
  const std::int64_t up_us = std::max<std::int64_t>(0, now_us - report.started_us);
  put(data, bus::kUptime, static_cast<std::uint64_t>(up_us) / 1'000'000);
}

void write_sector_info(Data data, const SectorsReport& sectors, std::int64_t now_us) noexcept {
  put(data, bus::kSectorCount, static_cast<std::uint64_t>(std::max(sectors.count, 0)));
  put_name(data, bus::kSectorsState, sectors.state);
  const double age_ms = milliseconds(now_us - sectors.pose_stamp_us);
  const bool can_say = sectors.state != SectorsState::kNone && age_ms <= bus::kSectorsAge.most;
  put_raw(data, bus::kSectorsAge, bus::kOlderThanCanBeSaid);
  if (can_say) put_value(data, bus::kSectorsAge, age_ms);
  const auto as_double = [](float value) { return static_cast<double>(value); };
  put_value(data, bus::kMaxRange, not_more(bus::kMaxRange, as_double(sectors.max_range_m)));
  put_value(data, bus::kMinHeight, as_double(sectors.min_height_m));
  put_value(data, bus::kMaxHeight, as_double(sectors.max_height_m));
}

/// The parts begin after the three signals that every frame of sectors has.
void write_sectors(Data data, const BusMessage& message, const SectorsReport& sectors) noexcept {
  for (std::size_t i = 3; i + 3 < message.signals.size(); i += 4) {
    const Signal& distance = message.signals[i];
    const Signal& free = message.signals[i + 1];
    const auto sector = static_cast<std::size_t>(distance.sector);
    const bool counts = distance.sector < sectors.count && sectors.state != SectorsState::kNone;
    const SectorReport& from = sectors.sectors[sector];
    if (!counts || !from.available) {
      put_raw(data, distance, bus::kNotAvailable);
      put_raw(data, free, 0);
      continue;
    }
    put_value(data, free, not_more(free, static_cast<double>(from.free_up_to_m)));
    if (!from.occupied) {
      put_raw(data, distance, bus::kNothingFound);
      continue;
    }
    put_value(data, distance, not_more(distance, static_cast<double>(from.distance_m)));
    put(data, message.signals[i + 2], from.label);
    const Signal& confidence = message.signals[i + 3];
    put_value(data, confidence, not_more(confidence, static_cast<double>(from.occupancy)));
  }
}

void write_informing(Data data, const BusMessage& message, const VehicleReport& report) noexcept {
  switch (message.place) {
    case bus::kIdMapFill:
      put_value(data, bus::kMemoryUsed, report.memory_share * 100.0);
      put(data, bus::kBlocks, report.blocks);
      return put(data, bus::kRefusedPoints, report.refused_points);
    case bus::kIdTiming:
      put(data, bus::kOverruns, report.overruns);
      put_value(data, bus::kCycleP99, milliseconds(report.cycle_p99_us));
      put_value(data, bus::kCycleWorst, milliseconds(report.cycle_worst_us));
      return put_value(data, bus::kPeriod, milliseconds(report.period_us));
    case bus::kIdTeam:
      put(data, bus::kPeers, report.peers);
      put(data, bus::kPeersAgreeing, report.peers_agreeing);
      put(data, bus::kKnown, report.contributions_known);
      put(data, bus::kWhole, report.contributions_whole);
      return put_name(data, bus::kConvergence, report.convergence);
    default:
      put(data, bus::kVersionMajor, report.version[0]);
      put(data, bus::kVersionMinor, report.version[1]);
      put(data, bus::kVersionPatch, report.version[2]);
      put(data, bus::kLayout, static_cast<std::uint64_t>(kBusLayoutVersion));
      put(data, bus::kRobot, report.robot_id);
  }
}

}  // namespace

VehicleOutputs::VehicleOutputs(const VehicleOutputsConfig& config) noexcept : config_(config) {
  if (!is_base_id(config_.base_id)) config_.base_id = kDefaultBaseId;
  for (const BusMessage& message : kBusMessages) {
    if (!message.from_vehicle) schedules_[message.place - bus::kIdHeartbeat].message = &message;
  }
}

bool VehicleOutputs::is_used(const BusMessage& message) const noexcept {
  if (message.use == BusUse::kFdSectors || message.use == BusUse::kClassicSectors) {
    return message.first_sector < sectors_.count &&
           config_.can_fd == (message.use == BusUse::kFdSectors);
  }
  return true;
}

/// Status messages start later, so that not all are due at the same time.
void VehicleOutputs::start(std::int64_t now_us) noexcept {
  started_ = true;
  start_us_ = now_us;
  for (Schedule& schedule : schedules_) {
    if (schedule.message == nullptr) continue;
    const std::uint32_t place = schedule.message->place;
    schedule.next_us = now_us;
    if (place >= bus::kIdMapFill) schedule.next_us += (place - bus::kIdMapFill + 1) * 20'000;
  }
}

void VehicleOutputs::begin_summary(const SectorsReport& sectors, bool silent) noexcept {
  sectors_ = sectors;
  if (silent && sectors.state == SectorsState::kCurrent) sectors_.state = SectorsState::kHeld;
  sectors_.count = sectors.count > 16 ? kMostSectors : 16;
  summary_ = static_cast<std::uint8_t>((summary_ + 1) % 16);
}

std::size_t VehicleOutputs::due(const VehicleReport& report, const BusReport& bus,
                                std::int64_t now_us, std::span<CanFrame> into) noexcept {
  if (!started_) start(now_us);
  std::size_t count = 0;
  for (Schedule& schedule : schedules_) {
    if (schedule.message == nullptr || now_us < schedule.next_us) continue;
    const std::int64_t cycle_us = std::int64_t{schedule.message->cycle_ms} * 1'000;
    const std::int64_t missed = (now_us - schedule.next_us) / cycle_us;
    schedule.next_us += missed * cycle_us;
    const bool uses = is_used(*schedule.message);
    if (uses) skipped_ += static_cast<std::uint64_t>(missed);
    if (uses && count == into.size()) continue;
    schedule.next_us += cycle_us;
    if (!uses) continue;
    if (schedule.message->place == bus::kIdSectorInfo)
      begin_summary(report.sectors, is_silent(report, now_us));
    write(schedule, report, bus, now_us, into[count++]);
  }
  return count;
}

void VehicleOutputs::write(Schedule& schedule, const VehicleReport& report, const BusReport& bus,
                           std::int64_t now_us, CanFrame& frame) noexcept {
  const BusMessage& message = *schedule.message;
  frame = {.id = config_.base_id + message.place, .size = message.size, .is_fd = message.is_fd};
  const Data data(frame.data.data(), message.size);
  if (message.place == bus::kIdHeartbeat) {
    write_heartbeat(data, report, bus, now_us, is_silent(report, now_us));
  } else if (message.place == bus::kIdSectorInfo) {
    put_raw(data, bus::kSummaryCounter, summary_);
    write_sector_info(data, sectors_, now_us);
  } else if (message.first_sector >= 0) {
    put_raw(data, message.is_fd ? bus::kFdSummaryCounter : bus::kSummaryCounter, summary_);
    write_sectors(data, message, sectors_);
  } else {
    write_informing(data, message, report);
  }
  e2e_protect(message.e2e, e2e_data_id(frame.id), schedule.counter, data);
  schedule.counter = e2e_next(message.e2e, schedule.counter);
}

std::int64_t VehicleOutputs::next_due_us() const noexcept {
  std::int64_t next = INT64_MAX;
  for (const Schedule& schedule : schedules_)
    if (schedule.message != nullptr) next = std::min(next, schedule.next_us);
  return next;
}

}  // namespace tessera
