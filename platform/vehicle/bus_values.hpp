// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Values of signals with named values. The numbers are those on the bus.
#pragma once

#include <cstdint>

namespace tessera {

enum class MotionState : std::uint8_t { kUnknown = 0, kStanding = 1, kMoving = 2, kParked = 3 };
inline constexpr int kMotionStates = 4;

enum class VehicleCommand : std::uint8_t {
  kNone = 0,
  kStart = 1,
  kPause = 2,
  kClear = 3,
  kSave = 4
};
inline constexpr int kVehicleCommands = 5;

enum class MappingState : std::uint8_t {
  kStarting = 0,
  kMapping = 1,
  kPaused = 2,  ///< PauseReason has the reason.
  kStopping = 3,
  kFault = 4,
};
inline constexpr int kMappingStates = 5;

enum class PauseReason : std::uint8_t {
  kNone = 0,
  kCommand = 1,
  kNoPose = 2,
  kStalePose = 3,
  kFrozenPose = 4,
  kJumpingPose = 5,
  kCorruptPose = 6,
  kUncertainPose = 7,
  kRecoveringPose = 8,
  kNoSensor = 9,
  kMemoryFull = 10,
  kOverload = 11,
  kSilent = 12,     ///< No thread except that on the bus has reported for too long.
  kTwin = 13,       ///< Another process uses this robot's number: the shared map may mix both.
  kOtherTwin = 14,  ///< Two processes use another robot's number.
  kConflict = 15,   ///< Two contents were signed for one version of a contribution.
};
inline constexpr int kPauseReasons = 16;

/// What is wrong with a pose, or with all recent poses.
enum class PoseVerdict : std::uint8_t {
  kGood = 0,
  kNone = 1,        ///< None yet.
  kStale = 2,       ///< None came in time, or it was too old.
  kFrozen = 3,      ///< The pose stays while the vehicle moves.
  kJumping = 4,     ///< The pose moved farther than the vehicle can.
  kCorrupt = 5,     ///< Not a pose: NaN, not rigid, out of range, from the future.
  kUncertain = 6,   ///< Its standard deviations are too large.
  kOutOfOrder = 7,  ///< Not newer than the last one.
  kRecovering = 8,  ///< Good, but not enough good poses in a row yet.
};
inline constexpr int kPoseVerdicts = 9;

/// The current source of poses.
enum class PoseSource : std::uint8_t { kNone = 0, kPose = 1, kOdometry = 2 };
inline constexpr int kPoseSources = 3;

enum class BusState : std::uint8_t { kActive = 0, kPassive = 1, kOff = 2, kDown = 3 };
inline constexpr int kBusStates = 4;

enum class CommandResult : std::uint8_t { kNone = 0, kAccepted = 1, kDone = 2, kDenied = 3 };
inline constexpr int kCommandResults = 4;

enum class Convergence : std::uint8_t { kUnknown = 0, kAlone = 1, kAgree = 2, kDiffer = 3 };
inline constexpr int kConvergences = 4;

enum class SectorsState : std::uint8_t {
  kNone = 0,     ///< No sectors yet.
  kCurrent = 1,  ///< Of the pose with this age.
  kHeld = 2,     ///< Mapping is paused or stopped: sectors are no longer renewed.
};
inline constexpr int kSectorsStates = 3;

}  // namespace tessera
