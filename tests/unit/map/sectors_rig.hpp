// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Obstacle sectors around a place in a small map, for tests.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "support/small_map.hpp"
#include "tessera/map/obstacle_sectors.hpp"

namespace tessera {

inline constexpr double kTurn = 6.283185307179586;

inline Matrix34d pose_at(double x, double y, double z, double heading) {
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = T(1, 1) = std::cos(heading);
  T(1, 0) = std::sin(heading);
  T(0, 1) = -T(1, 0);
  T(0, 3) = x;
  T(1, 3) = y;
  T(2, 3) = z;
  return T;
}

/// The sectors that a voxel's square is in a part of, by angles; -1 for the place of the body.
inline std::vector<int> sectors_of_square(double x, double y, double edge, double heading,
                                          int count) {
  std::vector<double> turns;
  for (const double dx : {0.0, edge})
    for (const double dy : {0.0, edge}) turns.push_back(std::atan2(y + dy, x + dx) - heading);
  const double first = turns[0];
  for (double& turn : turns) turn = first + std::remainder(turn - first, kTurn);
  const double width = kTurn / count;
  const double low = *std::min_element(turns.begin(), turns.end()) + width / 2;
  const double high = *std::max_element(turns.begin(), turns.end()) + width / 2;
  std::vector<int> sectors;
  if (x <= 0 && x + edge >= 0 && y <= 0 && y + edge >= 0) {
    for (int i = 0; i < count; ++i) sectors.push_back(i);
    return sectors;
  }
  const auto number = [&](double turn) { return static_cast<int>(std::floor(turn / width)); };
  for (int i = number(low); i <= number(high); ++i)
    sectors.push_back(((i % count) + count) % count);
  return sectors;
}

/// A map, a reader, and sectors in memory of just their size.
struct Rig {
  explicit Rig(const ObstacleSectorsConfig& config, const MapConfig& map_config = pages())
      : small(map_config), memory(ObstacleSectors::required_bytes(small.map)) {
    Arena arena = memory.arena();
    Result<ObstacleSectors> made = ObstacleSectors::make(config, small.map, arena);
    REQUIRE(made.ok());
    REQUIRE(arena.remaining_bytes() == 0);
    sectors = *made;
  }
  static MapConfig pages() { return config_of_pages(600); }
  const ObstacleSummary& sweep(const Matrix34d& T_map_body, std::uint32_t blocks = 1000) {
    MapReader reader(small.map);
    REQUIRE(sectors.begin(T_map_body, 77) == Status::kOk);
    int calls = 0;
    while (!sectors.step(reader, blocks)) REQUIRE(++calls < 100'000);
    return sectors.latest();
  }
  SmallMap small;
  AlignedMemory memory;
  ObstacleSectors sectors;
};

}  // namespace tessera
