// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots in submaps: one that drives along, and what submaps by hand would give.
#pragma once

#include <catch2/catch.hpp>
#include <initializer_list>

#include "small_team.hpp"

namespace tessera {

/// Frames of the first submap and of the second.
inline const Matrix34d kFirst = shift_of(1.0, -2.0);
inline const Matrix34d kSecond = shift_of(8.0, 4.0);

/// A robot whose first submap lies at kFirst.
RobotConfig config_at_first(std::uint32_t submaps = 3);
/// The global map of both parts, each from a map and a publisher of its own: submaps by hand.
std::uint64_t digest_by_hand(RobotConfig config, std::initializer_list<int> first, int second);

/// A robot that is driven along, and settles after each scan.
struct Course {
  explicit Course(const RobotConfig& config) : one(config) {}
  std::uint32_t drive_to(double x_m, double y_m) {
    view.T_map_sensor = shift_of(x_m, y_m);
    last = one.robot->integrate(view, now_us);
    REQUIRE(settle(*one.robot, now_us) <= 1000);
    return one.robot->maps().number();
  }
  SmallRobotMemory one;
  StreetPart part{1};
  ScanView view = part.view();
  ScanReport last{};
  std::int64_t now_us = 0;
};

}  // namespace tessera
