// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Finds robots whose exclude list differs from this robot's. Does not affect the map: it is for the
// operator of the fleet.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>

#include "base/latest_value.hpp"
#include "base/log.hpp"
#include "link/status_table.hpp"

namespace tessera {

/// The state for other threads.
struct FleetView {
  /// Robots that were heard recently, in no order.
  std::array<std::uint32_t, StatusTable::kMostRobots> differing{};
  std::uint32_t differing_count = 0;
  StatusTableReport counters{};
  [[nodiscard]] std::span<const std::uint32_t> differ() const noexcept {
    return std::span(differing).first(differing_count);
  }
};

/// One thread calls all but view(). No heap.
class FleetWatch {
 public:
  FleetWatch(const StatusKeys& keys, std::uint32_t own_robot) noexcept : table_(keys, own_robot) {}

  /// peers: of the exchange, which belongs to the same thread.
  void hear(std::span<const std::byte> status, std::int64_t now_us,
            const PeerTable* peers) noexcept {
    static_cast<void>(table_.hear(status, now_us, peers));
  }
  /// Logs a line when a robot begins to differ, and one when that ends: it agrees, or is no longer
  /// heard.
  void look(std::uint32_t own_digest, std::int64_t now_us, LogQueue& log) noexcept;
  /// For any thread: the state of the last look(), empty before.
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
