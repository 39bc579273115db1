// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The report to the vehicle, of one moment. Plain values, so that threads can pass it as bytes.
#pragma once

#include <array>
#include <cstdint>

#include "vehicle/bus_messages.hpp"
#include "vehicle/bus_values.hpp"

namespace tessera {

/// One sector of the obstacle summary. Numbers as ObstacleSectors gives them.
struct SectorReport {
  bool available = false;  ///< False: this sector has no values.
  bool occupied = false;   ///< Something occupied was found within the range.
  std::uint8_t label = 0;  ///< Its class; 0 without one.
  float distance_m = 0.0F;
  float occupancy = 0.0F;     ///< Probability that it is occupied, 0 .. 1.
  float free_up_to_m = 0.0F;  ///< Known to be free up to this distance.
};

struct SectorsReport {
  std::array<SectorReport, kMostSectors> sectors{};
  std::int32_t count = 16;  ///< 16 or 32.
  SectorsState state = SectorsState::kNone;
  std::int64_t pose_stamp_us = 0;  ///< Of the pose from which they are seen; clock as now_us.
  float max_range_m = 0.0F;
  float min_height_m = 0.0F;  ///< Above the body's origin.
  float max_height_m = 0.0F;
};

struct VehicleReport {
  std::int64_t made_us = 0;  ///< Last time it was true; clock as now_us.
  MappingState state = MappingState::kStarting;
  PauseReason pause_reason = PauseReason::kNone;
  CommandResult command_result = CommandResult::kNone;
  std::uint8_t command_number = 0;  ///< Number of the command of the result.
  std::int64_t started_us = 0;      ///< Clock as now_us.
  double memory_share = 0.0;        ///< Of the map's storage, 0 .. 1.
  std::uint64_t blocks = 0;
  std::uint64_t refused_points = 0;
  std::uint64_t overruns = 0;  ///< Cycles that missed their deadline.
  std::int64_t cycle_p99_us = 0;
  std::int64_t cycle_worst_us = 0;
  std::int64_t period_us = 0;
  std::uint32_t peers = 0;           ///< In reach.
  std::uint32_t peers_agreeing = 0;  ///< All of them if everything announced is here; else 0.
  std::uint32_t contributions_known = 0;
  std::uint32_t contributions_whole = 0;
  Convergence convergence = Convergence::kUnknown;
  std::uint16_t robot_id = 0;
  std::array<std::uint8_t, 3> version{};  ///< Major, minor, patch.
  SectorsReport sectors{};
};

/// State that only the thread on the bus knows.
struct BusReport {
  PoseVerdict pose_verdict = PoseVerdict::kNone;
  PoseSource pose_source = PoseSource::kNone;
  BusState bus = BusState::kActive;
};

}  // namespace tessera
