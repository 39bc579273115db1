// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// For bench/teammates.cpp: scans of robots on the street, which of their returns are on another
// robot, and robots that map them.
#pragma once

#include <array>
#include <set>
#include <span>
#include <vector>

#include "simulator/street_simulator.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera::bench {

/// One scan, and what of it is on another robot.
struct StreetScan {
  std::vector<float> xyz;
  std::vector<std::uint8_t> components;
  Matrix34d T_map_sensor = Matrix34d::Identity();
  std::vector<std::size_t> on_others;  ///< Points.
  [[nodiscard]] ScanView view() const;
};

struct RobotScans {
  Matrix34d T_global_map = Matrix34d::Identity();
  std::vector<StreetScan> scans;
  std::vector<Matrix34d> T_map_before;           ///< Where it was in the second before them.
  std::set<std::array<std::int32_t, 3>> others;  ///< Voxels that hold any other return.
};

/// One class.
[[nodiscard]] ClassTable street_classes();
/// Around any of the street's vehicles, from where its sensor is.
[[nodiscard]] RobotBody street_body();
[[nodiscard]] RobotConfig street_robot(std::uint32_t number, bool has_body);
[[nodiscard]] std::vector<RobotScans> street_scans(const StreetSimulator& street, int robots,
                                                   int scans);
/// Milliseconds of a core that TeammateFilter takes for a scan's returns.
[[nodiscard]] double compare_ms(const StreetScan& scan, std::span<const PlacedBox> boxes);

}  // namespace tessera::bench
