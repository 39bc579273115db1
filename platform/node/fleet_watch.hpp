// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which robots say that they exclude others than this one does. Nothing of the map follows from it:
// it is for whoever looks after the fleet.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>

#include "lcm/status_table.hpp"
#include "posix/latest_value.hpp"
#include "posix/log.hpp"

namespace tessera {

/// As others look at it.
struct FleetView {
  /// Robots that were heard lately, in no order.
  std::array<std::uint32_t, StatusTable::kMostRobots> differing{};
  std::uint32_t differing_count = 0;
  StatusCounters counters{};
  [[nodiscard]] std::span<const std::uint32_t> differ() const noexcept {
    return std::span(differing).first(differing_count);
  }
};

/// One thread calls all but view(). No heap.
class FleetWatch {
 public:
  FleetWatch(const StatusKeys& keys, std::uint32_t own_robot) noexcept : table_(keys, own_robot) {}

  void hear(std::span<const std::byte> status, std::int64_t now_us) noexcept {
    static_cast<void>(table_.hear(status, now_us));
  }
  /// A line when a robot begins to differ, and one when it ends: it agrees, or is no more heard.
  void look(std::uint32_t own_digest, std::int64_t now_us, LogQueue& log) noexcept;
  /// For any thread: as of the last look(), empty before.
  [[nodiscard]] FleetView view() const noexcept {
    FleetView view;
    static_cast<void>(view_.get(view));
    return view;
  }

 private:
  StatusTable table_;
  std::array<std::uint32_t, StatusTable::kMostRobots> told_{};  ///< Robots, by place.
  std::bitset<StatusTable::kMostRobots> differs_;
  LatestValue<FleetView> view_;
};

}  // namespace tessera
