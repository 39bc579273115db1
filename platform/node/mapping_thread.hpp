// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The thread that maps: takes a scan as soon as it arrives, integrates it within its time budget,
// and reports. Between its start and its end it makes no system calls except to sleep and to wake
// (with an archive: and to read and write its file), allocates no memory, takes no lock, and waits
// for no other thread; but where it may wait, until blocks have left the map.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>

#include "base/duration_histogram.hpp"
#include "base/heartbeat.hpp"
#include "base/latest_value.hpp"
#include "base/log.hpp"
#include "base/memory_lock.hpp"
#include "base/thread.hpp"
#include "base/wake_up.hpp"
#include "node/teammates_state.hpp"
#include "node/watched_state.hpp"
#include "scans/registrar.hpp"
#include "scans/scan_source.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera {

/// Reasons for which the thread does not integrate, a bit each; 0: none.
enum MappingPause : std::uint32_t {
  kPausedByCommand = 1U << 0U,
  kPausedByPose = 1U << 1U,  ///< There is no usable pose.
  kPausedToSave = 1U << 2U,
  kPausedByNewFrame = 1U << 3U,  ///< Poses are in another frame than the map.
  kPausedToKeep = 1U << 4U,      ///< The map is saved before it is cleared.
};

/// The state after a cycle; counters never decrease.
struct MappingThreadState {
  std::uint64_t cycles = 0;  ///< Scans that were integrated.
  ScanTotals scans{};        ///< Of their reports.
  std::uint64_t shed = 0;    ///< Scans with something left out.
  std::uint64_t bad_poses = 0;
  std::uint64_t paused = 0;    ///< Scans that came while mapping paused, and were left out.
  std::uint64_t missed = 0;    ///< Cycles that took longer than the period.
  std::uint64_t late = 0;      ///< Scans that had waited for more than a period.
  std::uint64_t clears = 0;    ///< Times that the map was cleared.
  std::int64_t waited_us = 0;  ///< For the archive, and for what is published, to make room.
  std::int64_t last_cycle_us = 0;
  std::int64_t worst_cycle_us = 0;
  std::int64_t worst_late_us = 0;         ///< From the arrival of a scan to the begin of its cycle.
  std::int64_t stamp_us = 0;              ///< Of the last scan that was integrated.
  std::int64_t taken_us = 0;              ///< When it arrived.
  std::int64_t first_us = 0;              ///< End of the first; 0 before it.
  std::int64_t end_us = 0;                ///< End of the last.
  std::uint32_t pause = 0;                ///< MappingPause.
  std::array<double, 12> T_map_sensor{};  ///< Of the last scan, row by row; all 0 before it.
  std::array<double, 12> T_map_body{};    ///< The same; of a recording without a body, the sensor.
  std::uint32_t submap = 0;               ///< That it was mapped into.
  SubmapCounts submaps{};
  SubmapNote submap_note{};        ///< Of that submap so far.
  std::uint32_t map_revision = 0;  ///< LocalMap::revision of its map.
  MapUsage usage{};
  WindowReport window{};
};

struct MappingConfig {
  std::int64_t period_us = 100'000;
  bool has_body = false;  ///< Scans have Scan::T_map_body.
  bool may_wait = false;  ///< Before a scan, until the window has made room for it.
};

class MappingThread {
 public:
  /// All must outlive it. The thread owns the map from start() to stop(), except for readers. wake:
  /// the source wakes the thread by it.
  MappingThread(Mapper& mapper, ScanSource& source, WakeUp& wake, const MappingConfig& config,
                Registrar& registrar) noexcept
      : mapper_(mapper), source_(source), wake_(wake), config_(config), registrar_(registrar) {}
  MappingThread(const MappingThread&) = delete;
  MappingThread& operator=(const MappingThread&) = delete;
  ~MappingThread() { stop(); }

  Outcome<void> start(const ThreadRole& role);
  /// Before start(): where other robots are, and what they have; they must outlive the thread.
  void follow(const LatestValue<TeammatesState>& teammates,
              const LatestValue<WatchedState>& watched) noexcept {
    teammates_ = &teammates;
    watched_ = &watched;
  }
  void stop() noexcept;

  // --- For other threads -------------------------------------------------------------------------

  /// Sets or clears a reason to pause; takes effect after the current cycle, when has_taken() of
  /// the returned value is true.
  std::uint64_t pause(MappingPause reason, bool on) noexcept;
  /// True if this call of pause() has taken effect. If it set a reason, the thread does not change
  /// the map until the reason is cleared: all of it may be read.
  [[nodiscard]] bool has_taken(std::uint64_t call) const noexcept {
    return taken_.load(std::memory_order_acquire) >> 32U >= call >> 32U;
  }
  [[nodiscard]] bool paused() const noexcept {
    return (taken_.load(std::memory_order_acquire) & kReasons) != 0;
  }
  /// Requests that the map be cleared. Mapping pauses from now on, until the map is saved and
  /// permit_clear() is called. MappingThreadState::clears says when it was cleared.
  void clear_map() noexcept {
    clears_asked_.fetch_add(1, std::memory_order_relaxed);
    pause(kPausedToKeep, true);
  }
  /// Poses are in another frame from now on: the next scan begins a submap. False: there are no
  /// submaps, and nothing is done.
  bool note_jump() noexcept {
    if (!mapper_.maps().in_submaps()) return false;
    mapper_.end_submap(SubmapEnd::kJump);
    return true;
  }
  /// Number of calls of clear_map().
  [[nodiscard]] std::uint32_t clears_asked() const noexcept {
    return clears_asked_.load(std::memory_order_acquire);
  }
  /// Lets the thread clear the map before the next scan, also while it pauses, except to save.
  /// clears: value of clears_asked() before the map was saved.
  void permit_clear(std::uint32_t clears) noexcept {
    clears_permitted_.store(clears, std::memory_order_release);
    if (clears_asked() == clears) pause(kPausedToKeep, false);
  }
  [[nodiscard]] const LatestValue<MappingThreadState>& state() const noexcept { return state_; }
  /// What the last scan told of what was watched.
  [[nodiscard]] const LatestValue<WatchedState>& seen() const noexcept { return seen_; }
  [[nodiscard]] Heartbeat& heartbeat() noexcept { return heartbeat_; }
  [[nodiscard]] LogQueue& log() noexcept { return log_; }
  /// True if all scans are processed and no more will come.
  [[nodiscard]] bool ended() const noexcept { return ended_.load(std::memory_order_acquire); }

  // --- After stop() ------------------------------------------------------------------------------

  [[nodiscard]] const DurationHistogram& cycles() const noexcept { return cycles_; }
  /// From the arrival of a scan until it is in the map.
  [[nodiscard]] const DurationHistogram& latencies() const noexcept { return latencies_; }
  /// From start to end of its work.
  [[nodiscard]] PageFaults page_faults() const noexcept { return page_faults_; }
  /// Its number in the system.
  [[nodiscard]] std::int64_t thread_number() const noexcept { return thread_number_; }

 private:
  /// Beats once per cycle or sleep, which take a period each; a slow cycle does not count as
  /// silence.
  static constexpr std::int64_t silence_us(std::int64_t period_us) noexcept {
    return std::max<std::int64_t>(2'000'000, 2 * period_us);
  }
  void run() noexcept;
  void work() noexcept;
  void take(Scan& scan, std::int64_t now_us) noexcept;
  void wait_for_room(const ScanView& view, std::int64_t now_us) noexcept;
  static constexpr std::uint64_t kReasons = 0xffff'ffffU;
  void note_pause(std::int64_t now_us) noexcept;
  void clear_if_permitted() noexcept;
  void say_window(std::int64_t now_us) noexcept;
  void say_submaps(std::int64_t now_us) noexcept;
  void say_losses(const ScanReport& report, std::int64_t now_us) noexcept;

  Mapper& mapper_;
  ScanSource& source_;
  WakeUp& wake_;
  const MappingConfig config_;
  Registrar& registrar_;
  const LatestValue<TeammatesState>* teammates_ = nullptr;
  TeammatesState teammates_now_{};
  const LatestValue<WatchedState>* watched_ = nullptr;
  WatchedState watched_now_{};
  LatestValue<WatchedState> seen_;
  std::array<PlacedBox, TeammatesState::kMost> boxes_{};
  std::atomic<bool> stopping_{false};
  /// Reasons, and in the upper bits the number of calls of pause(): requested, and in effect.
  std::atomic<std::uint64_t> pause_{0};
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<std::uint32_t> clears_asked_{0};
  std::atomic<std::uint32_t> clears_permitted_{0};
  std::atomic<bool> ended_{false};
  std::uint32_t cleared_ = 0;
  MappingThreadState now_{};
  LatestValue<MappingThreadState> state_;
  Heartbeat heartbeat_{"mapping", silence_us(config_.period_us)};
  LogQueue log_{"mapping"};
  DurationHistogram cycles_;
  DurationHistogram latencies_;
  PageFaults page_faults_{};
  std::int64_t thread_number_ = 0;
  Thread thread_;
};

}  // namespace tessera
