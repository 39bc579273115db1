// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// can_member INTERFACE [--fd] [--sectors N] [--mode pose|bridging|odometry]: a port on a vehicle's
// bus with a report that stays the same. Says "ready", or why not. For each line on its input it
// writes one of JSON: what it has seen until now; "silent" ends its reports. Ends with its input.
#include <poll.h>

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/monotonic_clock.hpp"
#include "vehicle/vehicle_port.hpp"

namespace tessera {
namespace {

using nlohmann::json;

/// What came out of the port's queues.
struct Seen {
  std::uint64_t usable = 0;
  std::uint64_t bridged = 0;
  std::uint64_t unusable = 0;
  /// How far poses that were used are from one that drives along x at 1 m/s through the first one.
  double off_track_m = 0.0;
  double first_x_m = 0.0;
  std::int64_t first_stamp_us = 0;
  std::int64_t last_pose_stamp_us = 0;  ///< Bridging may be ahead of the next pose by its age.
  std::int64_t oldest_us = 0;           ///< When it came, of those that were used.
  std::uint64_t backwards = 0;
  std::uint64_t relocations = 0;
  json commands = json::array();
};

void look_at(Seen& seen, const JudgedPose& pose) {
  if (!pose.usable) {
    ++seen.unusable;
    return;
  }
  const StampedPose& stamped = pose.observation.pose;
  const double x_m = stamped.T_map_body(0, 3);
  if (seen.usable == 0 || pose.relocations != seen.relocations) {
    seen.first_x_m = x_m;
    seen.first_stamp_us = stamped.stamp_us;
  }
  const double driven_m = 1e-6 * static_cast<double>(stamped.stamp_us - seen.first_stamp_us);
  seen.off_track_m = std::max(seen.off_track_m, std::abs(x_m - seen.first_x_m - driven_m));
  ++seen.usable;
  if (pose.source == PoseSource::kOdometry) {
    ++seen.bridged;
  } else {
    if (stamped.stamp_us <= seen.last_pose_stamp_us) ++seen.backwards;
    seen.last_pose_stamp_us = stamped.stamp_us;
  }
  seen.relocations = pose.relocations;
  seen.oldest_us = std::max(seen.oldest_us, pose.observation.received_us - stamped.stamp_us);
}

void drain(VehiclePort& port, Seen& seen) {
  while (const JudgedPose* const pose = port.poses().front()) {
    look_at(seen, *pose);
    port.poses().pop();
  }
  while (const TakenCommand* const command = port.commands().front()) {
    seen.commands.push_back({static_cast<int>(command->command), command->number});
    port.commands().pop();
  }
}

VehicleReport report_of(int sectors) {
  VehicleReport report;
  report.state = MappingState::kMapping;
  report.started_us = MonotonicClock::now_us();
  report.memory_share = 0.25;
  report.blocks = 1234;
  report.overruns = 7;
  report.cycle_p99_us = 41'000;
  report.peers = 2;
  report.convergence = Convergence::kAgree;
  report.robot_id = 3;
  report.sectors.count = sectors;
  report.sectors.state = SectorsState::kCurrent;
  report.sectors.max_range_m = 20.0F;
  report.sectors.pose_stamp_us = report.started_us;
  for (std::size_t i = 0; i < kMostSectors; ++i) {
    const auto number = static_cast<float>(i);
    report.sectors.sectors[i] = {.available = true,
                                 .occupied = i % 3 != 0,
                                 .label = static_cast<std::uint8_t>(i + 1),
                                 .distance_m = 2.0F + 0.5F * number,
                                 .occupancy = 0.9F,
                                 .free_up_to_m = 1.0F + number};
  }
  return report;
}

json as_json(const VehiclePort& port, const Seen& seen) {
  VehiclePortState s;
  const bool got = port.status(s);
  const CanSocketReport& c = s.socket;
  const VehicleInputReport& in = s.inputs;
  json all = {{"got", got},
              {"bus", static_cast<int>(s.bus.bus)},
              {"verdict", static_cast<int>(s.bus.pose_verdict)},
              {"source", static_cast<int>(s.bus.pose_source)},
              {"motion", static_cast<int>(s.motion)},
              {"reopened", s.reopened},
              {"retried", s.frames_retried},
              {"given_up", s.frames_given_up},
              {"skipped", s.cycles_skipped},
              {"poses_dropped", s.poses_dropped},
              {"timeouts", s.pose_timeouts},
              {"relocations", s.relocations},
              {"verdicts", s.verdicts}};
  all["socket"] = {{"received", c.received},
                   {"foreign", c.foreign},
                   {"kernel_dropped", c.kernel_dropped},
                   {"sent", c.sent},
                   {"no_buffer", c.no_buffer},
                   {"error_frames", c.error_frames},
                   {"error_passive", c.error_passive},
                   {"bus_off", c.bus_off},
                   {"restarted", c.restarted},
                   {"went_down", c.went_down},
                   {"no_stamp", c.no_stamp}};
  all["inputs"] = {{"frames", in.frames},
                   {"foreign", in.foreign},
                   {"misshapen", in.misshapen},
                   {"refused", in.refused},
                   {"accepted", in.accepted},
                   {"by_status", in.by_status},
                   {"incomplete", in.incomplete_poses},
                   {"commands", in.commands}};
  all["seen"] = {{"usable", seen.usable},       {"bridged", seen.bridged},
                 {"unusable", seen.unusable},   {"off_track_m", seen.off_track_m},
                 {"oldest_us", seen.oldest_us}, {"backwards", seen.backwards},
                 {"commands", seen.commands}};
  return all;
}

/// False at the end of the input.
bool answer(const VehiclePort& port, const Seen& seen, bool& reporting) {
  std::string line;
  if (!std::getline(std::cin, line)) return false;
  if (line == "silent") reporting = false;
  std::puts(as_json(port, seen).dump().c_str());
  std::fflush(stdout);
  return true;
}

int run(const VehiclePortConfig& config, int sectors) {
  const Outcome<std::unique_ptr<VehiclePort>> port = VehiclePort::open(config);
  if (!port.ok()) {
    std::puts(port.failure().text().c_str());
    return port.failure().kind == FailureKind::kUsage ? 1 : 2;
  }
  VehicleReport report = report_of(sectors);
  bool reporting = true;
  std::puts("ready");
  std::fflush(stdout);
  Seen seen;
  pollfd input{0, POLLIN, 0};
  while (true) {
    const bool asked = ::poll(&input, 1, 10) > 0;
    drain(**port, seen);
    if (asked && !answer(**port, seen, reporting)) return 0;
    report.made_us = MonotonicClock::now_us();
    if (reporting) (*port)->report(report);
  }
}

}  // namespace
}  // namespace tessera

int main(int count, char** words) {
  using namespace tessera;
  if (count < 2) return 1;
  VehiclePortConfig config;
  config.socket.interface = words[1];
  int sectors = 16;
  for (int i = 2; i < count; ++i) {
    const std::string_view word = words[i];
    if (word == "--fd") config.can_fd = true;
    if (word == "--sectors" && i + 1 < count) sectors = std::atoi(words[i + 1]);
    if (word == "--mode" && i + 1 < count) {
      const std::string_view mode = words[i + 1];
      config.inputs.mode = mode == "pose"       ? PoseMode::kPose
                           : mode == "odometry" ? PoseMode::kOdometry
                                                : PoseMode::kBridging;
    }
  }
  return run(config, sectors);
}
