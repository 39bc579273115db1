// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>

#include "fuzz/fuzz.hpp"
#include "vehicle/vehicle_inputs.hpp"

namespace tessera::fuzz {

namespace {

void check_pose(const JudgedPose& judged, std::int64_t now_us, const VehicleInputsConfig& config) {
  const PoseObservation& pose = judged.observation;
  require(judged.usable == (judged.verdict == PoseVerdict::kGood), "used, or not, for no reason");
  if (!judged.usable) return;
  require(check_rigid(pose.pose.T_map_body) == Status::kOk, "a pose that is none");
  require(judged.source != PoseSource::kNone, "of no source");
  require(pose.received_us <= now_us, "received later than now");
  if (judged.source == PoseSource::kOdometry) return;
  require(pose.pose.T_map_body.col(3).cwiseAbs().maxCoeff() <= config.guard.max_coordinate_m,
          "out of range");
  require(pose.pose.stamp_us >= pose.received_us - config.guard.max_age_us, "a stale pose is used");
  require(pose.std_position_m <= config.guard.max_std_position_m &&
              pose.std_heading_rad <= config.guard.max_std_heading_rad,
          "an uncertain pose is used");
}

void check_counters(const VehicleInputs& inputs) {
  const VehicleInputReport c = inputs.counters();
  require(c.frames == c.foreign + c.misshapen + c.refused + c.accepted, "a frame is not counted");
  std::uint64_t judged = 0;
  for (const std::uint64_t count : c.by_status) judged += count;
  require(judged == c.refused + c.accepted, "a verdict is not counted");
}

/// What a controller sends: its signals are anything, its counter and checksum right or nearly.
CanFrame next_frame(Input& input, std::array<std::uint8_t, kBusIds>& counters) {
  const std::uint8_t what = input.u8();
  CanFrame frame;
  frame.id = kDefaultBaseId + (what & 0x0fU);
  const BusMessage* const message = bus_message(what & 0x07U);
  const bool ours = message != nullptr && (what & 0x08U) == 0;
  frame.is_fd = ours ? message->is_fd : (what & 0x10U) != 0;
  frame.size = ours ? message->size : input.u8() % 80;
  const Bytes bytes = input.bytes(std::min<std::size_t>(frame.size, frame.data.size()));
  for (std::size_t i = 0; i < bytes.size(); ++i)
    frame.data[i] = std::to_integer<std::uint8_t>(bytes[i]);
  if (!ours || (what & 0x80U) != 0) return frame;
  std::uint8_t& counter = counters[message->place];
  counter = e2e_next(message->e2e, counter);
  if ((what & 0x40U) != 0) counter = static_cast<std::uint8_t>(input.u8() % 15);
  // One pose after the other, so that some are put together.
  if ((what & 0x20U) != 0) put_raw(frame.data, bus::kPoseCounter, counter);
  e2e_protect(message->e2e, e2e_data_id(frame.id), counter,
              std::span(frame.data).first(frame.size));
  return frame;
}

}  // namespace

void vehicle(Bytes bytes) {
  Input input(bytes);
  VehicleInputsConfig config;
  config.mode = static_cast<PoseMode>(input.below(3));
  // Some that any bytes can satisfy, so that what is behind the guard is reached.
  if (input.below(2) == 1) {
    config.guard.max_std_position_m = config.guard.max_std_heading_rad = 100.0;
    config.guard.max_speed_mps = 1e9;
    config.guard.max_yaw_rate_radps = 1e9;
  }
  VehicleInputs inputs(config);
  std::array<std::uint8_t, kBusIds> counters{};
  std::int64_t now_us = 1'000'000;
  std::uint64_t commands = 0;
  while (!input.empty()) {
    now_us += std::int64_t{input.u8()} * 500;
    const VehicleInputs::Taken taken = inputs.take(next_frame(input, counters), now_us);
    if (taken.pose.has_value()) check_pose(*taken.pose, now_us, config);
    if (taken.command.has_value()) {
      ++commands;
      require(taken.command->command != VehicleCommand::kNone, "a command to do nothing");
    }
    const bool source = inputs.pose_source(now_us) != PoseSource::kNone;
    require(source || inputs.pose_state(now_us) != PoseVerdict::kGood, "good, and not used");
    check_counters(inputs);
  }
  require(inputs.counters().commands == commands, "a command is not counted");
}

}  // namespace tessera::fuzz
