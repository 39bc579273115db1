// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sectors against their definition: every voxel is asked.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "sectors_rig.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

/// All by definition: every voxel of the band within the range is asked.
ObstacleSummary by_brute_force(const LocalMap& map, const ObstacleSectorsConfig& c,
                               const Matrix34d& T) {
  ObstacleSummary result;
  const double r = map.lattice().resolution_m();
  const double heading = std::atan2(T(1, 0), T(0, 0));
  const auto reach = static_cast<int>(c.max_range_m / r) + 2;
  const VoxelCoord body = *map.lattice().voxel_of(T.col(3));
  std::vector<double> nearest(static_cast<std::size_t>(c.count), 1e9);
  std::vector<std::vector<int>> all(static_cast<std::size_t>(c.count), std::vector<int>(200));
  std::vector<std::vector<int>> known = all;
  for (int vx = body.x - reach; vx <= body.x + reach; ++vx) {
    for (int vy = body.y - reach; vy <= body.y + reach; ++vy) {
      const double x = (vx + 0.5) * r - T(0, 3);
      const double y = (vy + 0.5) * r - T(1, 3);
      const double distance = std::sqrt(squared_norm(x, y, 0.0));
      if (distance > c.max_range_m || distance < c.own_radius_m) continue;
      bool observed = false;
      for (int vz = body.z - 100; vz <= body.z + 100; ++vz) {
        const double z = (vz + 0.5) * r - T(2, 3);
        if (z < c.min_height_m || z > c.max_height_m) continue;
        const Estimate found = map.query(VoxelCoord{vx, vy, vz});
        observed = observed || found.state != VoxelState::kUnknown;
        if (found.state != VoxelState::kOccupied) continue;
        for (const int i : sectors_of_square(x - r / 2, y - r / 2, r, heading, c.count)) {
          const auto at = static_cast<std::size_t>(i);
          ObstacleSector& sector = result.sectors[at];
          if (distance > nearest[at] ||
              (distance == nearest[at] && found.occupancy <= sector.occupancy))
            continue;
          nearest[at] = distance;
          sector.occupied = true;
          sector.distance_m = std::max(0.0, distance - r * std::sqrt(0.5));
          sector.occupancy = found.occupancy;
          sector.label = found.label;
        }
      }
      const double turn = std::atan2(y, x) - heading + kTurn / c.count / 2;
      const double part = turn / kTurn - std::floor(turn / kTurn);
      const auto sector = static_cast<std::size_t>(part * c.count) % all.size();
      const auto ring = static_cast<std::size_t>(distance / c.ring_m);
      ++all[sector][ring];
      known[sector][ring] += observed ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    ObstacleSector& sector = result.sectors[i];
    const double end = sector.occupied ? std::min(sector.distance_m, c.max_range_m) : c.max_range_m;
    for (std::size_t ring = 0; static_cast<double>(ring + 1) * c.ring_m <= end; ++ring) {
      const double outer = static_cast<double>(ring + 1) * c.ring_m;
      if (all[i][ring] == 0 && outer > c.own_radius_m) continue;  // With the next.
      if (known[i][ring] < c.known_share * all[i][ring]) break;
      sector.free_up_to_m = outer;
    }
  }
  return result;
}

/// Walls, free space and clutter around a place.
void furnish(LocalMap& map, oracle::Random& random, VoxelCoord around, int reach) {
  for (int i = 0; i < 60; ++i) {
    const int dx = random.below(2 * reach) - reach;
    const int dy = random.below(2 * reach) - reach;
    const int dz = random.below(12) - 6;
    const int component = 1 + random.below(3);
    const auto weight = static_cast<float>(1 + random.below(4));
    const VoxelCoord at{around.x + dx, around.y + dy, around.z + dz};
    REQUIRE(hit(map, at, component, weight) == Status::kOk);
    const int passes = random.below(4);
    for (int pass = 0; pass < passes; ++pass) REQUIRE(carve(map, at) == Status::kOk);
  }
  for (int ray = 0; ray < 150; ++ray) {
    const double turn = random.uniform(0.0, kTurn);
    const int length = random.below(reach);
    for (int step = 0; step < length; ++step) {
      const auto x = static_cast<int>(std::lround(step * std::cos(turn)));
      const auto y = static_cast<int>(std::lround(step * std::sin(turn)));
      REQUIRE(carve(map, {around.x + x, around.y + y, around.z}) == Status::kOk);
    }
  }
}

void check_equal(const ObstacleSummary& found, const ObstacleSummary& expected, int count) {
  REQUIRE(found.count == count);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    INFO("sector " << i);
    const ObstacleSector& a = found.sectors[i];
    const ObstacleSector& b = expected.sectors[i];
    CHECK(a.available);
    CHECK(a.occupied == b.occupied);
    CHECK(a.distance_m == Approx(b.distance_m).margin(1e-12));
    CHECK(a.occupancy == b.occupancy);
    CHECK(a.free_up_to_m == b.free_up_to_m);
  }
}

TEST_CASE("ObstacleSectors: the same as by asking every voxel") {
  oracle::Random random(7001);
  const int counts[] = {8, 16, 32};
  for (int round = 0; round < 9; ++round) {
    INFO("round " << round);
    ObstacleSectorsConfig config{.count = counts[round % 3], .max_range_m = 6.0};
    config.min_height_m = -0.35;
    config.max_height_m = 0.45;
    config.ring_m = 0.5;
    config.known_share = 0.3;
    config.own_radius_m = round < 3 ? 0.0 : 0.7;
    MapConfig map_config = Rig::pages();
    map_config.resolution_m = 0.2;
    Rig rig(config, map_config);
    const double x = random.uniform(-9.0, 9.0);
    const double y = random.uniform(-9.0, 9.0);
    const double z = random.uniform(-3.0, 3.0);
    const double heading = random.uniform(-3.0, 3.0);
    const Matrix34d T = pose_at(x, y, z, heading);
    furnish(rig.small.map, random, *rig.small.map.lattice().voxel_of(T.col(3)), 34);
    const ObstacleSummary& whole = rig.sweep(T);
    check_equal(whole, by_brute_force(rig.small.map, config, T), config.count);
    const auto free = std::count_if(whole.sectors.begin(), whole.sectors.end(),
                                    [](const ObstacleSector& s) { return s.free_up_to_m > 0.0; });
    CHECK(free > 0);
    // In pieces it is the same.
    const ObstacleSummary before = whole;
    const ObstacleSummary& pieces = rig.sweep(T, 1);
    check_equal(pieces, before, config.count);
    CHECK(pieces.blocks == before.blocks);
  }
}

}  // namespace
}  // namespace tessera
