// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/wake_up.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>

#include "base/monotonic_clock.hpp"

namespace tessera {

void WakeUp::wake() noexcept {
  if (state_.exchange(kWoken, std::memory_order_acq_rel) != kAsleep) return;
  ::syscall(SYS_futex, &state_, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
}

bool WakeUp::sleep_until(std::int64_t until_us) noexcept {
  std::uint32_t expected = kAwake;
  if (state_.compare_exchange_strong(expected, kAsleep, std::memory_order_acq_rel)) {
    const timespec until{.tv_sec = until_us / 1'000'000, .tv_nsec = until_us % 1'000'000 * 1'000};
    long result = 0;
    do {
      // The time is absolute, so that an interrupted sleep continues unchanged.
      result = ::syscall(SYS_futex, &state_, FUTEX_WAIT_BITSET_PRIVATE, kAsleep, &until, nullptr,
                         FUTEX_BITSET_MATCH_ANY);
    } while (result != 0 && errno == EINTR);
  }
  return state_.exchange(kAwake, std::memory_order_acq_rel) == kWoken;
}

}  // namespace tessera
