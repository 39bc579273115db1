// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The thread that shares: publishes what mapping has changed, exchanges it with other robots, and
// updates the global map. It reads the local map while the mapping thread writes to it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "node/asked_places.hpp"
#include "node/mapping_thread.hpp"
#include "node/robot_loop.hpp"
#include "node/sensing_thread.hpp"
#include "node/team_alarm.hpp"
#include "settings/map_options.hpp"

namespace tessera {

/// The state after a tick.
struct SharingThreadState {
  /// As stored in RobotState.
  static constexpr std::size_t kMostFloors = 256;
  std::uint64_t ticks = 0;
  ExchangeReport exchange{};
  std::uint32_t in_reach = 0;  ///< Robots that were heard within kReach_us and have not left.
  std::uint32_t matching =
      0;  ///< Robots that were heard and have the same configuration, gone or not.
  std::uint32_t agreeing = 0;  ///< Exchange::peers_agreeing().
  std::uint64_t digest = 0;    ///< Exchange::digest().
  SubmapReport submap{};
  std::uint32_t waiting = 0;  ///< Blocks of the global map that wait for work.
  MapUsage global{};
  std::uint64_t overtaken = 0;  ///< Exchange::overtaken() plus one; 0: none.
  std::uint64_t highest_session_heard = 0;
  std::array<RobotFloor, kMostFloors> floors{};  ///< Of other robots, as far as they fit.
  std::uint32_t floor_count = 0;
  std::uint64_t floors_refused = 0;  ///< Most robots at one time whose floors did not fit.
  /// Contributions with proofs of conflicts, in the order of their arrival.
  std::array<ContributionId, Conflicts::kMost> conflicts{};
  std::uint32_t conflict_count = 0;
  /// Maps of earlier days in the global map, each once, as far as they fit.
  std::array<MapSession, 2 * MapSession::kMostOfRobot> sessions{};
  std::uint32_t session_count = 0;
  GlobalMapReport global_counts{};  ///< GlobalMap::counters().
  bool idle = false;                ///< Nothing waits to be published or fused.
  std::int64_t quiet_since_us = 0;  ///< Time since which nothing was published, heard or answered.

  /// Datagrams and claims of another process that uses this robot's number.
  [[nodiscard]] std::uint64_t twins() const noexcept {
    return exchange.refused_robot + exchange.impostors;
  }
  [[nodiscard]] TeamCounters alarms() const noexcept {
    return {twins(), exchange.twins, exchange.conflicts};
  }
};

/// Called after each tick, in the sharing thread.
struct EachTick {
  void* context = nullptr;
  void (*call)(void* context, std::int64_t now_us) = nullptr;
};

/// The frames of this robot's submaps, with their poses.
struct SubmapFramesState {
  static constexpr std::size_t kMost = kMostSubmapsOfRobot;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  std::uint32_t revision = 0;  ///< Of the last correction.
  std::array<SubmapFrame, kMost> frames{};

  /// Of a sharer, as far as they fit.
  void take(const SubmapFrames& all) noexcept;
};

class SharingThread {
 public:
  static constexpr std::int64_t kReach_us = 3'000'000;

  /// All must outlive it. mapping: its maps are shared.
  SharingThread(Sharer& sharer, LocalMaps& maps, const MappingThread& mapping, NetworkPort& port,
                std::int64_t tick_us, const EachTick& each_tick) noexcept
      : sharer_(sharer),
        maps_(maps),
        mapping_(mapping),
        each_tick_(each_tick),
        loop_(sharer, maps, port, tick_us) {}
  SharingThread(const SharingThread&) = delete;
  SharingThread& operator=(const SharingThread&) = delete;
  ~SharingThread() { stop(); }

  Outcome<void> start(const ThreadRole& role, std::int64_t start_us);
  /// Before start(): places that matter beside the robot's own. It must outlive the thread.
  void follow(const LatestValue<AskedPlaces>& asked) noexcept { asked_ = &asked; }
  /// The same: where the robot's body is, as often as it is known; else it is known from scans.
  void follow(const LatestValue<SensingThreadState>& sensing) noexcept { sensing_ = &sensing; }
  /// Announces that this robot leaves, and ends within a tick.
  void stop() noexcept;

  /// Must not be silent for long.
  [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
  [[nodiscard]] const LatestValue<SharingThreadState>& state() const noexcept { return state_; }
  /// As of the last tick where frames have changed; poses within a second.
  [[nodiscard]] const LatestValue<SubmapFramesState>& frames() const noexcept { return frames_; }
  /// The other robots, as of the last tick.
  [[nodiscard]] const LatestValue<TeammatesState>& teammates() const noexcept { return teammates_; }
  /// What the next scan is to tell of, as of the last tick.
  [[nodiscard]] const LatestValue<WatchedState>& watched() const noexcept { return watched_; }
  /// Leaves the epoch with the next tick, as Sharer::reopen. For any thread.
  void ask_to_reopen(std::uint32_t epoch, std::uint32_t floor) noexcept {
    reopen_.store(std::uint64_t{epoch} << 32U | floor, std::memory_order_release);
  }
  /// Ticks since the last call; for the thread itself, in each_tick.
  [[nodiscard]] DurationHistogram& second() noexcept { return second_; }
  /// After stop(), and in each_tick.
  [[nodiscard]] const LoopTimes& times() const noexcept { return loop_.times(); }

 private:
  /// Changes whenever anything new is sent or received.
  struct Activity {
    std::uint64_t taken = 0;
    std::uint64_t published = 0;
    std::uint64_t chunks = 0;
    std::uint64_t contributions = 0;
    friend bool operator==(const Activity&, const Activity&) = default;
  };
  void run() noexcept;
  void tick(std::int64_t now_us) noexcept;
  void note_status(std::int64_t now_us) noexcept;
  void note_sessions() noexcept;
  void note_frames(std::int64_t now_us) noexcept;
  void note_asked(std::int64_t now_us) noexcept;
  void note_place(const MappingThreadState& mapping) noexcept;
  void note_teammates(const MappingThreadState& mapping, std::int64_t now_us) noexcept;
  void note_seen() noexcept;
  void ask_of_next(const MappingThreadState& mapping, std::int64_t now_us) noexcept;

  Sharer& sharer_;
  LocalMaps& maps_;
  const MappingThread& mapping_;
  const EachTick each_tick_;
  RobotLoop loop_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> reopen_{0};  ///< The epoch, and the floor in the lower 32 bits.
  std::uint64_t scans_seen_ = 0;
  const LatestValue<AskedPlaces>* asked_ = nullptr;
  std::uint64_t asked_seen_ = 0;  ///< Its version.
  AskedPlaces route_{};
  const LatestValue<SensingThreadState>* sensing_ = nullptr;
  std::uint64_t poses_seen_ = 0;
  TeammatesState teammates_now_{};
  LatestValue<TeammatesState> teammates_;
  std::uint64_t watched_seen_ = 0;  ///< Version of what the last scan told.
  WatchedState watched_now_{};
  LatestValue<WatchedState> watched_;
  Activity activity_{};
  SharingThreadState now_{};
  LatestValue<SharingThreadState> state_;
  SubmapFramesState frames_now_{};
  std::uint32_t corrections_seen_ = 0;
  std::int64_t frames_due_us_ = 0;  ///< For poses alone.
  LatestValue<SubmapFramesState> frames_;
  /// Longer than for other threads, as it has no priority; shorter than the service manager's
  /// timeout.
  Heartbeat heartbeat_{"sharing", 3'000'000};
  DurationHistogram second_;
  Thread thread_;
};

}  // namespace tessera
