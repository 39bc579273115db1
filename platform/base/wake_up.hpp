// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One thread wakes another that sleeps until a time at the latest. Waking does not wait, and makes
// a system call only if the other thread sleeps.
#pragma once

#include <atomic>
#include <cstdint>

namespace tessera {

/// One thread sleeps, any thread wakes it. A wake before the sleep begins ends it at once.
class WakeUp {
 public:
  WakeUp() = default;
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;

  /// Ends the current or the next sleep.
  void wake() noexcept;
  /// Sleeps until it is woken or MonotonicClock reaches until_us; true iff it was woken. One system
  /// call, none if it was already woken.
  bool sleep_until(std::int64_t until_us) noexcept;

 private:
  static constexpr std::uint32_t kAwake = 0;
  static constexpr std::uint32_t kAsleep = 1;
  static constexpr std::uint32_t kWoken = 2;
  std::atomic<std::uint32_t> state_{kAwake};
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free);
};

}  // namespace tessera
