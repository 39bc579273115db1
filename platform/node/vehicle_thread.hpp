// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The thread that communicates with the vehicle: it searches the map for obstacles around the
// robot, sends the state twenty times a second, and carries out the commands of the vehicle.
// VehiclePort has the bus itself.
#pragma once

#include <atomic>
#include <memory>

#include "maps/stored_map.hpp"
#include "node/mapping_thread.hpp"
#include "node/sensing_thread.hpp"
#include "node/sharing_thread.hpp"
#include "node/team_alarm.hpp"
#include "tessera/base/counters.hpp"
#include "tessera/map/obstacle_sectors.hpp"
#include "vehicle/vehicle_port.hpp"

namespace tessera {

struct VehicleThreadConfig {
  ObstacleSectorsConfig sectors{};
  std::uint32_t robot = 0;
  std::int64_t period_us = 100'000;  ///< Of mapping.
};

/// Requests of the vehicle to the whole process. For any thread.
struct SaveRequests {
  std::atomic<bool>& asked;
  const std::atomic<std::uint64_t>& done;
  const std::atomic<std::uint64_t>& failed;
};

#define TESSERA_VEHICLE_THREAD_COUNTERS(ROW)                          \
  ROW(COUNTER, uint64_t, reports, "Reports to the vehicle.")          \
  ROW(COUNTER, uint64_t, sweeps, "Complete sweeps around the robot.") \
  ROW(COUNTER, uint64_t, commands, "Commands of the vehicle.")        \
  ROW(COUNTER, uint64_t, late, "Turns that began at least a whole period late.")

/// Counters never decrease.
struct VehicleThreadReport {
  TESSERA_VEHICLE_THREAD_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(VehicleThreadReport, TESSERA_VEHICLE_THREAD_COUNTERS(TESSERA_COUNTER_ROW))

class VehicleThread {
 public:
  static constexpr std::int64_t kPeriod_us = 50'000;
  /// Blocks that are looked up per turn; a longer sweep continues in the next.
  static constexpr std::uint32_t kBlocksPerTurn = 4096;

  /// sensing may be null, as in a replay. All must outlive it. Fails with kUsage iff a setting of
  /// the sectors is out of its range; kFailure iff the system does not give the memory.
  static Outcome<std::unique_ptr<VehicleThread>> make(const VehicleThreadConfig& config,
                                                      const LocalMaps& maps, VehiclePort& port,
                                                      MappingThread& mapping,
                                                      const SharingThread& sharing,
                                                      SensingThread* sensing,
                                                      const SaveRequests& saves);
  VehicleThread(const VehicleThread&) = delete;
  VehicleThread& operator=(const VehicleThread&) = delete;
  ~VehicleThread() { stop(); }

  Outcome<void> start(const ThreadRole& role);
  /// From now on the vehicle is notified that the node stops.
  void say_stopping() noexcept { is_stopping_.store(true, std::memory_order_relaxed); }
  void stop() noexcept;
  /// For any thread.
  [[nodiscard]] const LatestValue<VehicleThreadReport>& report() const noexcept { return report_; }
  [[nodiscard]] Heartbeat& heartbeat() noexcept { return heartbeat_; }
  [[nodiscard]] LogQueue& log() noexcept { return log_; }

 private:
  /// Time for which it is reported that something did not fit.
  static constexpr std::int64_t kTold_us = 2'000'000;
  /// Sensors that are silent for longer are reported.
  static constexpr std::int64_t kSilentPeriods = 5;

  VehicleThread(const VehicleThreadConfig& config, const LocalMaps& maps, VehiclePort& port,
                MappingThread& mapping, const SharingThread& sharing, SensingThread* sensing,
                const SaveRequests& saves)
      : config_(config),
        reader_(maps),
        storage_bytes_(maps.map().usage().capacity_bytes),
        port_(port),
        mapping_(mapping),
        sharing_(sharing),
        sensing_(sensing),
        saves_(saves) {}
  void run() noexcept;
  void turn(std::int64_t now_us) noexcept;
  void take_commands(std::int64_t now_us) noexcept;
  void carry_out(const TakenCommand& command, std::int64_t now_us) noexcept;
  void begin(const TakenCommand& command) noexcept;
  void note_pending() noexcept;
  [[nodiscard]] PauseReason shortage(const MappingThreadState& mapping,
                                     std::int64_t now_us) noexcept;
  void watch_bus(std::int64_t now_us) noexcept;
  void sweep() noexcept;
  void tell_sectors() noexcept;
  void tell_state(std::int64_t now_us) noexcept;
  void tell_mapping(const MappingThreadState& mapping, std::int64_t now_us) noexcept;
  void tell_team(const SharingThreadState& sharing) noexcept;
  /// Sectors stay valid: they are of this robot's own map. A thread that hangs is worse.
  void tell_alarm(const SharingThreadState& sharing, std::int64_t now_us) noexcept {
    const PauseReason reason = alarm_.look(sharing.alarms(), now_us);
    if (reason == PauseReason::kNone || told_.state == MappingState::kStopping ||
        told_.state == MappingState::kFault)
      return;
    told_.state = MappingState::kFault;
    told_.pause_reason = reason;
  }
  [[nodiscard]] PauseReason pose_reason() const noexcept;
  /// True if a thread hangs that provides maps or poses.
  [[nodiscard]] bool hangs_one(std::int64_t now_us) const noexcept {
    return mapping_.heartbeat().is_late(now_us) || sharing_.heartbeat().is_late(now_us) ||
           (sensing_ != nullptr && sensing_->heartbeat().is_late(now_us));
  }
  [[nodiscard]] bool find_pose(Matrix34d& T_map_body, std::int64_t& stamp_us) const noexcept;

  VehicleThreadConfig config_;
  MapReader reader_;
  std::size_t storage_bytes_;
  VehiclePort& port_;
  MappingThread& mapping_;
  const SharingThread& sharing_;
  SensingThread* sensing_;
  const SaveRequests saves_;
  ArenaMemory memory_;
  ObstacleSectors sectors_;
  VehicleReport told_{};
  /// A command that needs more than a turn.
  struct Pending {
    VehicleCommand command = VehicleCommand::kNone;
    std::uint8_t number = 0;
    std::uint64_t done =
        0;  ///< Numbers of such commands that were done before it, and that failed.
    std::uint64_t failed = 0;
  };
  Pending pending_{};
  std::uint64_t refused_seen_ = 0;  ///< Because the map is full.
  std::int64_t refused_us_ = 0;
  TeamAlarm alarm_;
  std::uint64_t missed_seen_ = 0;
  std::int64_t missed_us_ = 0;
  std::uint64_t cycles_seen_ = 0;
  BusState bus_ = BusState::kActive;
  DurationHistogram cycles_;  ///< As reported by the mapping thread.
  std::int64_t start_us_ = 0;
  VehicleThreadReport counted_{};
  LatestValue<VehicleThreadReport> report_;
  WakeUp wake_;
  std::atomic<bool> stopping_{false};
  std::atomic<bool> is_stopping_{false};
  Heartbeat heartbeat_{"vehicle", 1'000'000};
  LogQueue log_{"vehicle"};
  Thread thread_;
};

}  // namespace tessera
