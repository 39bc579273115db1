// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Points in time and spans between them, on a monotonic clock that may start anywhere, below zero
// too. "Never" and "long ago" have names, so that no number stands for them.
#pragma once

#include <compare>
#include <cstdint>
#include <limits>

namespace tessera {

/// A span of time in microseconds.
struct Duration {
  std::int64_t us = 0;
  friend constexpr auto operator<=>(const Duration&, const Duration&) = default;
  friend constexpr Duration operator+(Duration a, Duration b) noexcept { return {a.us + b.us}; }
  friend constexpr Duration operator*(std::int64_t factor, Duration a) noexcept {
    return {factor * a.us};
  }
  friend constexpr Duration operator/(Duration a, std::int64_t divisor) noexcept {
    return {a.us / divisor};
  }
};

/// A point in time. Sums and differences stop at the limits: what is never due stays so.
class Instant {
 public:
  /// long_ago().
  constexpr Instant() noexcept = default;
  [[nodiscard]] static constexpr Instant at_us(std::int64_t us) noexcept { return Instant(us); }
  /// Before every time that a clock gives.
  [[nodiscard]] static constexpr Instant long_ago() noexcept { return Instant(kLeast); }
  /// After every time that a clock gives.
  [[nodiscard]] static constexpr Instant never() noexcept { return Instant(kMost); }
  [[nodiscard]] constexpr std::int64_t us() const noexcept { return us_; }

  friend constexpr auto operator<=>(const Instant&, const Instant&) = default;
  friend constexpr Instant operator+(Instant at, Duration later) noexcept {
    if (at == never() || at == long_ago()) return at;
    if (later.us > 0) return Instant(at.us_ > kMost - later.us ? kMost : at.us_ + later.us);
    return Instant(at.us_ < kLeast - later.us ? kLeast : at.us_ + later.us);
  }
  /// From earlier to later; the largest span where either is a limit.
  friend constexpr Duration operator-(Instant later, Instant earlier) noexcept {
    if (earlier.us_ < 0 && later.us_ > kMost + earlier.us_) return {kMost};
    if (earlier.us_ > 0 && later.us_ < kLeast + earlier.us_) return {kLeast};
    return {later.us_ - earlier.us_};
  }

 private:
  static constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  static constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  explicit constexpr Instant(std::int64_t us) noexcept : us_(us) {}
  std::int64_t us_ = kLeast;
};

}  // namespace tessera
