// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Heartbeats of threads, and detection of threads that do not respond.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace tessera {

/// One thread beats, any thread checks.
class Heartbeat {
 public:
  /// name: static text. silence_us: too long a time between two beats.
  Heartbeat(const char* name, std::int64_t silence_us) noexcept
      : name_(name), silence_us_(silence_us) {}
  void beat(std::int64_t now_us) noexcept { last_us_.store(now_us, std::memory_order_relaxed); }
  /// Before the first beat and after this no beat is expected.
  void rest() noexcept { last_us_.store(kResting, std::memory_order_relaxed); }
  [[nodiscard]] bool is_late(std::int64_t now_us) const noexcept {
    const std::int64_t last_us = last_us_.load(std::memory_order_relaxed);
    return last_us != kResting && now_us - last_us > silence_us_;
  }
  [[nodiscard]] const char* name() const noexcept { return name_; }

 private:
  static constexpr std::int64_t kResting = INT64_MIN;
  const char* name_;
  std::int64_t silence_us_;
  std::atomic<std::int64_t> last_us_{kResting};
};

}  // namespace tessera
