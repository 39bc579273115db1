// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/symmetric_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/random.hpp"

namespace tessera {

namespace {

constexpr std::size_t kScenes = kSymmetricScenes.size() + kSymmetricEnds.size();

/// What both maps see from above: where landmarks stand.
struct Region {
  double low_x, low_y, high_x, high_y;
  double floor_z = 0.0;  ///< The highest of it; solids reach from below it.
};

struct Stage {
  SolidWorld world;
  WorldView a;
  WorldView b;
  Region common;
  Matrix34d T_world_alike = Matrix34d(Matrix34d::Identity());
};

WorldView seen(const Point3d& low, const Point3d& high) { return {low, high}; }

/// A solid that stands on the floor of the region, with its middle at these shares of it.
Solid standing(const Region& region, double share_x, double share_y, const Point3d& size_m) {
  const double x = region.low_x + share_x * (region.high_x - region.low_x);
  const double y = region.low_y + share_y * (region.high_y - region.low_y);
  const double half_x = 0.5 * std::min(size_m.x(), 0.4 * (region.high_x - region.low_x));
  const double half_y = 0.5 * std::min(size_m.y(), 0.4 * (region.high_y - region.low_y));
  return {{x - half_x, y - half_y, region.floor_z - 1.0},
          {x + half_x, y + half_y, region.floor_z + size_m.z()},
          3};
}

/// A thing of up to 2.5 m and 3 m height on the floor from the origin to there, half a metre from
/// its borders at least.
Solid draw_thing(oracle::Random& random, double length_m, double width_m) {
  const double x = random.uniform(0.5, length_m - 3.0);
  const double y = random.uniform(0.5, width_m - 3.0);
  return {{x, y, 0.0},
          {x + random.uniform(0.6, 2.5), y + random.uniform(0.6, 2.5), random.uniform(0.8, 3.0)},
          3};
}

void add_landmarks(Stage& stage, Landmarks landmarks, oracle::Random& random) {
  // Drawn one after the other: compilers order the arguments of a call as they like.
  const auto add = [&](double x_from, double x_to, double y_from, double y_to,
                       const Point3d& size) {
    const double x = random.uniform(x_from, x_to);
    const double y = random.uniform(y_from, y_to);
    stage.world.solids.push_back(standing(stage.common, x, y, size));
  };
  if (landmarks == Landmarks::kLittle) {
    const double edge_m = random.uniform(0.3, 0.8);
    add(0.1, 0.9, 0.1, 0.9, {edge_m, edge_m, random.uniform(0.3, 0.8)});
  }
  if (landmarks == Landmarks::kClear) {
    add(0.15, 0.35, 0.6, 0.85, {4.0, 0.6, 2.6});
    add(0.45, 0.6, 0.15, 0.3, {0.6, 3.0, 2.2});
    add(0.75, 0.85, 0.7, 0.85, {1.6, 1.0, 3.0});
  }
}

Stage square_room(oracle::Random& random) {
  const double side_m = random.uniform(15.0, 22.0);
  const double half_m = random.uniform(0.8, 2.0);
  const double middle_m = 0.5 * side_m;
  const Solid box{{middle_m - half_m, middle_m - half_m, 0.0},
                  {middle_m + half_m, middle_m + half_m, random.uniform(1.0, 3.0)},
                  3};
  const double to_m = side_m * random.uniform(0.75, 1.0) + 0.5;
  const double from_m = side_m * random.uniform(0.0, 0.25) - 0.5;
  return {room_of(side_m, side_m, 4.0, {box}),
          seen({-0.5, -0.5, -0.5}, {to_m, side_m + 0.5, 3.5}),
          seen({from_m, -0.5, -0.5}, {side_m + 0.5, side_m + 0.5, 3.5}),
          {from_m + 0.5, 0.0, to_m - 0.5, side_m}};
}

/// Of a length; a number is drawn from it.
struct Shares {
  double low, high;
};

double draw(oracle::Random& random, const Shares& shares) {
  return random.uniform(shares.low, shares.high);
}

/// What both maps have seen of the second room begins and ends at shares of its length.
Stage twin_rooms(oracle::Random& random, const Shares& from, const Shares& to) {
  const double length_m = random.uniform(14.0, 19.0);
  const double width_m = random.uniform(12.0, 16.0);
  constexpr double kWall_m = 0.4;
  std::vector<Solid> things{{{length_m, 0.0, 0.0}, {length_m + kWall_m, width_m, 4.0}, 2}};
  for (int i = 0; i < 4; ++i) {
    const Solid thing = draw_thing(random, length_m, width_m);
    things.push_back(thing);
    things.push_back(thing);
    things.back().low.x() += length_m + kWall_m;
    things.back().high.x() += length_m + kWall_m;
  }
  const double second_m = length_m + kWall_m;
  const double end_m = second_m + length_m;
  const double to_m = second_m + length_m * draw(random, to);
  const double from_m = second_m + length_m * draw(random, from);
  return {room_of(end_m, width_m, 4.0, things),
          seen({-0.5, -0.5, -0.5}, {to_m, width_m + 0.5, 3.5}),
          seen({from_m, -0.5, -0.5}, {end_m + 0.5, width_m + 0.5, 3.5}),
          {from_m, 0.0, to_m, width_m},
          frame_of(0.0, 0.0, 0.0, {-second_m, 0.0, 0.0})};
}

/// A hall with each thing a second time in its other half: mirrored, or turned by half about the
/// middle. A sees a share of its length from one end, B from the other.
Stage hall_of_halves(oracle::Random& random, bool is_turned, const Shares& seen_of_it) {
  const double length_m = random.uniform(26.0, 36.0);
  const double width_m = random.uniform(16.0, 22.0);
  std::vector<Solid> things;
  for (int i = 0; i < 4; ++i) {
    const Solid thing = draw_thing(random, 0.5 * length_m, width_m);
    Solid other = thing;
    other.low.x() = length_m - thing.high.x();
    other.high.x() = length_m - thing.low.x();
    if (is_turned) {
      other.low.y() = width_m - thing.high.y();
      other.high.y() = width_m - thing.low.y();
    }
    things.push_back(thing);
    things.push_back(other);
  }
  const double to_m = length_m * draw(random, seen_of_it);
  const double from_m = length_m * (1.0 - draw(random, seen_of_it));
  return {room_of(length_m, width_m, 4.0, things),
          seen({-0.5, -0.5, -0.5}, {to_m, width_m + 0.5, 3.5}),
          seen({from_m, -0.5, -0.5}, {length_m + 0.5, width_m + 0.5, 3.5}),
          {from_m, 0.0, to_m, width_m},
          frame_of(180.0, 0.0, 0.0, {length_m, width_m, 0.0})};
}

Stage corridor(oracle::Random& random) {
  const double width_m = random.uniform(7.0, 11.0);
  const double step_m = random.uniform(3.0, 5.0);
  const double door_m = random.uniform(1.0, 1.6);
  const double depth_m = random.uniform(0.4, 0.8);
  SolidWorld world;
  world.solids = {{{-80.0, -4.0, -2.0}, {80.0, width_m + 4.0, 0.0}, 1},
                  {{-80.0, -4.0, 0.0}, {80.0, -depth_m, 4.0}, 2},
                  {{-80.0, width_m + depth_m, 0.0}, {80.0, width_m + 4.0, 4.0}, 2}};
  for (double x = -60.0; x < 60.0; x += step_m) {
    world.solids.push_back({{x, -depth_m, 0.0}, {x + step_m - door_m, 0.0, 4.0}, 2});
    world.solids.push_back({{x, width_m, 0.0}, {x + step_m - door_m, width_m + depth_m, 4.0}, 2});
  }
  const double to_m = random.uniform(8.0, 14.0);
  const double from_m = random.uniform(-14.0, -8.0);
  const double side_m = depth_m + 0.5;
  return {world,
          seen({from_m - random.uniform(4.0, 10.0), -side_m, -0.5}, {to_m, width_m + side_m, 3.5}),
          seen({from_m, -side_m, -0.5}, {to_m + random.uniform(4.0, 10.0), width_m + side_m, 3.5}),
          {from_m, 0.0, to_m, width_m}};
}

Stage pillars(oracle::Random& random) {
  const int count = 6 + random.below(7);
  const double radius_m = random.uniform(8.0, 12.0);
  const double half_m = random.uniform(0.5, 1.0);
  const double phase = random.uniform(0.0, 2.0 * std::numbers::pi);
  SolidWorld world;
  world.solids = {{{-20.0, -20.0, -2.0}, {20.0, 20.0, 0.0}, 1}};
  for (int i = 0; i < count; ++i) {
    const double angle = phase + 2.0 * std::numbers::pi * i / count;
    const double x = radius_m * std::cos(angle);
    const double y = radius_m * std::sin(angle);
    world.solids.push_back({{x - half_m, y - half_m, 0.0}, {x + half_m, y + half_m, 4.0}, 2});
  }
  const double reach_m = radius_m + 2.0;
  const double cut_m = random.uniform(0.0, 0.4) * radius_m;
  return {world,
          seen({-reach_m, -reach_m, -0.5}, {reach_m - cut_m, reach_m, 3.5}),
          seen({cut_m - reach_m, -reach_m, -0.5}, {reach_m, reach_m, 3.5}),
          {-0.6 * radius_m, -0.6 * radius_m, 0.6 * radius_m, 0.6 * radius_m}};
}

Stage equal_houses(oracle::Random& random) {
  const double lot_m = random.uniform(8.0, 11.0);
  const double house_m = lot_m - random.uniform(2.0, 4.0);
  const double road_m = random.uniform(4.0, 6.0);  // To either side.
  const double depth_m = random.uniform(3.0, 4.5);
  const double porch_m = random.uniform(0.6, 1.4);
  const bool both_sides = random.below(2) == 0;
  SolidWorld world;
  world.solids = {{{-80.0, -20.0, -2.0}, {80.0, 20.0, 0.0}, 1}};
  for (int lot = -6; lot < 6; ++lot) {
    const double x = lot * lot_m;
    world.solids.push_back({{x, road_m, 0.0}, {x + house_m, road_m + depth_m, 5.0}, 2});
    world.solids.push_back({{x + 0.5, road_m - porch_m, 0.0}, {x + 2.0, road_m, 2.4}, 2});
    if (!both_sides) continue;
    world.solids.push_back({{x, -road_m - depth_m, 0.0}, {x + house_m, -road_m, 5.0}, 2});
    world.solids.push_back({{x + 0.5, -road_m, 0.0}, {x + 2.0, porch_m - road_m, 2.4}, 2});
  }
  const double to_m = random.uniform(8.0, 14.0);
  const double from_m = random.uniform(-14.0, -8.0);
  const double side_m = road_m + depth_m + 1.0;
  return {world,
          seen({from_m - random.uniform(3.0, 8.0), -side_m, -0.5}, {to_m, side_m, 4.0}),
          seen({from_m, -side_m, -0.5}, {to_m + random.uniform(3.0, 8.0), side_m, 4.0}),
          {from_m, 1.0 - road_m, to_m, road_m - porch_m - 0.5}};
}

Stage terraces(oracle::Random& random) {
  const double step_m = random.uniform(1.4, 2.6);
  const double rise_m = random.uniform(0.3, 0.6);
  const double width_m = random.uniform(12.0, 18.0);
  SolidWorld world;
  for (int step = -16; step < 16; ++step) {
    const double x = step * step_m;
    const double z = step * rise_m;
    world.solids.push_back({{x, -2.0, z - 3.0}, {x + step_m, width_m + 2.0, z}, 1});
    world.solids.push_back({{x, -2.0, z}, {x + step_m, 0.0, z + 3.0}, 2});
    world.solids.push_back({{x, width_m, z}, {x + step_m, width_m + 2.0, z + 3.0}, 2});
  }
  const int last = 3 + random.below(2);
  const int before = 1 + random.below(3);
  const double low_z = -8.0 * rise_m;
  const double high_z = 8.0 * rise_m + 2.0;
  return {world,
          seen({-step_m * (last + before), -0.5, low_z}, {step_m * last, width_m + 0.5, high_z}),
          seen({-step_m * last, -0.5, low_z}, {step_m * (last + before), width_m + 0.5, high_z}),
          {-step_m * last, 0.0, step_m * last, width_m, rise_m}};
}

Stage stage_of(SymmetricScene scene, oracle::Random& random) {
  switch (scene) {
    case SymmetricScene::kSquareRoom:
      return square_room(random);
    case SymmetricScene::kTwinRooms:
      return twin_rooms(random, {0.0, 0.08}, {0.88, 0.95});
    case SymmetricScene::kMirroredHall:
      return hall_of_halves(random, false, {0.75, 0.95});
    case SymmetricScene::kCorridor:
      return corridor(random);
    case SymmetricScene::kPillars:
      return pillars(random);
    case SymmetricScene::kEqualHouses:
      return equal_houses(random);
    case SymmetricScene::kTerraces:
      return terraces(random);
    case SymmetricScene::kTwinEnds:
      return twin_rooms(random, {0.15, 0.3}, {0.5, 0.6});
    case SymmetricScene::kTurnedEnds:
      break;
  }
  return hall_of_halves(random, true, {0.6, 0.68});
}

Matrix34d draw_frame(oracle::Random& random, double most_shift_m) {
  const double yaw_deg = random.uniform(-180.0, 180.0);
  const double tilt_deg = random.uniform(0.0, 3.0);
  const double axis_deg = random.uniform(-180.0, 180.0);
  const double x_m = random.uniform(-most_shift_m, most_shift_m);
  const double y_m = random.uniform(-most_shift_m, most_shift_m);
  return frame_of(yaw_deg, tilt_deg, axis_deg, {x_m, y_m, random.uniform(-1.0, 1.0)});
}

}  // namespace

const char* to_string(SymmetricScene scene) noexcept {
  constexpr std::array<const char*, kScenes> kNames{"square room", "twin rooms", "mirrored hall",
                                                    "corridor",    "pillars",    "equal houses",
                                                    "terraces",    "twin ends",  "turned ends"};
  return kNames[static_cast<std::size_t>(scene)];
}

SymmetricPair symmetric_pair(SymmetricScene scene, Landmarks landmarks, std::uint64_t seed,
                             const ClassTable& classes) {
  oracle::Random random(seed * kScenes + static_cast<std::uint64_t>(scene));
  Stage stage = stage_of(scene, random);
  // Turns are about the middle of what both see, so that shifts stay small.
  const Region& common = stage.common;
  const Matrix34d T_middle_world =
      frame_of(0.0, 0.0, 0.0,
               {-0.5 * (common.low_x + common.high_x), -0.5 * (common.low_y + common.high_y), 0.0});
  stage.a.T_map_world = product(draw_frame(random, 0.0), T_middle_world);
  stage.b.T_map_world = product(draw_frame(random, 4.0), T_middle_world);
  // Last, so that a seed's scenes differ by their landmarks alone.
  add_landmarks(stage, landmarks, random);
  return {map_of(stage.world, stage.a, classes), map_of(stage.world, stage.b, classes),
          product(stage.a.T_map_world, inverse(stage.b.T_map_world)),
          product(product(stage.a.T_map_world, stage.T_world_alike), inverse(stage.b.T_map_world))};
}

}  // namespace tessera
