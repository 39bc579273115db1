// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Monotonic time for durations and deadlines; its zero is arbitrary (on Linux, the last boot), and
// it is not related to the time of day.
#pragma once

#include <time.h>

#include <cmath>
#include <cstdint>

namespace tessera {

struct MonotonicClock {
  /// Microseconds.
  [[nodiscard]] static std::int64_t now_us() noexcept {
    timespec now{};
    // Cannot fail: the clock is known and the pointer valid.
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000 + std::int64_t{now.tv_nsec} / 1'000;
  }
};

/// Rounded to the nearest whole number.
[[nodiscard]] inline std::int64_t microseconds(double seconds) noexcept {
  return std::llround(seconds * 1e6);
}

}  // namespace tessera
