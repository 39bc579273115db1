// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The scans of a recording at a given rate, read ahead by a separate thread, as the time for
// reading files and images varies. None is left out: if their user is late, reading waits for it.
#pragma once

#include <atomic>
#include <memory>

#include "base/spsc_queue.hpp"
#include "base/thread.hpp"
#include "base/wake_up.hpp"
#include "scans/recorded_source.hpp"

namespace tessera {

struct ReplayConfig {
  double rate_hz = 10.0;  ///< 0: as fast as possible.
  ScanOrder order = ScanOrder::kOnce;
  double start_delay_s = 0.0;
};

class ReplaySource final : public ScanSource {
 public:
  /// Number of scans that are read ahead.
  static constexpr std::size_t kSlots = 4;

  /// scans, user: must outlive it, and registrar, which may be null; each scan wakes the user.
  /// Allocates all memory, except for what RecordedSource::front() uses.
  ReplaySource(const RecordedScans& scans, const ReplayConfig& config, WakeUp& user,
               Registrar* registrar = nullptr);
  ~ReplaySource() { stop(); }

  /// The first scan is due start_delay_s after start_us. Fails as Thread::start.
  Outcome<void> start(const ThreadRole& role, std::int64_t start_us);
  void stop() noexcept;
  /// After ended() or stop().
  [[nodiscard]] const Outcome<void>& outcome() const noexcept override { return from_.outcome(); }

  [[nodiscard]] Scan* front() noexcept override { return queue_.front(); }
  void pop() noexcept override {
    queue_.pop();
    reader_.wake();
  }
  [[nodiscard]] bool ended() const noexcept override {
    return read_all_.load(std::memory_order_acquire) && queue_.size() == 0;
  }
  [[nodiscard]] SourceCounters counters() const noexcept override {
    return {.offered = offered_.load(std::memory_order_relaxed),
            .lost = 0,
            .unknown_ids = unknown_ids_.load(std::memory_order_relaxed)};
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;
  [[nodiscard]] const ScanLimits& limits() const noexcept { return limits_; }

 private:
  void read_until_stopped() noexcept;
  /// Waits until this time or stop().
  void wait_until(std::int64_t us) noexcept;
  [[nodiscard]] bool read_next() noexcept;

  const ReplayConfig config_;
  const ScanLimits limits_;
  WakeUp& user_;
  WakeUp reader_;
  RecordedSource from_;
  SpscQueue<Scan> queue_;
  std::atomic<bool> stopping_{false};
  std::atomic<bool> read_all_{false};
  std::atomic<std::uint64_t> offered_{0};
  std::atomic<std::uint64_t> unknown_ids_{0};
  std::int64_t first_us_ = 0;
  Thread thread_;
};

}  // namespace tessera
