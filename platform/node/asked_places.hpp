// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places of the global map that planners asked about lately: what others have published there is
// wanted, as what is near the robot is.
#pragma once

#include <array>
#include <cstdint>

#include "link/query_messages.hpp"
#include "tessera/robot/sharer.hpp"

namespace tessera {

/// Places that were asked about within kKept_us; of more than there is room for, the latest.
/// Trivially copyable, so that one thread can hand it to another.
struct AskedPlaces {
  static constexpr std::int64_t kKept_us = 60'000'000;
  /// Questions about places this near to each other are about one.
  static constexpr double kSame_m = 10.0;

  std::uint32_t count = 0;
  std::array<std::array<double, 3>, Sharer::kMostRoute> p_global{};
  std::array<std::int64_t, Sharer::kMostRoute> asked_us{};  ///< When, last.

  /// Takes what a question is about: of points the first one, of a region its middle, of a ray both
  /// ends. Points that are not finite are left out. now_us: never lower than before. O(kMostRoute).
  void note(const MapQuery& query, std::int64_t now_us) noexcept;
  /// Forgets what was asked too long ago. True iff anything was. O(kMostRoute).
  bool forget_old(std::int64_t now_us) noexcept;
  /// For Sharer::set_route.
  [[nodiscard]] std::array<Point3d, Sharer::kMostRoute> points() const noexcept;

 private:
  void note_place(const Point3d& place, std::int64_t now_us) noexcept;
};

}  // namespace tessera
