// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The thread that receives sensor data and poses, and gives complete scans to the mapping thread.
// Poses come over LCM, or from the vehicle's bus; in both cases a guard judges them, and mapping
// pauses while none is usable.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>

#include "base/latest_value.hpp"
#include "node/mapping_thread.hpp"
#include "scans/scan_source.hpp"
#include "scans/sensor_port.hpp"
#include "vehicle/pose_guard.hpp"
#include "vehicle/vehicle_port.hpp"

namespace tessera {

/// The pose of the robot, and whether it is usable.
struct SensingThreadState {
  PoseVerdict verdict =
      PoseVerdict::kNone;               ///< Of poses over LCM; those of the bus have their own.
  std::int64_t stamp_us = 0;            ///< Of the last pose that was used, MonotonicClock.
  std::array<double, 12> T_map_body{};  ///< Row by row.
  std::uint64_t poses = 0;              ///< Used poses.
  std::uint64_t refused = 0;            ///< Refused by the guard.
  std::uint64_t pauses = 0;             ///< Times that poses became unusable.
  std::uint64_t relocations = 0;        ///< Times that poses changed to another frame.
  std::uint64_t silences = 0;           ///< Times that no scan came for kSilence_us.
};

class SensingThread final : public ScanSource {
 public:
  /// vehicle: may be null, else it has the motion of the robot, and with poses_by_bus its poses;
  /// must outlive it. Fails as SensorPort::open.
  static Outcome<std::unique_ptr<SensingThread>> open(const SensorPortConfig& config,
                                                      const PoseGuardConfig& guard,
                                                      VehiclePort* vehicle, bool poses_by_bus);
  ~SensingThread() { stop(); }

  /// Both must outlive it. Fails as Thread::start.
  Outcome<void> start(const ThreadRole& role, MappingThread& mapping, WakeUp& mapping_wake);
  void stop() noexcept;

  [[nodiscard]] Scan* front() noexcept override { return port_->front(); }
  void pop() noexcept override { port_->pop(); }
  [[nodiscard]] bool ended() const noexcept override { return false; }
  [[nodiscard]] SourceCounters counters() const noexcept override;

  /// As SensorPort::correction and pop_correction: for the sharing thread.
  [[nodiscard]] const CorrectionMessage* correction() noexcept { return port_->correction(); }
  void pop_correction() noexcept { port_->pop_correction(); }

  // For any thread.
  [[nodiscard]] const LatestValue<SensingThreadState>& state() const noexcept { return state_; }
  [[nodiscard]] SensorReport report() const noexcept { return port_->report(); }
  /// The map continues one of an earlier start, whose last pose and stamp, of the sensors' clock,
  /// or 0 of another clock, these were: a first pose that cannot follow is in another frame. Before
  /// start().
  void continue_from(const std::array<double, 12>& T_map_body, std::int64_t stamp_us) noexcept;
  [[nodiscard]] Heartbeat& heartbeat() noexcept { return heartbeat_; }
  [[nodiscard]] LogQueue& log() noexcept { return log_; }
  /// The current time of the sensors' clock.
  [[nodiscard]] std::int64_t stamp_now_us() const noexcept { return port_->stamp_now_us(); }

 private:
  /// Between two checks of the poses.
  static constexpr std::int64_t kTurn_us = 20'000;
  /// Sensors without a scan for this time are reported as silent.
  static constexpr std::int64_t kSilence_us = 1'000'000;
  /// Between two lines about a lasting problem.
  static constexpr std::int64_t kSayAgain_us = 5'000'000;

  SensingThread(const SensorPortConfig& config, const PoseGuardConfig& guard, VehiclePort* vehicle,
                bool poses_by_bus)
      : guard_(guard),
        vehicle_(vehicle),
        limits_(guard),
        poses_by_bus_(poses_by_bus),
        most_between_poses_us_(std::min(
            {guard.timeout_us, config.matcher.max_pose_gap_us, config.matcher.max_wait_us})) {}

  void run() noexcept;
  bool may_use(const PoseMessage& pose, std::int64_t stamp_now_us) noexcept;
  void take_vehicle_poses() noexcept;
  void note(const StampedPose& pose) noexcept;
  void note_relocations(std::uint64_t relocations) noexcept;
  [[nodiscard]] bool follows_last(const Matrix34d& T_map_body) const noexcept;
  void begin_frame() noexcept;
  [[nodiscard]] bool poses_are_good() noexcept;
  void pause_or_go_on() noexcept;
  void watch_sensors(const SensorReport& report, std::int64_t now_us) noexcept;
  void say_silence(const SensorReport& report, std::int64_t now_us) noexcept;
  void hear_pose(std::int64_t stamp_us, std::int64_t now_us) noexcept;
  void say_poses_are_seldom(const MatchReport& match, std::int64_t now_us) noexcept;

  std::unique_ptr<SensorPort> port_;
  PoseGuard guard_;
  VehiclePort* vehicle_;
  PoseGuardConfig limits_;
  /// Pose and stamp of an earlier start, until the first pose of this one.
  std::optional<StampedPose> last_;
  bool poses_by_bus_;
  MappingThread* mapping_ = nullptr;
  WakeUp* mapping_wake_ = nullptr;
  bool was_good_ = true;
  MatchReport match_{};                 ///< State of the previous turn.
  std::int64_t scan_us_ = 0;            ///< When the last scan was given out.
  bool sensors_silent_ = false;         ///< There was no scan for too long.
  std::int64_t silence_due_us_ = 0;     ///< When to log it again.
  std::int64_t most_between_poses_us_;  ///< With a larger gap scans find no pose.
  std::int64_t pose_heard_us_ = 0;      ///< When the last one came, and its stamp.
  std::int64_t pose_stamp_us_ = 0;
  std::int64_t between_poses_us_ = 0;  ///< A running mean; 0: not known.
  std::int64_t seldom_due_us_ = 0;
  SensingThreadState now_{};
  LatestValue<SensingThreadState> state_;
  std::atomic<bool> stopping_{false};
  Heartbeat heartbeat_{"sensing", 2'000'000};
  LogQueue log_{"sensing"};
  Thread thread_;
};

}  // namespace tessera
