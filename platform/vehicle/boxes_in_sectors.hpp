// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Obstacles that are in no map, as sectors around the robot have them.
#pragma once

#include <span>

#include "tessera/base/robot_body.hpp"
#include "tessera/map/obstacle_sectors.hpp"
#include "vehicle/vehicle_report.hpp"

namespace tessera {

/// Adds a box to the sectors that its sides, seen from above, are in, as an obstacle without a
/// class; where something is nearer, that stays. Distances are short by up to 0.1 m, never long. A
/// box outside of the band of heights, or out of range, adds nothing. Sectors without values stay
/// so. O(its sides / 0.2 m).
void add_box(const PlacedBox& one, const Matrix34d& T_map_body, const ObstacleSectorsConfig& config,
             std::span<SectorReport> sectors);

}  // namespace tessera
