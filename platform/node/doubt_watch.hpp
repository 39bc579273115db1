// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots whose labels the global map relies on less than the alarm says, in the log and for the
// browser.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/latest_value.hpp"
#include "base/log.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera {

struct DoubtedRobots {
  struct Robot {
    std::uint32_t robot = 0;
    float reliability = 1.0F;
    std::uint64_t classes = 0;  ///< A bit each.
  };
  std::array<Robot, Replicas::kMostRobots> robots{};
  std::uint32_t count = 0;

  [[nodiscard]] std::span<const Robot> all() const noexcept {
    return std::span(robots).first(count);
  }
};

/// One thread calls look(). No heap.
class DoubtWatch {
 public:
  /// Logs a line when classes of a robot are named that were not, and one when that ends.
  void look(const GlobalMap& global, std::int64_t now_us, LogQueue& log) noexcept;
  /// For any thread: the state of the last look(), empty before.
  [[nodiscard]] DoubtedRobots view() const noexcept {
    DoubtedRobots view;
    static_cast<void>(view_.get(view));
    return view;
  }

 private:
  DoubtedRobots last_;
  LatestValue<DoubtedRobots> view_;
};

}  // namespace tessera
