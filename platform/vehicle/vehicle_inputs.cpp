// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/vehicle_inputs.hpp"

#include <cmath>

namespace tessera {
namespace {

bool is_from_vehicle(const BusMessage* message) noexcept {
  return message != nullptr && message->from_vehicle;
}

}  // namespace

VehicleInputs::VehicleInputs(const VehicleInputsConfig& config) noexcept
    : config_(config), guard_(config.guard) {
  if (!is_base_id(config_.base_id)) config_.base_id = kDefaultBaseId;
  for (std::uint32_t place = 0; place < kMessages; ++place) {
    const BusMessage* const message = bus_message(place);
    if (!is_from_vehicle(message)) continue;
    checkers_[place] = E2eChecker({.profile = message->e2e,
                                   .data_id = e2e_data_id(config_.base_id + place),
                                   .size = message->size,
                                   .max_delta = config_.max_delta});
  }
}

VehicleInputs::Taken VehicleInputs::take(const CanFrame& frame, std::int64_t received_us) noexcept {
  Taken taken;
  ++counters_.frames;
  const std::uint32_t place = frame.id - config_.base_id;
  const BusMessage* const message = place < kMessages ? bus_message(place) : nullptr;
  if (!is_from_vehicle(message)) {
    ++counters_.foreign;
    return taken;
  }
  if (frame.size != message->size || frame.is_fd != message->is_fd) {
    ++counters_.misshapen;
    return taken;
  }
  const E2eStatus status = checkers_[place].check(frame.bytes());
  ++counters_.by_status[static_cast<std::size_t>(status)];
  if (!is_valid(status)) {
    ++counters_.refused;
    return taken;
  }
  ++counters_.accepted;
  switch (place) {
    case bus::kIdCommand:
      take_command(frame, received_us, taken);
      break;
    case bus::kIdVehicleState:
      take_state(frame, received_us);
      break;
    case bus::kIdPoseXy:
      take_part(PoseAssembly::Part::kXy, frame, received_us, taken);
      break;
    case bus::kIdPoseZh:
      take_part(PoseAssembly::Part::kZh, frame, received_us, taken);
      break;
    case bus::kIdPoseRp:
      take_part(PoseAssembly::Part::kRp, frame, received_us, taken);
      break;
    case bus::kIdOdometry:
      take_odometry(frame, received_us, taken);
      break;
    default: {
      const std::optional<SentPose> sent = read_fd_pose(frame.bytes());
      if (sent.has_value())
        take_pose(*sent, received_us, taken);
      else
        ++counters_.invalid_poses;
    }
  }
  return taken;
}

/// Accepted only if repeated: a single frame does not clear a map.
void VehicleInputs::take_command(const CanFrame& frame, std::int64_t received_us,
                                 Taken& taken) noexcept {
  const auto number = static_cast<std::uint8_t>(raw_of(frame.bytes(), bus::kCommandNumber));
  const std::uint32_t command = raw_of(frame.bytes(), bus::kCommand);
  // Commands from before the start of this program are ignored.
  if (!knows_command_) {
    knows_command_ = true;
    command_number_ = number;
  }
  const bool again = number == seen_number_ && command == seen_command_;
  seen_number_ = number;
  seen_command_ = command;
  if (!again || number == command_number_) return;
  command_number_ = number;
  if (command >= kVehicleCommands) {
    ++counters_.unknown_commands;
    return;
  }
  if (command == 0) return;
  ++counters_.commands;
  taken.command = {static_cast<VehicleCommand>(command), number, received_us};
}

void VehicleInputs::take_state(const CanFrame& frame, std::int64_t received_us) noexcept {
  const std::uint32_t state = raw_of(frame.bytes(), bus::kMotionState);
  if (state >= kMotionStates) {
    ++counters_.invalid_states;
    return;
  }
  motion_.state = static_cast<MotionState>(state);
  motion_.received_us = received_us;
  if (received_us - odometry_received_us_ > config_.guard.motion_timeout_us)
    motion_.speed_mps = motion_.yaw_rate_radps = std::nullopt;
  guard_.moves(motion_);
}

/// Refuses wheel speeds that the vehicle cannot have, as with poses.
bool VehicleInputs::is_plausible(double speed_mps, double yaw_rate_radps) const noexcept {
  return std::abs(speed_mps) <= config_.guard.max_speed_mps &&
         std::abs(yaw_rate_radps) <= config_.guard.max_yaw_rate_radps;
}

void VehicleInputs::take_odometry(const CanFrame& frame, std::int64_t received_us,
                                  Taken& taken) noexcept {
  const auto data = frame.bytes();
  const double speed = value_of(data, bus::kWheelSpeed);
  const double yaw_rate = value_of(data, bus::kYawRate);
  if (raw_of(data, bus::kOdometryValid) != 1 || !in_range(bus::kWheelSpeed, speed) ||
      !in_range(bus::kYawRate, yaw_rate) || !is_plausible(speed, yaw_rate)) {
    ++counters_.invalid_odometry;
    return;
  }
  motion_.speed_mps = speed;
  motion_.yaw_rate_radps = yaw_rate;
  motion_.received_us = odometry_received_us_ = received_us;
  guard_.moves(motion_);
  const OdometryMeasurement measurement{.stamp_us = received_us,
                                        .speed_mps = speed,
                                        .yaw_rate_radps = yaw_rate,
                                        .std_speed_mps = value_of(data, bus::kStdWheelSpeed),
                                        .std_yaw_rate_radps = value_of(data, bus::kStdYawRate)};
  static_cast<void>(odometry_.measure(measurement));
  if (config_.mode == PoseMode::kOdometry && !odometry_.is_known()) start_reckoning(received_us);
  // While poses are good, those of odometry would only disturb.
  if (pose_source(received_us) != PoseSource::kOdometry) return;
  taken.pose = JudgedPose{.observation = odometry_.now(),
                          .verdict = PoseVerdict::kGood,
                          .source = PoseSource::kOdometry,
                          .usable = true,
                          .relocations = guard_.relocations() + restarts_};
  taken.pose->observation.received_us = received_us;
}

/// The last place, but after a gap in another frame, as the motion meanwhile is not known.
void VehicleInputs::start_reckoning(std::int64_t now_us) noexcept {
  if (has_reckoned_) ++restarts_;
  has_reckoned_ = odometry_.anchor({now_us, odometry_.now().pose.T_map_body}, 0.0, 0.0);
}

bool VehicleInputs::may_reckon(std::int64_t now_us) const noexcept {
  if (!odometry_.is_known() || now_us - odometry_.now().pose.stamp_us > Odometry::kMaxGapUs)
    return false;
  if (config_.mode == PoseMode::kOdometry) return true;
  if (config_.mode == PoseMode::kPose) return false;
  return odometry_.reckoned_us() <= config_.max_bridge_us &&
         odometry_.now().std_position_m <= config_.guard.max_std_position_m &&
         odometry_.now().std_heading_rad <= config_.guard.max_std_heading_rad;
}

void VehicleInputs::take_part(PoseAssembly::Part part, const CanFrame& frame,
                              std::int64_t received_us, Taken& taken) noexcept {
  const std::optional<PoseAssembly::Whole> whole = assembly_.take(part, frame.bytes(), received_us);
  if (!whole.has_value()) return;
  if (!whole->valid) {
    ++counters_.invalid_poses;
    return;
  }
  take_pose(whole->pose, whole->first_received_us, taken);
}

void VehicleInputs::take_pose(const SentPose& sent, std::int64_t received_us,
                              Taken& taken) noexcept {
  if (config_.mode == PoseMode::kOdometry) return;
  const std::int64_t age_us = std::llround(sent.age_ms * 1e3);
  const PoseObservation observation{.pose = {received_us - age_us, to_transform(sent)},
                                    .received_us = received_us,
                                    .std_position_m = sent.std_position_m,
                                    .std_heading_rad = sent.std_heading_rad};
  const std::uint64_t relocations = guard_.relocations();
  const PoseVerdict verdict = guard_.judge(observation);
  // The anchor was a frozen pose, and either it or the wheels are wrong. An anchor in a left frame
  // is not valid in the new one.
  if (verdict == PoseVerdict::kFrozen || guard_.relocations() != relocations) odometry_.forget();
  const bool good = verdict == PoseVerdict::kGood;
  if (good)
    static_cast<void>(odometry_.anchor(observation.pose, observation.std_position_m,
                                       observation.std_heading_rad));
  taken.pose = JudgedPose{.observation = observation,
                          .verdict = verdict,
                          .source = PoseSource::kPose,
                          .usable = good,
                          .relocations = guard_.relocations()};
}

PoseVerdict VehicleInputs::pose_state(std::int64_t now_us) noexcept {
  if (config_.mode != PoseMode::kOdometry) return guard_.state(now_us);
  if (may_reckon(now_us)) return PoseVerdict::kGood;
  return has_reckoned_ ? PoseVerdict::kStale : PoseVerdict::kNone;
}

PoseSource VehicleInputs::pose_source(std::int64_t now_us) noexcept {
  if (config_.mode != PoseMode::kOdometry && guard_.state(now_us) == PoseVerdict::kGood)
    return PoseSource::kPose;
  return may_reckon(now_us) ? PoseSource::kOdometry : PoseSource::kNone;
}

MotionState VehicleInputs::motion(std::int64_t now_us) const noexcept {
  const bool recent = now_us - motion_.received_us <= config_.guard.motion_timeout_us;
  return recent ? motion_.state : MotionState::kUnknown;
}

VehicleInputReport VehicleInputs::counters() const noexcept {
  VehicleInputReport counters = counters_;
  counters.incomplete_poses = assembly_.incomplete();
  return counters;
}

}  // namespace tessera
