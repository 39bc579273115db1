// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Makes poses and commands of frames with any bytes. No clock, no heap: the time of arrival is
// passed with each frame.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "tessera/base/counters.hpp"
#include "vehicle/bus_table.hpp"
#include "vehicle/odometry.hpp"
#include "vehicle/pose_assembly.hpp"
#include "vehicle/pose_guard.hpp"

namespace tessera {

enum class PoseMode : std::uint8_t {
  kPose,      ///< Only poses.
  kBridging,  ///< Poses; while they are bad, odometry from the last good one, limited, and not
              ///< after a frozen one.
  kOdometry,  ///< Only odometry, from the start of the robot: a map in its own frame.
};
constexpr const char* to_string(PoseMode mode) noexcept {
  switch (mode) {
    case PoseMode::kPose:
      return "pose";
    case PoseMode::kBridging:
      return "bridging";
    case PoseMode::kOdometry:
      return "odometry";
  }
  return "";
}

struct VehicleInputsConfig {
  std::uint32_t base_id = kDefaultBaseId;  ///< See is_base_id().
  PoseMode mode = PoseMode::kBridging;
  PoseGuardConfig guard{};
  std::int64_t max_bridge_us = 2'000'000;  ///< Longest use of odometry without a good pose, also
                                           ///< limited by the guard's limits for deviations.
  std::uint8_t max_delta = 4;              ///< Largest valid step of a message's counter.
};

/// A pose for mapping if usable; else only for logs.
struct JudgedPose {
  PoseObservation observation{};
  PoseVerdict verdict = PoseVerdict::kNone;
  PoseSource source = PoseSource::kNone;
  bool usable = false;
  /// Since start. Another number means another frame, so a map that continues needs a new submap.
  std::uint64_t relocations = 0;
};

struct TakenCommand {
  VehicleCommand command = VehicleCommand::kNone;
  std::uint8_t number = 0;  ///< Returned in the heartbeat.
  std::int64_t received_us = 0;
};

#define TESSERA_VEHICLE_INPUT_COUNTERS(ROW)                                                       \
  ROW(COUNTER, uint64_t, frames, "Frames received: the sum of the next four.")                    \
  ROW(COUNTER, uint64_t, foreign, "Frames of no message for the node.")                           \
  ROW(COUNTER, uint64_t, misshapen, "Frames of another length or kind than their message has.")   \
  ROW(COUNTER, uint64_t, refused,                                                                 \
      "Frames refused by end-to-end protection; `by_status` has the reason.")                     \
  ROW(COUNTER, uint64_t, accepted, "Frames accepted.")                                            \
  ROW(COUNTER, uint64_t, incomplete_poses, "Poses with a frame that did not arrive in time.")     \
  ROW(COUNTER, uint64_t, invalid_poses,                                                           \
      "Poses marked as invalid by the vehicle, or with a signal out of range.")                   \
  ROW(COUNTER, uint64_t, invalid_odometry, "The same of odometry, or beyond the guard's limits.") \
  ROW(COUNTER, uint64_t, invalid_states, "Invalid values of motion.")                             \
  ROW(COUNTER, uint64_t, commands, "Commands accepted.")                                          \
  ROW(COUNTER, uint64_t, unknown_commands, "Commands that are new, but unknown.")

/// Each frame is counted once by its result; the other counters have details.
struct VehicleInputReport {
  TESSERA_VEHICLE_INPUT_COUNTERS(TESSERA_COUNTER_MEMBER)
  std::array<std::uint64_t, kE2eStatuses> by_status{};  ///< Sum of frames that were neither foreign
};
TESSERA_COUNTER_TABLE(VehicleInputReport, TESSERA_VEHICLE_INPUT_COUNTERS(TESSERA_COUNTER_ROW))

class VehicleInputs {
 public:
  struct Taken {
    std::optional<JudgedPose> pose{};
    std::optional<TakenCommand> command{};
  };

  /// config.base_id: if invalid, the default is used.
  explicit VehicleInputs(const VehicleInputsConfig& config = {}) noexcept;

  /// received_us: by the clock of the poses' stamps, never decreasing. O(64).
  Taken take(const CanFrame& frame, std::int64_t received_us) noexcept;

  /// The guard's current verdict on the vehicle's poses; in mode kOdometry, kGood, kStale or kNone,
  /// depending on the odometry.
  PoseVerdict pose_state(std::int64_t now_us) noexcept;
  /// The current source of usable poses: mapping pauses while it is kNone, and the verdict has the
  /// reason.
  PoseSource pose_source(std::int64_t now_us) noexcept;
  /// kUnknown unless the vehicle reported it within the guard's motion_timeout_us.
  [[nodiscard]] MotionState motion(std::int64_t now_us) const noexcept;

  [[nodiscard]] VehicleInputReport counters() const noexcept;
  [[nodiscard]] const PoseGuard& guard() const noexcept { return guard_; }
  [[nodiscard]] const VehicleInputsConfig& config() const noexcept { return config_; }

 private:
  static constexpr std::size_t kMessages = 7;  ///< From the vehicle: offsets below the heartbeat's.

  void take_command(const CanFrame& frame, std::int64_t received_us, Taken& taken) noexcept;
  void take_state(const CanFrame& frame, std::int64_t received_us) noexcept;
  void take_odometry(const CanFrame& frame, std::int64_t received_us, Taken& taken) noexcept;
  void take_part(PoseAssembly::Part part, const CanFrame& frame, std::int64_t received_us,
                 Taken& taken) noexcept;
  void take_pose(const SentPose& sent, std::int64_t received_us, Taken& taken) noexcept;
  [[nodiscard]] bool is_plausible(double speed_mps, double yaw_rate_radps) const noexcept;
  [[nodiscard]] bool may_reckon(std::int64_t now_us) const noexcept;
  void start_reckoning(std::int64_t now_us) noexcept;

  VehicleInputsConfig config_;
  std::array<E2eChecker, kMessages> checkers_{};
  PoseAssembly assembly_{};
  PoseGuard guard_;
  Odometry odometry_{};
  VehicleMotion motion_{};
  std::int64_t odometry_received_us_ = 0;
  bool has_reckoned_ = false;
  std::uint64_t restarts_ = 0;  ///< Of mode kOdometry, after a gap.
  bool knows_command_ = false;
  std::uint8_t command_number_ = 0;  ///< The last that was accepted or found at the start.
  std::uint8_t seen_number_ = 0;     ///< With seen_command_, of the frame before.
  std::uint32_t seen_command_ = 0;
  VehicleInputReport counters_{};
};

}  // namespace tessera
