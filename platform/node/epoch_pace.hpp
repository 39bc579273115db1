// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How often a node may leave its epoch because another process uses it.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tessera {

/// If robots sign, the other process has this robot's key: each of the two goes above the epoch of
/// the other. The pause between two changes doubles, so that they do not use up epochs and network
/// traffic forever. If they do not sign, the records are forged, and publishing again ends that:
/// the pause stays short.
class EpochPace {
 public:
  static constexpr std::int64_t kFirst_us = 30'000'000;
  static constexpr std::int64_t kMost_us = 3'600'000'000;
  static constexpr std::int64_t kUnsigned_us = 10'000'000;

  explicit EpochPace(bool robots_sign) noexcept
      : first_us_(robots_sign ? kFirst_us : kUnsigned_us),
        most_us_(robots_sign ? kMost_us : kUnsigned_us) {}

  /// now_us: monotonic, in all calls.
  [[nodiscard]] bool may_change(std::int64_t now_us) const noexcept { return now_us >= due_us_; }
  /// Notes a change of the epoch: doubles the next pause, up to the longest; resets it to the first
  /// if a change was possible for the longest pause and did not happen.
  void note_change(std::int64_t now_us) noexcept {
    const bool is_quiet = now_us - due_us_ >= most_us_;
    pause_us_ = pause_us_ == 0 || is_quiet ? first_us_ : std::min(2 * pause_us_, most_us_);
    due_us_ = now_us + pause_us_;
  }
  /// Notes a failed change: the next attempt is after the first pause.
  void put_off(std::int64_t now_us) noexcept { due_us_ = now_us + first_us_; }

 private:
  std::int64_t first_us_;
  std::int64_t most_us_;
  std::int64_t pause_us_ = 0;  ///< 0: no change yet.
  std::int64_t due_us_ = 0;
};

}  // namespace tessera
