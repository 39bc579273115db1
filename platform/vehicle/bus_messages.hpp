// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// All messages between vehicle and tessera, as tables. docs/reference/can/tessera.dbc is written
// from them (tests/can/test_dbc.py --write).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "vehicle/can_frame.hpp"
#include "vehicle/e2e.hpp"
#include "vehicle/signal.hpp"

namespace tessera {

/// Identifiers are base + 0 .. base + 31; the base is a multiple of 32.
inline constexpr std::uint32_t kDefaultBaseId = 0x100;
inline constexpr std::uint32_t kBusIds = 32;
/// Counts incompatible changes of the layout.
inline constexpr int kBusLayoutVersion = 1;

inline constexpr int kSectorsPerFrame = 2;
inline constexpr int kSectorsPerFdFrame = 16;
inline constexpr int kMostSectors = 32;

namespace bus {

inline constexpr Signal kCrc8{"Crc", 0, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kCounter4{"Counter", 8, 4, false, 1, 0, 0, 14, ""};
inline constexpr Signal kCrc16{"Crc", 0, 16, false, 1, 0, 0, 65535, ""};
inline constexpr Signal kCounter8{"Counter", 16, 8, false, 1, 0, 0, 255, ""};

inline constexpr Signal kCommand{"Command", 16, 8, false, 1, 0, 0, 4, ""};
inline constexpr Signal kCommandNumber{"CommandNumber", 24, 8, false, 1, 0, 0, 255, ""};
inline constexpr std::array kCommandSignals{kCrc8, kCounter4, kCommand, kCommandNumber};

inline constexpr Signal kMotionState{"MotionState", 12, 4, false, 1, 0, 0, 3, ""};
inline constexpr std::array kVehicleStateSignals{kCrc8, kCounter4, kMotionState};

inline constexpr Signal kPoseCounter{"PoseCounter", 12, 4, false, 1, 0, 0, 15, ""};
inline constexpr Signal kX{"X", 16, 24, true, 1e-3, 0, -8388, 8388, "m"};
inline constexpr Signal kY{"Y", 40, 24, true, 1e-3, 0, -8388, 8388, "m"};
inline constexpr std::array kPoseXySignals{kCrc8, kCounter4, kPoseCounter, kX, kY};
inline constexpr Signal kZ{"Z", 16, 24, true, 1e-3, 0, -8388, 8388, "m"};
inline constexpr Signal kHeading{"Heading", 40, 16, true, 1e-4, 0, -3.1416, 3.1416, "rad"};
inline constexpr Signal kAge{"Age", 56, 8, false, 1, 0, 0, 254, "ms"};
inline constexpr std::uint32_t kNoPoseAge = 255;
inline constexpr std::array kPoseZhSignals{kCrc8, kCounter4, kPoseCounter, kZ, kHeading, kAge};
inline constexpr Signal kRoll{"Roll", 16, 12, true, 1e-3, 0, -1.6, 1.6, "rad"};
inline constexpr Signal kPitch{"Pitch", 28, 12, true, 1e-3, 0, -1.6, 1.6, "rad"};
inline constexpr Signal kStdPosition{"StdPosition", 40, 12, false, 5e-3, 0, 0, 20.47, "m"};
inline constexpr Signal kStdHeading{"StdHeading", 52, 12, false, 5e-4, 0, 0, 2.047, "rad"};
inline constexpr std::array kPoseRpSignals{kCrc8,  kCounter4,    kPoseCounter, kRoll,
                                           kPitch, kStdPosition, kStdHeading};

inline constexpr Signal kFdPoseState{"PoseValid", 24, 8, false, 1, 0, 0, 1, ""};
inline constexpr Signal kFdX{"X", 32, 32, true, 1e-4, 0, -200000, 200000, "m"};
inline constexpr Signal kFdY{"Y", 64, 32, true, 1e-4, 0, -200000, 200000, "m"};
inline constexpr Signal kFdZ{"Z", 96, 32, true, 1e-4, 0, -200000, 200000, "m"};
inline constexpr Signal kFdRoll{"Roll", 128, 24, true, 1e-6, 0, -1.6, 1.6, "rad"};
inline constexpr Signal kFdPitch{"Pitch", 152, 24, true, 1e-6, 0, -1.6, 1.6, "rad"};
inline constexpr Signal kFdHeading{"Heading", 176, 24, true, 1e-6, 0, -3.141593, 3.141593, "rad"};
inline constexpr Signal kFdStdX{"StdX", 200, 16, false, 1e-3, 0, 0, 65.535, "m"};
inline constexpr Signal kFdStdY{"StdY", 216, 16, false, 1e-3, 0, 0, 65.535, "m"};
inline constexpr Signal kFdStdZ{"StdZ", 232, 16, false, 1e-3, 0, 0, 65.535, "m"};
inline constexpr Signal kFdStdRoll{"StdRoll", 248, 16, false, 1e-4, 0, 0, 6.5535, "rad"};
inline constexpr Signal kFdStdPitch{"StdPitch", 264, 16, false, 1e-4, 0, 0, 6.5535, "rad"};
inline constexpr Signal kFdStdHeading{"StdHeading", 280, 16, false, 1e-4, 0, 0, 6.5535, "rad"};
inline constexpr Signal kFdAge{"Age", 296, 16, false, 0.1, 0, 0, 6553.5, "ms"};
inline constexpr std::array kPoseFdSignals{
    kCrc16,     kCounter8, kFdPoseState, kFdX,    kFdY,       kFdZ,        kFdRoll,       kFdPitch,
    kFdHeading, kFdStdX,   kFdStdY,      kFdStdZ, kFdStdRoll, kFdStdPitch, kFdStdHeading, kFdAge};

inline constexpr Signal kOdometryValid{"OdometryValid", 12, 4, false, 1, 0, 0, 1, ""};
inline constexpr Signal kWheelSpeed{"WheelSpeed", 16, 16, true, 2e-3, 0, -65, 65, "m/s"};
inline constexpr Signal kYawRate{"YawRate", 32, 16, true, 2e-4, 0, -6.5, 6.5, "rad/s"};
inline constexpr Signal kStdWheelSpeed{"StdWheelSpeed", 48, 8, false, 1e-2, 0, 0, 2.55, "m/s"};
inline constexpr Signal kStdYawRate{"StdYawRate", 56, 8, false, 1e-3, 0, 0, 0.255, "rad/s"};
inline constexpr std::array kOdometrySignals{kCrc8,    kCounter4,      kOdometryValid, kWheelSpeed,
                                             kYawRate, kStdWheelSpeed, kStdYawRate};

inline constexpr Signal kMappingState{"MappingState", 12, 4, false, 1, 0, 0, 4, ""};
inline constexpr Signal kPauseReason{"PauseReason", 16, 4, false, 1, 0, 0, 15, ""};
inline constexpr Signal kPoseVerdict{"PoseVerdict", 20, 4, false, 1, 0, 0, 8, ""};
inline constexpr Signal kPoseSource{"PoseSource", 24, 2, false, 1, 0, 0, 2, ""};
inline constexpr Signal kBusState{"BusState", 26, 2, false, 1, 0, 0, 3, ""};
inline constexpr Signal kCommandResult{"CommandResult", 28, 4, false, 1, 0, 0, 3, ""};
inline constexpr Signal kLastCommand{"LastCommandNumber", 32, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kUptime{"Uptime", 40, 24, false, 1, 0, 0, 16777215, "s"};
inline constexpr std::array kHeartbeatSignals{
    kCrc8,       kCounter4, kMappingState,  kPauseReason, kPoseVerdict,
    kPoseSource, kBusState, kCommandResult, kLastCommand, kUptime};

inline constexpr Signal kSummaryCounter{"SummaryCounter", 12, 4, false, 1, 0, 0, 15, ""};
inline constexpr Signal kSectorCount{"SectorCount", 16, 8, false, 1, 0, 0, 32, ""};
inline constexpr Signal kSectorsState{"SectorsState", 24, 4, false, 1, 0, 0, 2, ""};
inline constexpr Signal kSectorsAge{"Age", 28, 12, false, 1, 0, 0, 4094, "ms"};
inline constexpr std::uint32_t kOlderThanCanBeSaid = 4095;
inline constexpr Signal kMaxRange{"MaxRange", 40, 8, false, 0.5, 0, 0, 102, "m"};
inline constexpr Signal kMinHeight{"MinHeight", 48, 8, true, 0.05, 0, -6.4, 6.35, "m"};
inline constexpr Signal kMaxHeight{"MaxHeight", 56, 8, true, 0.05, 0, -6.4, 6.35, "m"};
inline constexpr std::array kSectorInfoSignals{kCrc8,        kCounter4,     kSummaryCounter,
                                               kSectorCount, kSectorsState, kSectorsAge,
                                               kMaxRange,    kMinHeight,    kMaxHeight};

inline constexpr int kSectorBits = 24;
inline constexpr Signal kDistance{"Distance", 0, 10, false, 0.1, 0, 0, 102, "m"};
inline constexpr std::uint32_t kNothingFound = 1022;  ///< Codes of kDistance.
inline constexpr std::uint32_t kNotAvailable = 1023;
inline constexpr Signal kFreeUpTo{"FreeUpTo", 10, 5, false, 1, 0, 0, 31, "m"};
inline constexpr Signal kClass{"Class", 15, 6, false, 1, 0, 0, 63, ""};
inline constexpr Signal kConfidence{"Confidence", 21, 3, false, 0.07, 0.5, 0.5, 0.99, ""};
inline constexpr std::array kSectorParts{kDistance, kFreeUpTo, kClass, kConfidence};

/// The part of one of the sectors of a frame. place: of the sector in the frame. first: bit of the
/// frame's first sector. sector: its number on the vehicle.
[[nodiscard]] constexpr Signal of_sector(Signal part, int place, int first, int sector) noexcept {
  part.start = static_cast<std::uint16_t>(part.start + first + place * kSectorBits);
  part.sector = static_cast<std::int8_t>(sector);
  return part;
}

inline constexpr int kFirstSectorBit = 16;
inline constexpr int kFirstFdSectorBit = 32;
inline constexpr Signal kFdSummaryCounter{"SummaryCounter", 24, 4, false, 1, 0, 0, 15, ""};

/// The signals of all frames that together carry the sectors: three at the head of each, then the
/// parts of its sectors. kInFrame: sectors of a frame. first: bit of its first sector.
template <std::size_t kInFrame>
[[nodiscard]] constexpr auto sectors_signals(const std::array<Signal, 3>& head,
                                             int first) noexcept {
  constexpr std::size_t kParts = 4;
  std::array<std::array<Signal, 3 + kParts * kInFrame>, std::size_t{kMostSectors} / kInFrame> all{};
  for (std::size_t frame = 0; frame < all.size(); ++frame) {
    for (std::size_t i = 0; i < head.size(); ++i) all[frame][i] = head[i];
    for (std::size_t i = 0; i < kParts * kInFrame; ++i) {
      const int place = static_cast<int>(i / kParts);
      all[frame][3 + i] = of_sector(kSectorParts[i % kParts], place, first,
                                    static_cast<int>(frame * kInFrame) + place);
    }
  }
  return all;
}
inline constexpr auto kSectorsSignals =
    sectors_signals<kSectorsPerFrame>({kCrc8, kCounter4, kSummaryCounter}, kFirstSectorBit);
inline constexpr auto kFdSectorsSignals =
    sectors_signals<kSectorsPerFdFrame>({kCrc16, kCounter8, kFdSummaryCounter}, kFirstFdSectorBit);

inline constexpr Signal kMemoryUsed{"MemoryUsed", 0, 16, false, 0.01, 0, 0, 100, "%"};
inline constexpr Signal kBlocks{"Blocks", 16, 24, false, 1, 0, 0, 16777215, ""};
inline constexpr Signal kRefusedPoints{"RefusedPoints", 40, 24, false, 1, 0, 0, 16777215, ""};
inline constexpr std::array kMapFillSignals{kMemoryUsed, kBlocks, kRefusedPoints};

inline constexpr Signal kOverruns{"Overruns", 0, 16, false, 1, 0, 0, 65535, ""};
inline constexpr Signal kCycleP99{"CycleP99", 16, 16, false, 0.01, 0, 0, 655.35, "ms"};
inline constexpr Signal kCycleWorst{"CycleWorst", 32, 16, false, 0.01, 0, 0, 655.35, "ms"};
inline constexpr Signal kPeriod{"Period", 48, 16, false, 0.01, 0, 0, 655.35, "ms"};
inline constexpr std::array kTimingSignals{kOverruns, kCycleP99, kCycleWorst, kPeriod};

inline constexpr Signal kPeers{"PeersInReach", 0, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kPeersAgreeing{"PeersAgreeing", 8, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kKnown{"ContributionsKnown", 16, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kWhole{"ContributionsWhole", 24, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kConvergence{"Convergence", 32, 4, false, 1, 0, 0, 3, ""};
inline constexpr std::array kTeamSignals{kPeers, kPeersAgreeing, kKnown, kWhole, kConvergence};

inline constexpr Signal kVersionMajor{"VersionMajor", 0, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kVersionMinor{"VersionMinor", 8, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kVersionPatch{"VersionPatch", 16, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kLayout{"LayoutVersion", 24, 8, false, 1, 0, 0, 255, ""};
inline constexpr Signal kRobot{"RobotId", 32, 16, false, 1, 0, 0, 65535, ""};
inline constexpr std::array kInfoSignals{kVersionMajor, kVersionMinor, kVersionPatch, kLayout,
                                         kRobot};

}  // namespace bus
}  // namespace tessera
