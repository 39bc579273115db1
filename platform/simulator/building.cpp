// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The front is a skin of bands and piers before a core: openings in the skin are windows or door
// recesses.
#include "simulator/building.hpp"

#include <algorithm>

namespace tessera::street {
namespace {

constexpr double kRecess_m = 0.22;
constexpr double kWallsBelow_m = 1.2;  // Gardens rise and fall; the walls go down into them.
constexpr double kStorey_m = 2.9;
constexpr double kSill_m = 0.95;
constexpr double kWindowHeight_m = 1.35;

struct Front {
  int bays = 3;
  double bay_m = 3.0;
  double half_window_m = 0.6;
  int door_bay = 1;
};

Surface wall_surface(Random& random) {
  Surface wall = surface_of(RawId::kBuilding);
  wall.reflectivity = random.uniform(0.16, 0.42);
  return wall;
}

Surface window_surface() {
  Surface glass = surface_of(RawId::kBuilding);
  glass.loss = 0.6;
  glass.reflectivity = 0.1;
  return glass;
}

double bay_centre(const House& house, const Front& front, int bay) {
  return (bay + 0.5) * front.bay_m - 0.5 * house.width_m;
}

/// The wall of one storey from z0 upwards: sill band, lintel band, and the piers between the
/// windows.
void add_storey(Assembly& out, const House& house, const Front& front, int storey,
                const Surface& wall) {
  const double z0 = storey * kStorey_m;
  const double y = -0.5 * kRecess_m;
  const Eigen::Vector2d band(0.5 * house.width_m, 0.5 * kRecess_m);
  const double lintel = z0 + kSill_m + kWindowHeight_m;
  out.box({0, y, lintel}, band, z0 + kStorey_m - lintel, wall);
  const double pier_half = 0.5 * front.bay_m - front.half_window_m;
  for (int bay = 0; bay <= front.bays; ++bay) {
    const double x = bay * front.bay_m - 0.5 * house.width_m;
    const bool corner = bay == 0 || bay == front.bays;
    const double inward = bay == 0 ? 0.5 * pier_half : -0.5 * pier_half;
    out.box({corner ? x + inward : x, y, z0 + kSill_m},
            {corner ? 0.5 * pier_half : pier_half, 0.5 * kRecess_m}, kWindowHeight_m, wall);
  }
  // The band below the sills is open where the door is.
  for (int bay = 0; bay < front.bays; ++bay) {
    const double x = bay_centre(house, front, bay);
    const double below = storey == 0 ? kWallsBelow_m : 0.0;
    if (storey == 0 && bay == front.door_bay) {
      for (const double side : {1.0, -1.0}) {
        out.box({x + side * 0.5 * (0.5 * front.bay_m + front.half_window_m), y, z0 - below},
                {0.5 * pier_half, 0.5 * kRecess_m}, kSill_m + below, wall);
      }
      out.box({x, 0.4, -kWallsBelow_m}, {0.8, 0.4}, kWallsBelow_m + 0.15, wall);  // Doorstep.
      continue;
    }
    out.box({x, y, z0 - below}, {0.5 * front.bay_m, 0.5 * kRecess_m}, kSill_m + below, wall);
    out.box({x, 0.04, z0 + kSill_m - 0.06}, {front.half_window_m + 0.08, 0.06}, 0.06, wall);
  }
}

void add_windows(Assembly& out, const House& house, const Front& front, int storey) {
  for (int bay = 0; bay < front.bays; ++bay) {
    if (storey == 0 && bay == front.door_bay) continue;
    const double x = bay_centre(house, front, bay);
    const double z = storey * kStorey_m + kSill_m;
    const double y = -kRecess_m + 0.01;
    out.box({x, y, z}, {front.half_window_m, 0.02}, kWindowHeight_m, window_surface());
    out.box({x, y + 0.04, z}, {0.04, 0.03}, kWindowHeight_m, surface_of(RawId::kBuilding));
  }
}

void add_balcony(Assembly& out, double x, double z, const Surface& wall) {
  constexpr double kDepth_m = 1.1;
  constexpr double kHalf_m = 1.25;
  out.box({x, 0.5 * kDepth_m, z}, {kHalf_m, 0.5 * kDepth_m}, 0.16, wall);
  out.box({x, kDepth_m - 0.03, z + 1.0}, {kHalf_m, 0.03}, 0.07, wall);
  for (int bar = 0; bar <= 10; ++bar) {
    out.box({x - kHalf_m + 0.03 + bar * (2.0 * kHalf_m - 0.06) / 10.0, kDepth_m - 0.03, z + 0.16},
            {0.025, 0.025}, 0.85, wall);
  }
  for (const double side : {kHalf_m - 0.03, -kHalf_m + 0.03}) {
    out.box({x + side, 0.5 * kDepth_m, z + 0.16}, {0.03, 0.5 * kDepth_m}, 0.9, wall);
  }
}

void add_roof(Assembly& out, Random& random, const House& house, double eaves) {
  const Surface tiles = wall_surface(random);
  const double middle = -0.5 * house.depth_m;
  const Eigen::Vector2d foot(0.5 * house.width_m + 0.15, 0.5 * house.depth_m + 0.45);
  if (random.chance(0.2)) {
    out.box({0, middle, eaves}, foot, 0.45, tiles);
    return;
  }
  const double ridge = random.chance(0.6) ? foot.x() : foot.x() * 0.55;
  out.tapered({0, middle, eaves}, foot, {ridge, 0.05}, random.uniform(2.2, 3.4), tiles);
  out.box({random.uniform(-0.3, 0.3) * house.width_m, middle + 0.8, eaves}, {0.35, 0.35}, 3.3,
          tiles);
}

}  // namespace

void add_house(Assembly& out, Random random, const House& house) {
  const Surface wall = wall_surface(random);
  Front front;
  front.bays = std::max(2, static_cast<int>(house.width_m / random.uniform(2.3, 3.0)));
  front.bay_m = house.width_m / front.bays;
  front.half_window_m = std::min(random.uniform(0.5, 0.75), 0.36 * front.bay_m);
  front.door_bay = random.below(front.bays);
  const double eaves = house.storeys * kStorey_m;
  const double core_depth = house.depth_m - kRecess_m;
  out.box({0, -kRecess_m - 0.5 * core_depth, -kWallsBelow_m},
          {0.5 * house.width_m, 0.5 * core_depth}, eaves + kWallsBelow_m, wall);
  for (int storey = 0; storey < house.storeys; ++storey) {
    add_storey(out, house, front, storey, wall);
    add_windows(out, house, front, storey);
  }
  if (house.balconies) {
    for (int storey = 1; storey < house.storeys; ++storey) {
      for (int bay = storey % 2; bay < front.bays; bay += 2) {
        add_balcony(out, bay_centre(house, front, bay), storey * kStorey_m - 0.1, wall);
      }
    }
  }
  add_roof(out, random, house, eaves);
}

}  // namespace tessera::street
