// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The scans of a dataset at a given rate, read ahead by a separate thread. None is left out: if
// mapping is late, reading waits for it.
#pragma once

#include <atomic>
#include <memory>

#include "base/spsc_queue.hpp"
#include "base/thread.hpp"
#include "base/wake_up.hpp"
#include "scans/dataset.hpp"
#include "scans/scan_source.hpp"

namespace tessera {

struct ReplayConfig {
  double rate_hz = 10.0;  ///< 0: as fast as possible.
  bool loop = false;
  double start_delay_s = 0.0;
};

class ReplaySource final : public ScanSource {
 public:
  /// Number of scans that are read ahead.
  static constexpr std::size_t kSlots = 4;

  /// dataset, mapping: must outlive it; each scan wakes mapping. Allocates all memory.
  ReplaySource(const Dataset& dataset, const ReplayConfig& config, WakeUp& mapping);
  ~ReplaySource() { stop(); }

  /// The first scan is due start_delay_s after start_us. Fails as Thread::start.
  Outcome<void> start(const ThreadRole& role, std::int64_t start_us);
  void stop() noexcept;
  /// Why it ended early: a scan could not be read. After ended() or stop().
  [[nodiscard]] const Outcome<void>& outcome() const noexcept { return outcome_; }

  [[nodiscard]] ScanSlot* front() noexcept override { return queue_.front(); }
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

 private:
  void read_until_stopped() noexcept;
  /// Waits until this time or stop().
  void wait_until(std::int64_t us) noexcept;
  [[nodiscard]] bool read_next();

  const Dataset& dataset_;
  ReplayConfig config_;
  WakeUp& mapping_;
  WakeUp reader_;
  ScanBuffer buffer_;
  SpscQueue<ScanSlot> queue_;
  std::atomic<bool> stopping_{false};
  std::atomic<bool> read_all_{false};
  std::atomic<std::uint64_t> offered_{0};
  std::atomic<std::uint64_t> unknown_ids_{0};
  std::int64_t first_us_ = 0;
  std::size_t next_ = 0;
  Outcome<void> outcome_;
  Thread thread_;
};

}  // namespace tessera
