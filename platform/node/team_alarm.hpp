// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Faults on the bus for robot numbers used twice and for conflicting contents.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "vehicle/bus_values.hpp"

namespace tessera {

/// Counters of SharingThreadState; none ever decreases.
struct TeamCounters {
  std::uint64_t own_twins = 0;    ///< Times that another process used this robot's number.
  std::uint64_t other_twins = 0;  ///< Times that two processes used another robot's number.
  std::uint64_t conflicts = 0;    ///< Versions with two signed contents.
};

/// For one thread; no heap.
class TeamAlarm {
 public:
  /// A reason is reported for this time after the last increase of its counter.
  static constexpr std::int64_t kTold_us = 10'000'000;

  /// Returns the first of kTwin, kOtherTwin and kConflict whose counter grew within kTold_us, else
  /// kNone. now_us: monotonic, above 0.
  PauseReason look(const TeamCounters& now, std::int64_t now_us) noexcept {
    constexpr std::array kReasons = {PauseReason::kTwin, PauseReason::kOtherTwin,
                                     PauseReason::kConflict};
    const std::array values = {now.own_twins, now.other_twins, now.conflicts};
    PauseReason reason = PauseReason::kNone;
    for (std::size_t i = kReasons.size(); i > 0; --i) {
      Watch& watch = watches_[i - 1];
      if (values[i - 1] != watch.seen) watch.grew_us = now_us;
      watch.seen = values[i - 1];
      if (watch.grew_us != 0 && now_us - watch.grew_us < kTold_us) reason = kReasons[i - 1];
    }
    return reason;
  }

 private:
  struct Watch {
    std::uint64_t seen = 0;
    std::int64_t grew_us = 0;  ///< 0: never.
  };
  std::array<Watch, 3> watches_{};
};

}  // namespace tessera
