// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Each lane is a queue of equally spaced slots that all drive at the lane's speed, so nothing can
// collide; robots take the first slots and cars some of the others.
#include "simulator/traffic.hpp"

#include <cmath>
#include <numbers>

#include "simulator/random.hpp"
#include "simulator/street_furniture.hpp"

namespace tessera::street {
namespace {

constexpr double kUsualApart_m = 60.0;
constexpr double kQueueGap_m = 24.0;
constexpr double kLane_m = 1.75;
constexpr double kWalkerSlot_m = 15.0;

std::uint32_t object_of(std::uint64_t hash) { return static_cast<std::uint32_t>(hash) | 1U; }

}  // namespace

double Traffic::speed(int lane_heading) const {
  return 8.4 + 1.2 * unit_of(hash_of(seed_, Stream::kDrive, lane_heading));
}

double Traffic::driven(int robot, double time_s) const { return speed(heading(robot)) * time_s; }

double Traffic::along(int robot, double time_s) const {
  const double from_middle = -0.5 * apart_m_ - kQueueGap_m * (robot / 2) + driven(robot, time_s);
  return heading(robot) * from_middle;
}

double Traffic::across(int robot, double driven_m) const {
  const double phase = 2.0 * std::numbers::pi * unit_of(hash_of(seed_, Stream::kDrive, 100, robot));
  return -heading(robot) * kLane_m + 0.15 * std::sin(driven_m / 9.0 + phase);
}

Eigen::Isometry3d Traffic::T_street_sensor(const Ground& ground, int robot, double time_s,
                                           double height_m) const {
  constexpr double kAhead_m = 0.5;
  const double x = along(robot, time_s);
  const double s = driven(robot, time_s);
  const double sideways =
      (across(robot, s + kAhead_m) - across(robot, s - kAhead_m)) / (2.0 * kAhead_m);
  const double yaw =
      heading(robot) > 0 ? std::atan(sideways) : std::numbers::pi - std::atan(sideways);
  const double climb = heading(robot) *
                       (ground.road_height(x + kAhead_m) - ground.road_height(x - kAhead_m)) /
                       (2.0 * kAhead_m);
  const double nod = 0.004 * std::sin(s / 1.9 + robot);
  const double roll = 0.006 * std::sin(s / 3.1 + 2.0 * robot);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(nod - std::atan(climb), Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() =
      Eigen::Vector3d(x, across(robot, s), ground.road_height(x) + 0.03 + height_m);
  return pose;
}

void Traffic::add_cars(const Ground& ground, double half_length_m, int observer, double time_s,
                       std::vector<Primitive>& solids) const {
  for (const int lane : {0, 1}) {
    const double first = heading(lane) * along(lane, time_s);
    const int ahead = static_cast<int>((half_length_m - first) / kQueueGap_m);
    const int behind = static_cast<int>((half_length_m + first) / kQueueGap_m);
    for (int slot = -behind; slot <= ahead; ++slot) {
      const int robot = lane - 2 * slot;
      const bool is_robot = slot <= 0 && robot < robots_;
      if (is_robot && robot == observer) continue;
      const std::uint64_t hash = hash_of(seed_, Stream::kTraffic, lane, slot);
      if (!is_robot && unit_of(hash) > 0.55) continue;
      const double x = heading(lane) * (first + slot * kQueueGap_m);
      const Placement at{{x, -heading(lane) * kLane_m, ground.road_height(x) + 0.03},
                         lane == 0 ? 0.0 : std::numbers::pi};
      Assembly car(solids, at, object_of(hash));
      add_car(car, Random(hash), RawId::kMovingCar);
    }
  }
}

void Traffic::add_walkers(const Ground& ground, double half_length_m, double time_s,
                          std::vector<Primitive>& solids) const {
  const int slots = static_cast<int>(half_length_m / kWalkerSlot_m);
  for (const int side : {-1, 1}) {
    for (int slot = -slots; slot <= slots; ++slot) {
      Random random(hash_of(seed_, Stream::kWalker, side, slot));
      if (random.chance(0.35)) continue;
      const double pace = random.uniform(0.9, 1.6) * (random.chance(0.5) ? 1.0 : -1.0);
      const double x = slot * kWalkerSlot_m + random.uniform(-5.0, 5.0) + pace * time_s;
      const double y = side * random.uniform(6.75, 7.35);
      if (std::abs(x) > half_length_m) continue;
      Assembly person(solids, {{x, y, ground.height(x, y)}, pace > 0.0 ? 0.0 : std::numbers::pi},
                      object_of(random.next()));
      add_person(person, Random(random.next()), RawId::kMovingPerson, 5.5 * time_s + slot);
    }
  }
}

/// Someone who crosses in front of the park, timed to slip between the slots of both lanes.
void Traffic::add_crossing(const Ground& ground, double time_s,
                           std::vector<Primitive>& solids) const {
  // The time and the place are right for the usual start. Another one shifts both lanes' slots back
  // by the same distance, of which whole gaps change nothing: at this later time and farther place
  // the slots are around the person as they are there.
  const double back_m = 0.5 * (apart_m_ - kUsualApart_m);
  const double shift_m = back_m - kQueueGap_m * std::round(back_m / kQueueGap_m);
  const double later_s = 2.0 * shift_m / (speed(1) + speed(-1));
  const double farther_m = 0.5 * later_s * (speed(1) - speed(-1));
  Random random(hash_of(seed_, Stream::kWalker, 0));
  const double y = -5.15 + 1.5 * (time_s - later_s);
  if (y > 7.0) return;
  const double x = random.uniform(1.0, 2.5) + farther_m;
  Assembly person(solids, {{x, y, ground.height(x, y)}, 0.5 * std::numbers::pi},
                  object_of(random.next()));
  add_person(person, Random(random.next()), RawId::kMovingPerson, 6.0 * time_s);
}

std::vector<Primitive> Traffic::solids(const Ground& ground, double half_length_m, int observer,
                                       double time_s) const {
  std::vector<Primitive> solids;
  add_cars(ground, half_length_m, observer, time_s, solids);
  add_walkers(ground, half_length_m, time_s, solids);
  add_crossing(ground, time_s, solids);
  return solids;
}

}  // namespace tessera::street
