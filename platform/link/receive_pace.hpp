// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Pauses of a receiving thread, so that a flood never takes more than half of a core from the
// threads that it preempts.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tessera {

/// For one thread; no clock, no heap. Up to kFree_per_s datagrams per second there are no pauses.
/// Above it the thread takes them in batches: after each batch it pauses for as long as the batch
/// took, and at least kLeast_us. Meanwhile the socket's buffer holds what arrives.
class ReceivePace {
 public:
  static constexpr std::int64_t kFree_per_s = 4'000;
  static constexpr std::int64_t kBurst = 512;  ///< Datagrams at once, after a quiet period.
  static constexpr std::int64_t kLeast_us = 1'000;

  /// Returns how long to pause after a batch, in microseconds; 0: not at all. datagrams: taken in
  /// it, accepted or not. worked_us: CPU time that they took. now_us: monotonic.
  std::int64_t pause_us(std::int64_t datagrams, std::int64_t worked_us,
                        std::int64_t now_us) noexcept {
    // Longer ago has the same effect.
    constexpr std::int64_t kLongest_us = 1'000'000;
    const std::int64_t passed_us = std::clamp<std::int64_t>(now_us - last_us_, 0, kLongest_us);
    last_us_ = now_us;
    // In millionths of a datagram, so that no part of one is lost.
    excess_ = std::max<std::int64_t>(excess_ - passed_us * kFree_per_s, 0);
    excess_ = std::min(excess_ + datagrams * kMillion, 2 * kBurst * kMillion);
    return excess_ > kBurst * kMillion ? std::max(kLeast_us, worked_us) : 0;
  }

 private:
  static constexpr std::int64_t kMillion = 1'000'000;
  std::int64_t excess_ = 0;
  std::int64_t last_us_ = 0;
};

}  // namespace tessera
