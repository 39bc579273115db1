// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/obstacle_sectors.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "oracle/random.hpp"
#include "small_map.hpp"

namespace tessera {
namespace {

constexpr double kTurn = 6.283185307179586;

Matrix34d pose_at(double x, double y, double z, double heading) {
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = T(1, 1) = std::cos(heading);
  T(1, 0) = std::sin(heading);
  T(0, 1) = -T(1, 0);
  T(0, 3) = x;
  T(1, 3) = y;
  T(2, 3) = z;
  return T;
}

/// A map, a reader, and sectors in memory of just their size.
struct Rig {
  explicit Rig(const ObstacleSectorsConfig& config, const MapConfig& map_config = pages())
      : small(map_config), lines(ObstacleSectors::required_bytes(small.map) / sizeof(Line)) {
    Arena arena(std::as_writable_bytes(std::span(lines)));
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
  using Line = SmallMap::Line;
  SmallMap small;
  std::vector<Line> lines;
  ObstacleSectors sectors;
};

/// The sectors that a voxel's square is in a part of, by angles; -1 for the place of the body.
std::vector<int> sectors_of_square(double x, double y, double edge, double heading, int count) {
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

/// All by definition: every voxel of the band within the range is asked.
ObstacleSummary by_brute_force(const LocalMap& map, const ObstacleSectorsConfig& c,
                               const Matrix34d& T) {
  ObstacleSummary result;
  const double r = map.lattice().resolution_m();
  const double heading = std::atan2(T(1, 0), T(0, 0));
  const auto reach = static_cast<int>(c.max_range_m / r) + 2;
  const VoxelCoord body = *map.lattice().voxel_of_double(T.col(3));
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
      if (known[i][ring] < c.known_share * all[i][ring]) break;
      sector.free_up_to_m = static_cast<double>(ring + 1) * c.ring_m;
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
    furnish(rig.small.map, random, *rig.small.map.lattice().voxel_of_double(T.col(3)), 34);
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

TEST_CASE("ObstacleSectors: ahead is sector 0, to the left is a quarter on") {
  Rig rig({.count = 16, .max_range_m = 10.0});
  const double heading = 0.5;
  const Matrix34d T = pose_at(2.03, -1.04, 0.02, heading);
  for (int sector = 0; sector < 16; ++sector) {
    const double turn = heading + kTurn * sector / 16;
    const double away = 3.0 + 0.3 * sector;
    const Point3d p(2.03 + away * std::cos(turn), -1.04 + away * std::sin(turn), 0.0);
    const int label = 1 + sector % 3;
    REQUIRE(hit(rig.small.map, *rig.small.map.lattice().voxel_of_double(p), label, 3.0F) ==
            Status::kOk);
  }
  const ObstacleSummary& summary = rig.sweep(T);
  for (std::size_t i = 0; i < 16; ++i) {
    INFO("sector " << i);
    CHECK(summary.sectors[i].occupied);
    CHECK(summary.sectors[i].label == 1 + static_cast<int>(i) % 3);
    const double away = 3.0 + 0.3 * static_cast<double>(i);
    CHECK(summary.sectors[i].distance_m <= away);
    CHECK(summary.sectors[i].distance_m > away - 0.3);
    CHECK(summary.sectors[i].free_up_to_m == 0.0);
  }
}

TEST_CASE("ObstacleSectors: unknown is not free, and free ends at the obstacle") {
  Rig rig({.count = 8, .max_range_m = 8.0, .min_height_m = 0.0, .max_height_m = 0.4});
  const Matrix34d T = pose_at(0.05, 0.05, 0.0, 0.0);
  CHECK(rig.sweep(T).sectors[0].free_up_to_m == 0.0);
  CHECK_FALSE(rig.sweep(T).sectors[0].occupied);
  for (int x = 0; x < 45; ++x)
    for (int y = -x - 3; y <= x + 3; ++y) REQUIRE(carve(rig.small.map, {x, y, 1}) == Status::kOk);
  CHECK(rig.sweep(T).sectors[0].free_up_to_m == 4.0);
  // Of a column, one voxel is enough to be an obstacle.
  REQUIRE(hit(rig.small.map, {26, 0, 3}, 2, 5.0F) == Status::kOk);
  CHECK(rig.sweep(T).sectors[0].free_up_to_m == 2.0);
  CHECK(rig.sweep(T).sectors[0].distance_m == Approx(2.6 - 0.1 * std::sqrt(0.5)));
  CHECK(rig.sweep(T).sectors[0].label == 2);
  // Behind the body nothing is known.
  CHECK(rig.sweep(T).sectors[4].free_up_to_m == 0.0);
}

TEST_CASE(
    "ObstacleSectors: what is above or below the band, or the vehicle itself, is no obstacle") {
  ObstacleSectorsConfig config{.count = 8, .max_range_m = 8.0};
  config.min_height_m = -0.5;
  config.max_height_m = 0.5;
  config.own_radius_m = 1.0;
  Rig rig(config);
  const Matrix34d T = pose_at(0.0, 0.0, 1.0, 0.0);
  REQUIRE(hit(rig.small.map, {30, 0, 4}, 1, 5.0F) == Status::kOk);
  REQUIRE(hit(rig.small.map, {30, 0, 15}, 1, 5.0F) == Status::kOk);
  REQUIRE(hit(rig.small.map, {8, 0, 10}, 1, 5.0F) == Status::kOk);
  CHECK_FALSE(rig.sweep(T).sectors[0].occupied);
  REQUIRE(hit(rig.small.map, {30, 0, 14}, 1, 5.0F) == Status::kOk);
  CHECK(rig.sweep(T).sectors[0].occupied);
  REQUIRE(hit(rig.small.map, {20, 0, 5}, 1, 5.0F) == Status::kOk);
  CHECK(rig.sweep(T).sectors[0].voxel == VoxelCoord{20, 0, 5});
}

TEST_CASE("ObstacleSectors: a call does no more than it may, and the last sweep stays meanwhile") {
  Rig rig({.count = 16, .max_range_m = 10.0, .min_height_m = -0.4, .max_height_m = 0.3});
  REQUIRE(hit(rig.small.map, {30, 0, 0}, 1, 5.0F) == Status::kOk);
  const Matrix34d T = pose_at(0.05, 0.05, 0.05, 0.0);
  CHECK(rig.sectors.latest().count == 0);
  const std::uint32_t all = rig.sweep(T).blocks;
  CHECK(rig.sectors.column_blocks() == 2);
  CHECK(all <= 2 * 27 * 27);
  MapReader reader(rig.small.map);
  REQUIRE(rig.sectors.begin(T, 99) == Status::kOk);
  std::uint32_t calls = 0;
  while (!rig.sectors.step(reader, 20)) {
    ++calls;
    CHECK(rig.sectors.is_sweeping());
    REQUIRE(rig.sectors.latest().stamp_us == 77);
  }
  CHECK(calls >= all / 20 - 1);
  CHECK(rig.sectors.latest().stamp_us == 99);
  CHECK(rig.sectors.latest().blocks == all);
  CHECK(rig.sectors.latest().present == 1);
  CHECK(rig.sectors.step(reader, 20));
}

TEST_CASE("ObstacleSectors: what is behind an obstacle all around is not looked at") {
  Rig rig({.count = 8, .max_range_m = 20.0});
  const Matrix34d T = pose_at(0.0, 0.0, 0.0, 0.0);
  const std::uint32_t open = rig.sweep(T).columns;
  for (int i = -12; i <= 12; ++i)
    for (const int j : {-12, 12})
      for (const VoxelCoord v : {VoxelCoord{i, j, 0}, VoxelCoord{j, i, 0}})
        REQUIRE(hit(rig.small.map, v, 1, 5.0F) == Status::kOk);
  CHECK(rig.sweep(T).columns < open / 20);
}

TEST_CASE("ObstacleSectors: configurations and poses that make no sense are refused") {
  SmallMap small(config_of_pages(4));
  std::vector<SmallMap::Line> lines(ObstacleSectors::required_bytes(small.map) /
                                    sizeof(SmallMap::Line));
  const auto made = [&](const ObstacleSectorsConfig& config) {
    Arena arena(std::as_writable_bytes(std::span(lines)));
    return ObstacleSectors::make(config, small.map, arena).status();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(made({}) == Status::kOk);
  for (const int count : {0, 4, 15, 64, -16})
    CHECK(made({.count = count}) == Status::kInvalidArgument);
  for (const double range : {0.0, -1.0, kNan, 500.0, 70.0})
    CHECK(made({.max_range_m = range}) == Status::kInvalidArgument);
  CHECK(made({.min_height_m = 1.1}) == Status::kInvalidArgument);
  CHECK(made({.max_height_m = kNan}) == Status::kInvalidArgument);
  CHECK(made({.own_radius_m = -0.1}) == Status::kInvalidArgument);
  CHECK(made({.ring_m = 0.3}) == Status::kInvalidArgument);
  CHECK(made({.ring_m = 21.0}) == Status::kInvalidArgument);
  CHECK(made({.known_share = 0.0}) == Status::kInvalidArgument);
  CHECK(made({.known_share = 1.1}) == Status::kInvalidArgument);
  Arena none(std::as_writable_bytes(std::span(lines)).first(64));
  CHECK(ObstacleSectors::make({}, small.map, none).status() == Status::kResourceExhausted);

  ObstacleSectors unmade;
  CHECK(unmade.begin(Matrix34d::Identity(), 0) == Status::kResourceExhausted);
  Rig rig({});
  CHECK(rig.sectors.begin(Matrix34d::Zero(), 0) == Status::kInvalidArgument);
  Matrix34d up = Matrix34d::Zero();  // Its x axis looks at the sky.
  up(2, 0) = up(1, 1) = 1.0;
  up(0, 2) = -1.0;
  CHECK(rig.sectors.begin(up, 0) == Status::kInvalidArgument);
  CHECK(rig.sectors.begin(pose_at(1e6, 0, 0, 0), 0) == Status::kOutOfRange);
}

}  // namespace
}  // namespace tessera
