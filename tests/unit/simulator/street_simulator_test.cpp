// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The simulated street from outside: determinism, frames, classes, and two robots that see one
// world.
#include "simulator/street_simulator.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

namespace {

using tessera::Outcome;
using tessera::SimulatedScan;
using tessera::SimulatorConfig;
using tessera::StreetSimulator;

Outcome<StreetSimulator> street(std::uint64_t seed, int robots = 2, int scans = 20) {
  SimulatorConfig config;
  config.seed = seed;
  config.robots = robots;
  config.scans = scans;
  return StreetSimulator::make(config);
}

bool same_bytes(const SimulatedScan& a, const SimulatedScan& b) {
  return a.points.size() == b.points.size() && a.labels == b.labels &&
         a.predictions == b.predictions &&
         std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(a.points[0])) == 0;
}

Eigen::Vector3d in_street(const StreetSimulator& simulator, int robot, int index,
                          const std::array<float, 4>& point) {
  const Eigen::Vector3d p_sensor = Eigen::Vector3f(point[0], point[1], point[2]).cast<double>();
  return simulator.T_global_sensor(robot, index) * p_sensor;
}

}  // namespace

TEST_CASE("StreetSimulator: the same seed gives the same bytes, whatever was scanned before") {
  const auto a = street(3);
  const auto b = street(3);
  (void)b->scan(0, 4);
  (void)b->scan(1, 9);
  CHECK(same_bytes(a->scan(1, 5), b->scan(1, 5)));
}

TEST_CASE("StreetSimulator: another seed gives another street") {
  CHECK_FALSE(same_bytes(street(3)->scan(1, 5), street(4)->scan(1, 5)));
}

TEST_CASE("StreetSimulator: a scan does not depend on how many there will be") {
  CHECK(same_bytes(street(3, 2, 1)->scan(1, 2), street(3, 2, 60)->scan(1, 2)));
}

TEST_CASE(
    "StreetSimulator: every point has a label and a prediction, and predictions are never empty") {
  const SimulatedScan scan = street(1)->scan(0, 0);
  CHECK(scan.labels.size() == scan.points.size());
  CHECK(scan.predictions.size() == scan.points.size());
  CHECK(std::count(scan.predictions.begin(), scan.predictions.end(), 0U) == 0);
}

TEST_CASE("StreetSimulator: even robots have 64 beams, odd ones 16") {
  const auto simulator = street(1);
  CHECK(simulator->scan(0, 0).points.size() > 90000);
  const std::size_t few = simulator->scan(1, 0).points.size();
  CHECK(few > 15000);
  CHECK(few < 16 * 1800);
}

TEST_CASE("StreetSimulator: all values are finite and within the scanner's range") {
  const auto simulator = street(2);
  for (const auto& p : simulator->scan(1, 3).points) {
    const float range_m = std::hypot(p[0], p[1], p[2]);
    REQUIRE(std::isfinite(range_m));
    REQUIRE(range_m < 100.01F);
    REQUIRE(p[3] >= 0.0F);
    REQUIRE(p[3] <= 1.0F);
  }
}

TEST_CASE("StreetSimulator: a robot's first pose is the identity, its map frame") {
  const auto simulator = street(1);
  for (const int robot : {0, 1}) {
    CHECK(simulator->T_map_sensor(robot, 0).matrix() == Eigen::Matrix4d::Identity());
    CHECK(simulator->T_global_map(robot).matrix() == simulator->T_global_sensor(robot, 0).matrix());
  }
}

TEST_CASE("StreetSimulator: poses are rigid and compose") {
  const auto simulator = street(1);
  const Eigen::Isometry3d T_map_sensor = simulator->T_map_sensor(1, 7);
  CHECK((T_map_sensor.linear() * T_map_sensor.linear().transpose() - Eigen::Matrix3d::Identity())
            .norm() < 1e-12);
  CHECK(T_map_sensor.linear().determinant() == Approx(1.0));
  const Eigen::Isometry3d T_global_sensor = simulator->T_global_map(1) * T_map_sensor;
  CHECK((T_global_sensor.matrix() - simulator->T_global_sensor(1, 7).matrix()).norm() < 1e-9);
}

TEST_CASE("StreetSimulator: robots drive forwards, 0.8 to 1 m a scan, towards each other") {
  const auto simulator = street(1);
  for (const int robot : {0, 1}) {
    const Eigen::Vector3d step = simulator->T_map_sensor(robot, 1).translation();
    CHECK(step.x() > 0.8);
    CHECK(step.x() < 1.0);
    CHECK(std::abs(step.y()) < 0.1);
  }
  const double x0 = simulator->T_global_map(0).translation().x();
  const double x1 = simulator->T_global_map(1).translation().x();
  CHECK(x0 < -20.0);
  CHECK(x1 > 20.0);
  CHECK(simulator->T_global_sensor(0, 10).translation().x() > x0);
  CHECK(simulator->T_global_sensor(1, 10).translation().x() < x1);
  CHECK(simulator->T_global_map(0).translation().y() *
            simulator->T_global_map(1).translation().y() <
        0.0);
}

TEST_CASE("StreetSimulator: the truth holds all the classes of a street") {
  const auto simulator = street(1);
  std::set<std::uint32_t> seen;
  for (const int robot : {0, 1}) {
    const SimulatedScan scan = simulator->scan(robot, 10);
    seen.insert(scan.labels.begin(), scan.labels.end());
  }
  for (const std::uint32_t id :
       {0U, 10U, 11U, 30U, 40U, 44U, 48U, 50U, 51U, 70U, 71U, 72U, 80U, 81U, 252U, 254U}) {
    CAPTURE(id);
    CHECK(seen.count(id) == 1);
  }
}

TEST_CASE("StreetSimulator: predictions name static classes only") {
  const SimulatedScan scan = street(1)->scan(0, 10);
  for (const std::uint32_t id : scan.predictions) REQUIRE(id < 252);
}

TEST_CASE("StreetSimulator: few points are unlabelled in the truth") {
  const SimulatedScan scan = street(1)->scan(0, 0);
  const auto unlabelled =
      static_cast<double>(std::count(scan.labels.begin(), scan.labels.end(), 0U));
  const double share = unlabelled / static_cast<double>(scan.labels.size());
  CHECK(share > 0.003);
  CHECK(share < 0.06);
}

TEST_CASE("StreetSimulator: both robots measure the same street") {
  // The road's height where both have seen it; they are 15 m apart and face each other.
  const auto simulator = street(1, 2, 40);
  std::map<std::pair<int, int>, double> height_by_place;
  const SimulatedScan first = simulator->scan(0, 26);
  const auto place = [](const Eigen::Vector3d& p) {
    return std::pair(static_cast<int>(std::floor(p.x() * 4.0)),
                     static_cast<int>(std::floor(p.y() * 4.0)));
  };
  for (std::size_t i = 0; i < first.points.size(); ++i) {
    const Eigen::Vector3d p = in_street(*simulator, 0, 26, first.points[i]);
    if (first.labels[i] == 40) height_by_place[place(p)] = p.z();
  }
  const SimulatedScan second = simulator->scan(1, 26);
  int compared = 0;
  int apart = 0;
  for (std::size_t i = 0; i < second.points.size(); ++i) {
    const Eigen::Vector3d p = in_street(*simulator, 1, 26, second.points[i]);
    const auto other = height_by_place.find(place(p));
    if (second.labels[i] != 40 || other == height_by_place.end()) continue;
    ++compared;
    apart += std::abs(p.z() - other->second) > 0.05 ? 1 : 0;
  }
  CHECK(compared > 500);
  CHECK(apart * 100 < compared);
}

TEST_CASE("StreetSimulator: moving cars move") {
  const auto simulator = street(1);
  const auto near_car = [&](int index) {
    double farthest = -1e9;
    const SimulatedScan scan = simulator->scan(1, index);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (scan.labels[i] == 252 && in_street(*simulator, 1, index, scan.points[i]).y() < 0.0) {
        farthest = std::max(farthest, in_street(*simulator, 1, index, scan.points[i]).x());
      }
    }
    return farthest;
  };
  // The front of the foremost car that heads for +x advances with its lane.
  const double before = near_car(4);
  REQUIRE(before > -1e8);
  CHECK(std::abs(near_car(5) - before) > 0.3);
}

TEST_CASE("StreetSimulator: robots see each other as moving cars") {
  const auto simulator = street(1, 2, 40);
  const SimulatedScan scan = simulator->scan(0, 20);
  const Eigen::Vector3d other = simulator->T_global_sensor(1, 20).translation();
  int points = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d p = in_street(*simulator, 0, 20, scan.points[i]);
    if (scan.labels[i] == 252 && (p - other).head<2>().norm() < 3.0) ++points;
  }
  CHECK(points > 20);
}

TEST_CASE("StreetSimulator: an unknown scene is refused by name") {
  SimulatorConfig config;
  config.scene = "moon";
  const auto outcome = StreetSimulator::make(config);
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == tessera::FailureKind::kUsage);
  CHECK(outcome.failure().text().find("moon") != std::string::npos);
}

TEST_CASE("StreetSimulator: robots and scans outside their ranges are refused") {
  CHECK_FALSE(street(1, 0).ok());
  CHECK(street(1, 1, 1).ok());
  CHECK(street(1, 8, 1).ok());
  CHECK_FALSE(street(1, 9, 1).ok());
  CHECK_FALSE(street(1, 2, 0).ok());
  CHECK(street(1, 2, 1000).ok());
  CHECK_FALSE(street(1, 2, 1001).ok());
}
