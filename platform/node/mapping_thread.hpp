// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The thread that maps: takes a scan as soon as it is there, integrates it within its budget of
// time, and says what it did. Between its start and its end it asks nothing of the system but to
// sleep and to wake, takes no memory and no lock, and waits for no other thread.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>

#include "node/scan_source.hpp"
#include "posix/duration_histogram.hpp"
#include "posix/heartbeat.hpp"
#include "posix/latest_value.hpp"
#include "posix/log.hpp"
#include "posix/memory_lock.hpp"
#include "posix/thread.hpp"
#include "posix/wake_up.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera {

/// Why the thread integrates nothing, a bit each; 0: it does.
enum MappingPause : std::uint32_t {
  kPausedByCommand = 1U << 0U,
  kPausedByPose = 1U << 1U,  ///< There is none that may be mapped with.
  kPausedToSave = 1U << 2U,
  kPausedByNewFrame = 1U << 3U,  ///< Poses are of another frame than the map.
  kPausedToKeep = 1U << 4U,      ///< The map is saved before it is cleared.
};

/// How things stand after a cycle; counters never decrease.
struct MappingStatus {
  std::uint64_t cycles = 0;          ///< Scans that were integrated.
  std::uint64_t points = 0;          ///< Of these.
  std::uint64_t left_out = 0;        ///< Points and rays: ScanReport::left_out.
  std::uint64_t thinned = 0;         ///< Points after thinning: ScanReport, as the next two.
  std::uint64_t points_kept = 0;     ///< Of these.
  std::uint64_t rays_wanted = 0;     ///< ScanReport::rays_wanted.
  std::uint64_t rays = 0;            ///< Of these, traced.
  std::uint64_t shed = 0;            ///< Scans of which something was left out.
  std::uint64_t refused_memory = 0;  ///< Of left_out: for want of memory,
  std::uint64_t refused_work = 0;    ///< as the work budget was spent,
  std::uint64_t refused_time = 0;    ///< as the deadline came, or was foreseen,
  std::uint64_t over_capacity = 0;   ///< as a scan had more points than there is room for.
  std::uint64_t bad_poses = 0;
  std::uint64_t paused = 0;  ///< Scans that came while mapping paused, and were left out.
  std::uint64_t missed = 0;  ///< Cycles that took longer than the period.
  std::uint64_t late = 0;    ///< Scans that had waited for more than a period.
  std::uint64_t clears = 0;  ///< Times that the map was cleared.
  std::int64_t last_cycle_us = 0;
  std::int64_t worst_cycle_us = 0;
  std::int64_t worst_late_us = 0;         ///< From a scan's arrival to the begin of its cycle.
  std::int64_t stamp_us = 0;              ///< Of the last scan that was integrated.
  std::int64_t first_us = 0;              ///< When the first was done; 0 before it.
  std::int64_t end_us = 0;                ///< When the last was.
  std::uint32_t pause = 0;                ///< MappingPause.
  std::array<double, 12> T_map_sensor{};  ///< Of the last scan, row by row; all 0 before it.
  MapUsage usage{};
};

struct MappingConfig {
  std::int64_t period_us = 100'000;
};

/// Makes a view for the integrator of what a sensor gave. Of the mapping thread.
struct Registration {
  void* context = nullptr;
  /// None: the slot as it is. False: nothing can be made of it.
  bool (*view)(void* context, ScanSlot& slot, ScanView& into) = nullptr;
};

class MappingThread {
 public:
  /// All must outlive it. The map is the thread's own from start() to stop(), but for readers.
  /// wake: by which the source wakes it.
  MappingThread(Mapper& mapper, ScanSource& source, WakeUp& wake, const MappingConfig& config,
                const Registration& registration) noexcept
      : mapper_(mapper),
        source_(source),
        wake_(wake),
        config_(config),
        registration_(registration) {}
  MappingThread(const MappingThread&) = delete;
  MappingThread& operator=(const MappingThread&) = delete;
  ~MappingThread() { stop(); }

  Outcome<void> start(const ThreadRole& role);
  void stop() noexcept;

  // --- For other threads -------------------------------------------------------------------------

  /// Sets or takes back a reason to pause; begins after the cycle at hand: has_taken() of what this
  /// returns says when.
  std::uint64_t pause(MappingPause reason, bool on) noexcept;
  /// Whether the thread goes by this call of pause(). If that set a reason, the map is left alone
  /// until it is taken back: all of it may be read.
  [[nodiscard]] bool has_taken(std::uint64_t call) const noexcept {
    return taken_.load(std::memory_order_acquire) >> 32U >= call >> 32U;
  }
  [[nodiscard]] bool paused() const noexcept {
    return (taken_.load(std::memory_order_acquire) & kReasons) != 0;
  }
  /// Asks that all content be forgotten. Mapping pauses from here on, until somebody has saved the
  /// map and calls permit_clear(). MappingStatus::clears says when it was cleared.
  void clear_map() noexcept {
    clears_asked_.fetch_add(1, std::memory_order_relaxed);
    pause(kPausedToKeep, true);
  }
  /// How often clear_map() was called.
  [[nodiscard]] std::uint32_t clears_asked() const noexcept {
    return clears_asked_.load(std::memory_order_acquire);
  }
  /// The map is forgotten before the next scan and also while it pauses, but to save. clears: what
  /// clears_asked() gave before the map was saved.
  void permit_clear(std::uint32_t clears) noexcept {
    clears_permitted_.store(clears, std::memory_order_release);
    if (clears_asked() == clears) pause(kPausedToKeep, false);
  }
  [[nodiscard]] const LatestValue<MappingStatus>& status() const noexcept { return status_; }
  [[nodiscard]] Heartbeat& heartbeat() noexcept { return heartbeat_; }
  [[nodiscard]] LogQueue& log() noexcept { return log_; }
  /// Every scan that there was is done with.
  [[nodiscard]] bool ended() const noexcept { return ended_.load(std::memory_order_acquire); }

  // --- After stop() ------------------------------------------------------------------------------

  [[nodiscard]] const DurationHistogram& cycles() const noexcept { return cycles_; }
  /// From a scan's arrival until it is in the map.
  [[nodiscard]] const DurationHistogram& latencies() const noexcept { return latencies_; }
  /// Between start and end of its work.
  [[nodiscard]] PageFaults page_faults() const noexcept { return page_faults_; }
  /// As the system knows it.
  [[nodiscard]] std::int64_t thread_number() const noexcept { return thread_number_; }

 private:
  /// It beats once a cycle or a sleep, which take a period each; a slow cycle is no silence.
  static constexpr std::int64_t silence_us(std::int64_t period_us) noexcept {
    return std::max<std::int64_t>(2'000'000, 2 * period_us);
  }
  void run() noexcept;
  void work() noexcept;
  void take(ScanSlot& slot, std::int64_t now_us) noexcept;
  static constexpr std::uint64_t kReasons = 0xffff'ffffU;
  void note_pause(std::int64_t now_us) noexcept;
  void clear_if_permitted() noexcept;
  void say_losses(const ScanReport& report, std::int64_t now_us) noexcept;

  Mapper& mapper_;
  ScanSource& source_;
  WakeUp& wake_;
  const MappingConfig config_;
  const Registration registration_;
  std::atomic<bool> stopping_{false};
  /// Reasons, and above them how often pause() was called: as asked for, and as gone by.
  std::atomic<std::uint64_t> pause_{0};
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<std::uint32_t> clears_asked_{0};
  std::atomic<std::uint32_t> clears_permitted_{0};
  std::atomic<bool> ended_{false};
  std::uint32_t cleared_ = 0;
  MappingStatus now_{};
  LatestValue<MappingStatus> status_;
  Heartbeat heartbeat_{"mapping", silence_us(config_.period_us)};
  LogQueue log_{"mapping"};
  DurationHistogram cycles_;
  DurationHistogram latencies_;
  PageFaults page_faults_{};
  std::int64_t thread_number_ = 0;
  Thread thread_;
};

}  // namespace tessera
