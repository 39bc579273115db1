// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How one thread wakes another that sleeps, at once or at a time at the latest. Whoever wakes does
// not wait; it asks the system only where somebody sleeps.
#pragma once

#include <atomic>
#include <cstdint>

namespace tessera {

/// One thread sleeps, any wake it. What was announced before the sleep begins ends it at once.
class WakeUp {
 public:
  WakeUp() = default;
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;

  /// Ends the sleep that is or comes next.
  void wake() noexcept;
  /// Sleeps until somebody wakes it or MonotonicClock shows until_us; true iff it was woken. One
  /// system call, none if it was woken already.
  bool sleep_until(std::int64_t until_us) noexcept;

 private:
  static constexpr std::uint32_t kAwake = 0;
  static constexpr std::uint32_t kAsleep = 1;
  static constexpr std::uint32_t kWoken = 2;
  std::atomic<std::uint32_t> state_{kAwake};
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free);
};

}  // namespace tessera
