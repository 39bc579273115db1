// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/vehicle_outputs.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <vector>

namespace tessera {
namespace {

using namespace bus;

VehicleReport sample_report(int sectors = 16) {
  VehicleReport report;
  report.state = MappingState::kPaused;
  report.pause_reason = PauseReason::kFrozenPose;
  report.command_result = CommandResult::kDone;
  report.command_number = 42;
  report.started_us = 500'000;
  report.made_us = 1'000'000'000'000;
  report.memory_share = 0.4321;
  report.blocks = 123'456;
  report.refused_points = 1ULL << 40U;
  report.overruns = 3;
  report.cycle_p99_us = 41'230;
  report.cycle_worst_us = 900'000;
  report.period_us = 100'000;
  report.peers = 3;
  report.peers_agreeing = 2;
  report.contributions_known = 5;
  report.contributions_whole = 4;
  report.convergence = Convergence::kDiffer;
  report.robot_id = 513;
  report.version = {1, 2, 3};
  report.sectors.count = sectors;
  report.sectors.state = SectorsState::kCurrent;
  report.sectors.pose_stamp_us = 1'000'000;
  report.sectors.max_range_m = 20.0F;
  report.sectors.min_height_m = -1.0F;
  report.sectors.max_height_m = 0.5F;
  for (std::size_t i = 0; i < kMostSectors; ++i) {
    SectorReport& sector = report.sectors.sectors[i];
    sector.available = i != 3;
    sector.occupied = i % 4 != 1;
    sector.label = static_cast<std::uint8_t>(1 + i);
    sector.distance_m = 1.07F + static_cast<float>(i);
    sector.occupancy = 0.95F;
    sector.free_up_to_m = 0.9F * static_cast<float>(i);
  }
  return report;
}

/// All frames in a time, by identifier, from calls every millisecond.
std::map<std::uint32_t, std::vector<CanFrame>> run(VehicleOutputs& outputs,
                                                   const VehicleReport& report, int milliseconds,
                                                   std::size_t room = 3) {
  std::map<std::uint32_t, std::vector<CanFrame>> frames;
  std::vector<CanFrame> into(room);
  for (int i = 0; i < milliseconds; ++i) {
    const std::int64_t now_us = 1'000'000 + 1'000 * i;
    const std::size_t count = outputs.due(report, {}, now_us, into);
    for (std::size_t k = 0; k < count; ++k) frames[into[k].id - 0x100].push_back(into[k]);
  }
  return frames;
}

TEST_CASE("VehicleOutputs: each message comes at its cycle, of the sectors those that are meant") {
  for (const bool fd : {false, true}) {
    for (const int sectors : {16, 32}) {
      VehicleOutputs outputs({.can_fd = fd});
      const auto frames = run(outputs, sample_report(sectors), 2000);
      for (const BusMessage& message : kBusMessages) {
        if (message.from_vehicle) continue;
        INFO(message.name << " " << message.place);
        const bool is_sectors = message.first_sector >= 0;
        const bool used = !is_sectors || (message.is_fd == fd && message.first_sector < sectors);
        const auto found = frames.find(message.place);
        REQUIRE((found != frames.end()) == used);
        if (!used) continue;
        CHECK(static_cast<int>(found->second.size()) == 2000 / message.cycle_ms);
        CHECK(found->second[0].size == message.size);
        CHECK(found->second[0].is_fd == message.is_fd);
      }
      CHECK(outputs.skipped() == 0);
    }
  }
}

TEST_CASE("VehicleOutputs: every protected frame is taken for the next one by its receiver") {
  VehicleOutputs outputs({.can_fd = true});
  for (const auto& [place, frames] : run(outputs, sample_report(), 2000)) {
    const BusMessage& message = *bus_message(place);
    if (message.e2e == E2eProfile::kNone) continue;
    E2eChecker checker({message.e2e, e2e_data_id(0x100 + place), message.size, 1, 2});
    CHECK(checker.check(frames[0].bytes()) == E2eStatus::kInitial);
    for (std::size_t i = 1; i < frames.size(); ++i)
      REQUIRE(checker.check(frames[i].bytes()) == E2eStatus::kOk);
  }
}

TEST_CASE("VehicleOutputs: what the report says, the frames say") {
  VehicleOutputs outputs;
  const auto frames = run(outputs, sample_report(), 200);
  const auto get = [&](std::uint32_t place, const Signal& signal) {
    return value_of(frames.at(place)[0].bytes(), signal);
  };
  CHECK(get(kIdHeartbeat, kMappingState) == 2);
  CHECK(get(kIdHeartbeat, kPauseReason) == 4);
  CHECK(get(kIdHeartbeat, kPoseVerdict) == 1);
  CHECK(get(kIdHeartbeat, kCommandResult) == 2);
  CHECK(get(kIdHeartbeat, kLastCommand) == 42);
  CHECK(get(kIdHeartbeat, kUptime) == 0);
  CHECK(get(kIdMapFill, kMemoryUsed) == Approx(43.21));
  CHECK(get(kIdMapFill, kBlocks) == 123'456);
  CHECK(get(kIdMapFill, kRefusedPoints) == 16'777'215);
  CHECK(get(kIdTiming, kOverruns) == 3);
  CHECK(get(kIdTiming, kCycleP99) == Approx(41.23));
  CHECK(get(kIdTiming, kCycleWorst) == Approx(655.35));
  CHECK(get(kIdTeam, kPeers) == 3);
  CHECK(get(kIdTeam, kPeersAgreeing) == 2);
  CHECK(get(kIdTeam, kKnown) == 5);
  CHECK(get(kIdTeam, kWhole) == 4);
  CHECK(get(kIdTeam, kConvergence) == 3);
  CHECK(get(kIdInfo, kVersionMajor) == 1);
  CHECK(get(kIdInfo, kVersionPatch) == 3);
  CHECK(get(kIdInfo, kRobot) == 513);
  CHECK(get(kIdSectorInfo, kSectorCount) == 16);
  CHECK(get(kIdSectorInfo, kSectorsState) == 1);
  CHECK(get(kIdSectorInfo, kMaxRange) == 20);
  CHECK(get(kIdSectorInfo, kMinHeight) == Approx(-1.0));
  CHECK(get(kIdSectorInfo, kMaxHeight) == Approx(0.5));
  CHECK(value_of(frames.at(kIdSectorInfo)[1].bytes(), kSectorsAge) == 50);
}

TEST_CASE("VehicleOutputs: distances are rounded down, unknown and nothing found have codes") {
  for (const bool fd : {false, true}) {
    VehicleOutputs outputs({.can_fd = fd});
    const auto frames = run(outputs, sample_report(32), 100);
    for (const auto& [place, of_place] : frames) {
      const BusMessage& message = *bus_message(place);
      if (message.first_sector < 0) continue;
      for (std::size_t i = 3; i < message.signals.size(); i += 4) {
        const auto data = of_place[0].bytes();
        const int sector = message.signals[i].sector;
        INFO("sector " << sector);
        const std::uint32_t raw = raw_of(data, message.signals[i]);
        const double free = value_of(data, message.signals[i + 1]);
        if (sector == 3) {
          CHECK(raw == kNotAvailable);
          CHECK(free == 0);
          continue;
        }
        CHECK(free == std::floor(0.9 * sector));
        CHECK(raw == (sector % 4 == 1 ? kNothingFound : static_cast<unsigned>(10 + 10 * sector)));
        if (sector % 4 == 1) continue;
        CHECK(value_of(data, message.signals[i + 2]) == 1 + sector);
        CHECK(value_of(data, message.signals[i + 3]) == Approx(0.92));
      }
    }
  }
}

TEST_CASE("VehicleOutputs: without sectors all are not available, and their age cannot be said") {
  VehicleReport report = sample_report();
  report.sectors.state = SectorsState::kNone;
  VehicleOutputs outputs;
  const auto frames = run(outputs, report, 100);
  CHECK(raw_of(frames.at(kIdSectorInfo)[0].bytes(), kSectorsAge) == kOlderThanCanBeSaid);
  CHECK(raw_of(frames.at(kIdSectors)[0].bytes(), kSectorsSignals[0][3]) == kNotAvailable);
  report = sample_report();
  report.sectors.pose_stamp_us = -10'000'000;
  VehicleOutputs late;
  CHECK(raw_of(run(late, report, 1).at(kIdSectorInfo)[0].bytes(), kSectorsAge) ==
        kOlderThanCanBeSaid);
}

TEST_CASE("VehicleOutputs: the sectors of a summary are of one report, though calls lie between") {
  VehicleOutputs outputs;
  VehicleReport report = sample_report();
  std::array<CanFrame, 1> into;
  std::map<unsigned, std::set<unsigned>> labels;  // By summary counter.
  for (int i = 0; i < 400; ++i) {
    // Every report is another one.
    for (SectorReport& sector : report.sectors.sectors) {
      sector = {.available = true, .occupied = true, .label = static_cast<std::uint8_t>(i % 60)};
    }
    if (outputs.due(report, {}, 1'000'000 + 1'000 * i, into) == 0) continue;
    const BusMessage& message = *bus_message(into[0].id - 0x100);
    if (message.first_sector < 0) continue;
    labels[raw_of(into[0].bytes(), kSummaryCounter)].insert(
        raw_of(into[0].bytes(), message.signals[5]));
  }
  CHECK(labels.size() == 8);
  for (const auto& [counter, of_summary] : labels) CHECK(of_summary.size() == 1);
}

TEST_CASE("VehicleOutputs: with too little room the least important waits, nothing is sent twice") {
  VehicleOutputs outputs;
  // One frame in 20 ms is less than is due.
  std::map<std::uint32_t, int> counts;
  std::array<CanFrame, 1> into;
  for (int i = 0; i < 100; ++i) {
    REQUIRE(outputs.due(sample_report(), {}, 1'000'000 + 20'000 * i, into) <= 1);
    ++counts[into[0].id - 0x100];
  }
  CHECK(counts[kIdHeartbeat] == 20);
  CHECK(counts[kIdInfo] == 0);
  CHECK(outputs.skipped() > 0);
}

TEST_CASE("VehicleOutputs: before the first report it starts, for as long as a report is trusted") {
  VehicleOutputs outputs;
  constexpr std::int64_t kBooted_us = 90'000'000;
  std::array<CanFrame, 64> into;
  const auto heartbeat_at = [&](std::int64_t now_us) {
    const std::size_t count = outputs.due({}, {}, now_us, into);
    const auto found = std::find_if(into.begin(), into.begin() + static_cast<std::ptrdiff_t>(count),
                                    [](const CanFrame& f) { return f.id - 0x100 == kIdHeartbeat; });
    REQUIRE(found != into.begin() + static_cast<std::ptrdiff_t>(count));
    return raw_of(found->bytes(), kMappingState);
  };
  CHECK(heartbeat_at(kBooted_us) == static_cast<std::uint64_t>(MappingState::kStarting));
  CHECK(heartbeat_at(kBooted_us + 10'000'000) == static_cast<std::uint64_t>(MappingState::kFault));
}

TEST_CASE("VehicleOutputs: a pause is caught up by one frame of each, not by many") {
  VehicleOutputs outputs;
  std::array<CanFrame, 64> into;
  const std::size_t all = outputs.due(sample_report(), {}, 1'000'000, into);
  CHECK(all == 2 + 8);
  CHECK(outputs.next_due_us() == 1'020'000);
  CHECK(outputs.due(sample_report(), {}, 1'010'000, into) == 0);
  CHECK(outputs.due(sample_report(), {}, 61'000'000, into) == all + 4);
  CHECK(outputs.due(sample_report(), {}, 61'000'001, into) == 0);
}

TEST_CASE(
    "VehicleOutputs: a report that is no longer renewed is a fault, and its sectors are held") {
  VehicleReport report = sample_report();
  report.made_us = 1'000'000;
  VehicleOutputs outputs;
  const auto frames = run(outputs, report, 700);
  for (std::size_t i = 0; i < 7; ++i) {
    INFO("heartbeat " << i);
    const auto data = frames.at(kIdHeartbeat)[i].bytes();
    CHECK(raw_of(data, kMappingState) == (i <= 5 ? 2 : 4));
    CHECK(raw_of(data, kPauseReason) == (i <= 5 ? 4 : 12));
    CHECK(raw_of(frames.at(kIdSectorInfo)[2 * i].bytes(), kSectorsState) == (i <= 5 ? 1 : 2));
  }
}

TEST_CASE("VehicleOutputs: another base gives other identifiers and checksums") {
  VehicleOutputs outputs({.base_id = 0x7e0});
  std::array<CanFrame, 1> into;
  REQUIRE(outputs.due(sample_report(), {}, 0, into) == 1);
  CHECK(into[0].id == 0x7e8);
  E2eChecker ours({E2eProfile::kProfile1, e2e_data_id(0x7e8), 8});
  E2eChecker others({E2eProfile::kProfile1, e2e_data_id(0x108), 8});
  CHECK(ours.check(into[0].bytes()) == E2eStatus::kInitial);
  CHECK(others.check(into[0].bytes()) == E2eStatus::kWrongCrc);
}

}  // namespace
}  // namespace tessera
