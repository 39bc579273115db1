// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How far apart simulated robots start.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "simulator/street_simulator.hpp"
#include "simulator/traffic.hpp"

namespace {

using tessera::SimulatedScan;
using tessera::SimulatorConfig;
using tessera::StreetSimulator;
using tessera::street::Ground;
using tessera::street::Primitive;
using tessera::street::RawId;
using tessera::street::Traffic;

StreetSimulator street_apart(double apart_m, int robots = 2, int scans = 20) {
  SimulatorConfig config;
  config.seed = 5;
  config.robots = robots;
  config.scans = scans;
  config.apart_m = apart_m;
  auto made = StreetSimulator::make(config);
  REQUIRE(made.ok());
  return std::move(*made);
}

double along(const StreetSimulator& simulator, int robot, int index) {
  return simulator.T_global_sensor(robot, index).translation().x();
}

/// Where along the street a robot sees what stands, from and to.
std::pair<double, double> seen_along(const StreetSimulator& simulator, int robot, int index) {
  const SimulatedScan scan = simulator.scan(robot, index);
  const Eigen::Isometry3d T_global_sensor = simulator.T_global_sensor(robot, index);
  std::pair<double, double> seen{1e9, -1e9};
  for (const auto& p : scan.points) {
    const double x = (T_global_sensor * Eigen::Vector3f(p[0], p[1], p[2]).cast<double>()).x();
    seen = {std::min(seen.first, x), std::max(seen.second, x)};
  }
  return seen;
}

/// The least distance along the street between the head of somebody who crosses and the slots of
/// the lane they are in. Robot 0 or 1 is in one of those, and the next ones are 24 m apart.
double room_to_slots(const Traffic& traffic, const Ground& ground) {
  constexpr double kGap_m = 24.0;
  double least_m = kGap_m;
  for (double time_s = 0.0; time_s < 9.0; time_s += 0.02) {
    for (const Primitive& solid : traffic.solids(ground, 10.0, -1, time_s)) {
      constexpr double kLane_m = 1.75;
      constexpr double kHalfCar_m = 1.0;
      const double y = solid.base.y();
      const bool is_head = solid.surface.id == RawId::kMovingPerson && solid.extent.z() == 0.13;
      if (!is_head || std::abs(std::abs(y) - kLane_m) > kHalfCar_m) continue;
      const int lane = y < 0.0 ? 0 : 1;
      const double from_robot_m = solid.base.x() - traffic.along(lane, time_s);
      least_m = std::min(least_m, std::abs(std::remainder(from_robot_m, kGap_m)));
    }
  }
  return least_m;
}

}  // namespace

TEST_CASE("StreetSimulator: robots start as far apart as they are asked to, about the middle") {
  for (const double apart_m : {0.0, 1.0, 60.0, 333.3, SimulatorConfig::kMostApart_m}) {
    CAPTURE(apart_m);
    const StreetSimulator simulator = street_apart(apart_m, 4);
    CHECK(along(simulator, 1, 0) - along(simulator, 0, 0) == Approx(apart_m).margin(1e-9));
    CHECK(along(simulator, 0, 0) == Approx(-0.5 * apart_m).margin(1e-9));
    CHECK(along(simulator, 2, 0) == Approx(along(simulator, 0, 0) - 24.0));
    CHECK(along(simulator, 3, 0) == Approx(along(simulator, 1, 0) + 24.0));
  }
}

TEST_CASE("StreetSimulator: without another distance robots start 60 m apart, byte by byte") {
  SimulatorConfig config;
  config.seed = 5;
  const auto usual = StreetSimulator::make(config);
  CHECK(usual->scan(1, 3).points == street_apart(60.0).scan(1, 3).points);
  CHECK_FALSE(usual->scan(1, 3).points == street_apart(61.0).scan(1, 3).points);
}

TEST_CASE("StreetSimulator: wherever robots start and end, there is a street around them") {
  for (const double apart_m : {0.0, SimulatorConfig::kMostApart_m}) {
    constexpr int kScans = 300;
    const StreetSimulator simulator = street_apart(apart_m, 8, kScans);
    for (const int robot : {0, 7}) {
      for (const int index : {0, kScans - 1}) {
        CAPTURE(apart_m, robot, index);
        const double x = along(simulator, robot, index);
        const auto [from_m, to_m] = seen_along(simulator, robot, index);
        CHECK(from_m < x - 15.0);
        CHECK(to_m > x + 15.0);
      }
    }
  }
}

TEST_CASE("StreetSimulator: robots far apart have seen nothing in common until they meet") {
  constexpr double kApart_m = 400.0;
  const StreetSimulator simulator = street_apart(kApart_m, 2, 250);
  const auto share_a_view = [&](int index) {
    return seen_along(simulator, 0, index).second > seen_along(simulator, 1, index).first;
  };
  // Each drives 0.84 to 0.96 m a scan and sees 120 m at most: 160 m are not seen by anybody.
  CHECK_FALSE(share_a_view(0));
  CHECK_FALSE(share_a_view(80));
  CHECK(share_a_view(200));
  CHECK(along(simulator, 0, 249) > along(simulator, 1, 249));
}

TEST_CASE("StreetSimulator: who crosses the road has the same room to cars at any distance") {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Ground ground(seed, 10.0);
    const double usual_m = room_to_slots(Traffic(seed, 2, 60.0), ground);
    for (const double apart_m : {0.0, 36.0, 72.0, 84.0, 95.0, 117.0, 1999.0}) {
      CAPTURE(seed, apart_m);
      CHECK(room_to_slots(Traffic(seed, 2, apart_m), ground) == Approx(usual_m).margin(0.25));
    }
  }
}

TEST_CASE("StreetSimulator: distances that no street has are refused with the range") {
  for (const double apart_m :
       {-0.1, SimulatorConfig::kMostApart_m + 0.1, std::numeric_limits<double>::infinity(),
        std::numeric_limits<double>::quiet_NaN()}) {
    SimulatorConfig config;
    config.apart_m = apart_m;
    const auto made = StreetSimulator::make(config);
    REQUIRE_FALSE(made.ok());
    CHECK(made.failure().kind == tessera::FailureKind::kUsage);
    CHECK(made.failure().text().find("0 to 2000 m") != std::string::npos);
  }
}
