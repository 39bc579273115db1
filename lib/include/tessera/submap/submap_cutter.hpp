// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// When a submap ends: after a way, after a time, when its memory is nearly full, or where the pose
// jumps.
#pragma once

#include <cstdint>
#include <optional>

#include "tessera/base/geometry.hpp"

namespace tessera {

/// What ends a submap.
struct SubmapCuts {
  double length_m = 0.0;     ///< Way from scan to scan; 0: no limit.
  std::int64_t time_us = 0;  ///< From the first scan on; 0: no limit.
  /// Between two scans: it did not drive there, its pose's frame is another one. 0: no limit.
  double jump_m = 0.0;
  friend constexpr bool operator==(const SubmapCuts&, const SubmapCuts&) = default;
};

/// Why a submap ended.
enum class SubmapEnd : std::uint8_t { kLength, kTime, kJump, kMemory };

/// What a submap may have.
struct SubmapAllowance {
  std::uint32_t stretch = 1;  ///< So many times the way and the time of SubmapCuts.
  bool is_full = false;       ///< Its memory has little room left.
};

class SubmapCutter {
 public:
  explicit SubmapCutter(const SubmapCuts& cuts = {}) noexcept : cuts_(cuts) {}

  /// To be called for each scan before it is integrated. A value: the submap ended with the scan
  /// before, and this one is the first of the next, if begin() is called then. p_map: of the
  /// sensor, finite, metres; stamp_us: not below that of the scan before, else no time passed. A
  /// full one ends after a quarter of the way or time of SubmapCuts. O(1).
  [[nodiscard]] std::optional<SubmapEnd> note(const Point3d& p_map, std::int64_t stamp_us,
                                              const SubmapAllowance& may = {}) noexcept;
  /// A new submap begins with the scan that was noted last.
  void begin() noexcept {
    way_m_ = 0.0;
    since_us_ = last_us_;
  }
  /// The current submap is one of an earlier start, in which the robot drove so far.
  void resume(double way_m) noexcept { way_m_ = way_m >= 0.0 ? way_m : 0.0; }
  /// Of the submap so far.
  [[nodiscard]] double way_m() const noexcept { return way_m_; }

 private:
  SubmapCuts cuts_;
  bool has_last_ = false;
  Point3d last_p_map_ = Point3d::Zero();
  std::int64_t last_us_ = 0;
  std::int64_t since_us_ = 0;
  double way_m_ = 0.0;
};

}  // namespace tessera
