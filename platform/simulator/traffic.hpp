// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Moving objects: the robots, the other cars in their lanes, people on the sidewalks. Everything is
// a function of time (seconds since the first scan), so scans can be made in any order. Traffic
// keeps to the right.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "simulator/ground.hpp"
#include "simulator/primitive.hpp"

namespace tessera::street {

constexpr double kScanPeriod_s = 0.1;

class Traffic {
 public:
  /// The robots are in two queues, even numbers heading for +x and odd ones for -x. The first ones,
  /// 0 and 1, start apart_m from each other along the street.
  Traffic(std::uint64_t seed, int robots, double apart_m)
      : seed_(seed), robots_(robots), apart_m_(apart_m) {}

  /// Even robots drive towards +x (their right side has y < 0), odd ones towards -x.
  static int heading(int robot) { return robot % 2 == 0 ? 1 : -1; }
  /// Position along the street's axis, metres. The robots 0 and 1 start equally far before and
  /// behind the middle.
  [[nodiscard]] double along(int robot, double time_s) const;
  /// Metres driven since the first scan.
  [[nodiscard]] double driven(int robot, double time_s) const;
  /// The sensor's pose in the street frame: x forward, y left, z up of the vehicle, height_m above
  /// the road.
  [[nodiscard]] Eigen::Isometry3d T_street_sensor(const Ground& ground, int robot, double time_s,
                                                  double height_m) const;
  /// The moving solids at that time, without the observing robot's own vehicle.
  [[nodiscard]] std::vector<Primitive> solids(const Ground& ground, double half_length_m,
                                              int observer, double time_s) const;

 private:
  [[nodiscard]] double speed(int lane_heading) const;
  [[nodiscard]] double across(int robot, double driven_m) const;
  void add_cars(const Ground& ground, double half_length_m, int observer, double time_s,
                std::vector<Primitive>& solids) const;
  void add_walkers(const Ground& ground, double half_length_m, double time_s,
                   std::vector<Primitive>& solids) const;
  void add_crossing(const Ground& ground, double time_s, std::vector<Primitive>& solids) const;

  std::uint64_t seed_;
  int robots_;
  double apart_m_;
};

}  // namespace tessera::street
