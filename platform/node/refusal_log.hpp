// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Logs what a node refuses or loses repeatedly: by counter, once a minute.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/log.hpp"
#include "link/link_report.hpp"
#include "link/side_intake.hpp"
#include "link/status_table.hpp"
#include "tessera/exchange/exchange_config.hpp"
#include "tessera/fusion/global_map_config.hpp"

namespace tessera {

/// The watched counters. None ever decreases.
struct RefusalCounters {
  const LinkReport& link;
  const ExchangeReport& exchange;
  const SideReport& statuses;
  const StatusTableReport& table;
  const GlobalMapReport& global_map;
  std::uint64_t floors_refused;  ///< Times that the floor of a robot's epochs was not stored.
};

/// For one thread; no heap.
class RefusalLog {
 public:
  /// Between two looks; a counter that grew in two of them within kPeriod_us is logged.
  static constexpr std::int64_t kLook_us = 1'000'000;
  /// Between two lines of one counter.
  static constexpr std::int64_t kPeriod_us = 60'000'000;
  static constexpr std::size_t kCounters = 44;

  /// Checks the counters, unless the last look is less than kLook_us ago, and logs which of them
  /// keep growing; of conflicts and twins each increase, the first at once. now_us: monotonic.
  void look(const RefusalCounters& counted, std::int64_t now_us, LogQueue& log) noexcept;

 private:
  struct Watch {
    std::uint64_t seen = 0;  ///< At the last look.
    std::uint64_t told = 0;  ///< Value at the last line.
    std::int64_t grew_us = kNever;
    std::int64_t told_us = kNever;
  };
  [[nodiscard]] static bool is_due(Watch& watch, std::uint64_t value, bool at_once,
                                   std::int64_t now_us) noexcept;
  static constexpr std::int64_t kNever = INT64_MIN / 2;

  std::array<Watch, kCounters> watches_{};
  std::int64_t looked_us_ = kNever;
};

/// Text of the differences between a peer's configuration and ours; empty: none.
std::string mismatch_text(const ConfigurationDetails& theirs, const ConfigurationDetails& ours);

}  // namespace tessera
