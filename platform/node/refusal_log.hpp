// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a node refuses or loses for longer than a moment, in its log: by counter, once a minute.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "lcm/link_statistics.hpp"
#include "lcm/side_intake.hpp"
#include "lcm/status_table.hpp"
#include "posix/log.hpp"
#include "tessera/exchange/exchange_config.hpp"

namespace tessera {

/// For one thread; no heap.
class RefusalLog {
 public:
  /// Between two looks; a counter that grew in two of them within kPeriod_us is told.
  static constexpr std::int64_t kLook_us = 1'000'000;
  /// Between two lines of one counter.
  static constexpr std::int64_t kPeriod_us = 60'000'000;
  static constexpr std::size_t kCounters = 35;

  /// Looks at the counters, unless the last look is less than kLook_us ago, and says which of them
  /// go on growing. now_us: monotonic.
  void look(const LinkStatistics& link, const ExchangeReport& exchange,
            const SideStatistics& statuses, const StatusCounters& table, std::int64_t now_us,
            LogQueue& log) noexcept;

 private:
  struct Watch {
    std::uint64_t seen = 0;  ///< At the last look.
    std::uint64_t told = 0;  ///< What the last line ended with.
    std::int64_t grew_us = kNever;
    std::int64_t told_us = kNever;
  };
  static constexpr std::int64_t kNever = INT64_MIN / 2;

  std::array<Watch, kCounters> watches_{};
  std::int64_t looked_us_ = kNever;
};

}  // namespace tessera
