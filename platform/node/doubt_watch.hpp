// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that most others contradict, in the log and for the browser.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/latest_value.hpp"
#include "base/log.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera {

/// By ascending number.
struct DoubtedRobots {
  struct Robot {
    std::uint32_t robot = 0;
    float reliability = 1.0F;
    std::uint64_t classes = 0;  ///< RobotReliability::named.
    std::int64_t named_us = 0;  ///< When any of them last was.
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
  /// While more is always arriving, what is known is looked at all the same after this time.
  static constexpr std::int64_t kPatience_us = 2'000'000;
  /// A robot and its classes stay named for so long, so that few lines tell of one at the limit.
  static constexpr std::int64_t kMemory_us = 30'000'000;

  /// Logs a line when classes of a robot are named that were not, and one when that has ended.
  void look(const GlobalMap& global, std::int64_t now_us, LogQueue& log) noexcept;
  /// For any thread: the state of the last look(), empty before.
  [[nodiscard]] DoubtedRobots view() const noexcept {
    DoubtedRobots view;
    static_cast<void>(view_.get(view));
    return view;
  }

 private:
  DoubtedRobots last_;
  std::int64_t looked_us_ = 0;
  LatestValue<DoubtedRobots> view_;
};

}  // namespace tessera
