// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The loop of a robot's thread: takes datagrams as soon as they arrive, ticks periodically, sends
// what is due, and sleeps. The caller decides when.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/duration_histogram.hpp"
#include "base/monotonic_clock.hpp"
#include "node/network_port.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera {

struct LoopTimes {
  DurationHistogram ticks;      ///< Duration of a tick, including sending.
  DurationHistogram receiving;  ///< Duration of processing what had arrived, including fusing.
  std::uint64_t overruns = 0;   ///< Ticks that began at least a whole period late.
  std::int64_t worst_late_us = 0;
};

/// For one thread; no heap. sharer, maps and port must outlive it.
class RobotLoop {
 public:
  /// Datagrams that are taken at once, so that a flood does not delay ticks.
  static constexpr int kReceiveBatch = 256;
  /// Nothing else is begun in this time before something is due.
  static constexpr std::int64_t kSpare_us = 3'000;

  /// maps: are published; another thread may write to them. period_us: above 0.
  RobotLoop(Sharer& sharer, LocalMaps& maps, NetworkPort& port, std::int64_t period_us) noexcept
      : sharer_(&sharer), maps_(&maps), port_(&port), period_us_(period_us) {}
  /// Sets the time of the first tick.
  void begin(std::int64_t start_us) noexcept { due_us_ = start_us; }

  void receive(std::int64_t now_us) noexcept {
    std::array<std::byte, kMaxMessageBytes> bytes;
    int count = 0;
    for (; count < kReceiveBatch; ++count) {
      const DatagramLink::Received received = port_->receive(bytes);
      if (received.bytes.empty()) break;
      sharer_->receive(received.bytes, now_us);
    }
    if (count == 0) return;
    sharer_->fuse();
    times_.receiving.add(MonotonicClock::now_us() - now_us);
  }

  [[nodiscard]] std::int64_t tick_due_us() const noexcept { return due_us_; }
  /// Call it when a tick is due. Missed ticks are not made up for. Returns its duration.
  std::int64_t tick(std::int64_t now_us) noexcept {
    const std::int64_t late_us = now_us - due_us_;
    times_.worst_late_us = std::max(times_.worst_late_us, late_us);
    if (late_us >= period_us_) ++times_.overruns;
    due_us_ += (late_us / period_us_ + 1) * period_us_;
    static_cast<void>(sharer_->tick(*maps_, now_us));
    send(now_us);
    const std::int64_t took_us = MonotonicClock::now_us() - now_us;
    times_.ticks.add(took_us);
    return took_us;
  }

  void send(std::int64_t now_us) noexcept {
    while (true) {
      const std::span<std::byte> into = port_->claim();
      if (into.empty()) break;
      const std::size_t bytes = sharer_->send(now_us, into);
      if (bytes == 0) break;
      port_->commit(bytes);
    }
    port_->flush();
  }

  /// Waits until this time, or until a datagram or a signal arrives. Works on the global map
  /// meanwhile.
  void wait_until(std::int64_t us) noexcept {
    while (us - MonotonicClock::now_us() > kSpare_us) {
      if (port_->wait(0)) return;
      if (!sharer_->fuse_in_spare_time()) break;
    }
    static_cast<void>(port_->wait(us - MonotonicClock::now_us()));
  }

  [[nodiscard]] const LoopTimes& times() const noexcept { return times_; }

 private:
  Sharer* sharer_;
  LocalMaps* maps_;
  NetworkPort* port_;
  std::int64_t period_us_;
  std::int64_t due_us_ = 0;
  LoopTimes times_;
};

}  // namespace tessera
