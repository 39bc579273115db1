// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The messages by their offset from the base identifier: lower ones win the bus, so messages of the
// vehicle come first, then those that its controller needs at 20 Hz, then status messages.
#pragma once

#include "vehicle/bus_messages.hpp"

namespace tessera {

namespace bus {

inline constexpr std::uint32_t kIdCommand = 0x00;
inline constexpr std::uint32_t kIdVehicleState = 0x01;
inline constexpr std::uint32_t kIdPoseXy = 0x02;
inline constexpr std::uint32_t kIdPoseZh = 0x03;
inline constexpr std::uint32_t kIdPoseRp = 0x04;
inline constexpr std::uint32_t kIdOdometry = 0x05;
inline constexpr std::uint32_t kIdPoseFd = 0x06;
inline constexpr std::uint32_t kIdHeartbeat = 0x08;
inline constexpr std::uint32_t kIdSectorInfo = 0x09;
inline constexpr std::uint32_t kIdSectors = 0x0a;    ///< And the 15 after it.
inline constexpr std::uint32_t kIdFdSectors = 0x1a;  ///< And the one after it.
inline constexpr std::uint32_t kIdMapFill = 0x1c;
inline constexpr std::uint32_t kIdTiming = 0x1d;
inline constexpr std::uint32_t kIdTeam = 0x1e;
inline constexpr std::uint32_t kIdInfo = 0x1f;

}  // namespace bus

/// When a message is sent.
enum class BusUse : std::uint8_t {
  kAlways,
  kClassicPose,  ///< Of the two forms of the pose, one is sent.
  kFdPose,
  kClassicSectors,  ///< Of the two forms of the sectors, one is sent.
  kFdSectors,
};

struct BusMessage {
  const char* name = "";  ///< In the DBC; of the sectors' frames the first sector is added.
  std::uint32_t place = 0;
  std::uint8_t size = 0;
  bool is_fd = false;
  bool from_vehicle = false;
  BusUse use = BusUse::kAlways;
  std::int32_t cycle_ms = 0;
  E2eProfile e2e = E2eProfile::kNone;
  std::span<const Signal> signals{};
  std::int8_t first_sector = -1;
};

/// Part of a message's checksum that is not sent: different for each identifier, so that a frame of
/// another base is refused too.
[[nodiscard]] constexpr std::uint16_t e2e_data_id(std::uint32_t id) noexcept {
  return static_cast<std::uint16_t>(0x5000U + id);
}

inline constexpr std::int32_t kSectorsCycleMs = 50;

inline constexpr auto kBusMessages = [] {
  using enum E2eProfile;
  using enum BusUse;
  using namespace bus;
  constexpr std::size_t kFrames = kSectorsSignals.size();
  constexpr std::size_t kFdFrames = kFdSectorsSignals.size();
  std::array<BusMessage, 13 + kFrames + kFdFrames> all{
      BusMessage{"COMMAND", kIdCommand, 4, false, true, kAlways, 100, kProfile1, kCommandSignals},
      BusMessage{"VEHICLE_STATE", kIdVehicleState, 2, false, true, kAlways, 100, kProfile1,
                 kVehicleStateSignals},
      BusMessage{"POSE_XY", kIdPoseXy, 8, false, true, kClassicPose, 20, kProfile1, kPoseXySignals},
      BusMessage{"POSE_ZH", kIdPoseZh, 8, false, true, kClassicPose, 20, kProfile1, kPoseZhSignals},
      BusMessage{"POSE_RP", kIdPoseRp, 8, false, true, kClassicPose, 20, kProfile1, kPoseRpSignals},
      BusMessage{"ODOMETRY", kIdOdometry, 8, false, true, kAlways, 20, kProfile1, kOdometrySignals},
      BusMessage{"POSE_FD", kIdPoseFd, 48, true, true, kFdPose, 20, kProfile5, kPoseFdSignals},
      BusMessage{"HEARTBEAT", kIdHeartbeat, 8, false, false, kAlways, 100, kProfile1,
                 kHeartbeatSignals},
      BusMessage{"SECTOR_INFO", kIdSectorInfo, 8, false, false, kAlways, kSectorsCycleMs, kProfile1,
                 kSectorInfoSignals}};
  std::size_t count = 9;
  for (std::size_t i = 0; i < kFrames; ++i) {
    const auto place = static_cast<std::uint32_t>(kIdSectors + i);
    const auto first = static_cast<std::int8_t>(i * kSectorsPerFrame);
    all[count++] = {
        "SECTORS",          place, 8, false, false, kClassicSectors, kSectorsCycleMs, kProfile1,
        kSectorsSignals[i], first};
  }
  for (std::size_t i = 0; i < kFdFrames; ++i) {
    const auto place = static_cast<std::uint32_t>(kIdFdSectors + i);
    const auto first = static_cast<std::int8_t>(i * kSectorsPerFdFrame);
    all[count++] = {
        "SECTORS_FD",         place, 64, true, false, kFdSectors, kSectorsCycleMs, kProfile5,
        kFdSectorsSignals[i], first};
  }
  all[count++] = {"MAP_FILL", kIdMapFill, 8, false, false, kAlways, 500, kNone, kMapFillSignals};
  all[count++] = {"TIMING", kIdTiming, 8, false, false, kAlways, 500, kNone, kTimingSignals};
  all[count++] = {"TEAM", kIdTeam, 5, false, false, kAlways, 500, kNone, kTeamSignals};
  all[count++] = {"INFO", kIdInfo, 6, false, false, kAlways, 1000, kNone, kInfoSignals};
  return all;
}();

/// The message at an offset from the base; null if there is none.
[[nodiscard]] constexpr const BusMessage* bus_message(std::uint32_t place) noexcept {
  for (const BusMessage& message : kBusMessages)
    if (message.place == place) return &message;
  return nullptr;
}

/// True if base + 0 .. base + 31 are allowed identifiers.
[[nodiscard]] constexpr bool is_base_id(std::uint32_t base) noexcept {
  return base % kBusIds == 0 && base <= kCanIds - kBusIds;
}

}  // namespace tessera
