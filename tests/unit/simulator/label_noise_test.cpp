// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The predicted labels err as a network does: often enough, in clusters, alike over scans,
// differently between robots.
#include "simulator/label_noise.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <utility>

#include "simulator/confusion.hpp"
#include "simulator/street_simulator.hpp"

namespace {

using tessera::SimulatedScan;
using tessera::SimulatorConfig;
using tessera::StreetSimulator;
using tessera::street::learned_id;
using tessera::street::mistake_probability;
using tessera::street::mistaken_for;
using tessera::street::RawId;
using tessera::street::stray_answer;

StreetSimulator street(std::uint64_t seed) {
  SimulatorConfig config;
  config.seed = seed;
  config.scans = 40;
  auto simulator = StreetSimulator::make(config);
  REQUIRE(simulator.ok());
  return std::move(*simulator);
}

std::uint32_t learned(std::uint32_t truth) {
  return static_cast<std::uint32_t>(learned_id(static_cast<RawId>(truth)));
}

bool is_mistaken(const SimulatedScan& scan, std::size_t i) {
  return scan.labels[i] != 0 && learned(scan.labels[i]) != scan.predictions[i];
}

/// Mean intersection over union of the classes in the truth.
double mean_iou(const SimulatedScan& scan) {
  struct Counts {
    double both = 0.0;
    double truth = 0.0;
    double said = 0.0;
  };
  std::map<std::uint32_t, Counts> classes;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    if (scan.labels[i] == 0) continue;
    const std::uint32_t truth = learned(scan.labels[i]);
    classes[truth].truth += 1.0;
    classes[scan.predictions[i]].said += 1.0;
    if (truth == scan.predictions[i]) classes[truth].both += 1.0;
  }
  double sum = 0.0;
  double present = 0.0;
  for (const auto& [id, counts] : classes) {
    if (counts.truth <= 0.0) continue;
    sum += counts.both / (counts.truth + counts.said - counts.both);
    present += 1.0;
  }
  return sum / present;
}

/// Whether each voxel of 0.2 m of the street that the scan sees was mistaken.
using Mistakes = std::map<std::array<int, 3>, bool>;

Mistakes mistakes_by_place(const StreetSimulator& simulator, int robot, int index) {
  const SimulatedScan scan = simulator.scan(robot, index);
  const Eigen::Isometry3d T_global_sensor = simulator.T_global_sensor(robot, index);
  Mistakes mistakes;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (scan.labels[i] == 0 || scan.labels[i] >= 252) continue;
    const auto& point = scan.points[i];
    const Eigen::Vector3d p = T_global_sensor * Eigen::Vector3d(static_cast<double>(point[0]),
                                                                static_cast<double>(point[1]),
                                                                static_cast<double>(point[2]));
    const Eigen::Vector3i voxel = (p / 0.2).array().floor().cast<int>();
    mistakes[{voxel.x(), voxel.y(), voxel.z()}] = is_mistaken(scan, i);
  }
  return mistakes;
}

/// The share of places mistaken in both among those mistaken in `a` and seen in `b`.
double share_repeated(const Mistakes& a, const Mistakes& b) {
  double again = 0.0;
  double seen = 0.0;
  for (const auto& [voxel, mistaken] : a) {
    const auto other = b.find(voxel);
    if (!mistaken || other == b.end()) continue;
    seen += 1.0;
    again += other->second ? 1.0 : 0.0;
  }
  REQUIRE(seen > 50.0);
  return again / seen;
}

}  // namespace

TEST_CASE("Labels with weights: the first is the prediction, and none are left out of one label") {
  SimulatorConfig config{.scans = 3};
  const auto plain = StreetSimulator::make(config)->scan(1, 2);
  CHECK(plain.beliefs.empty());
  for (const int labels : {1, 2, 3}) {
    config.weighted_labels = labels;
    const SimulatedScan scan = StreetSimulator::make(config)->scan(1, 2);
    CHECK(scan.predictions == plain.predictions);
    const auto k = static_cast<std::size_t>(labels);
    REQUIRE(scan.beliefs.size() == k * scan.points.size());
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      std::uint32_t sum = 0;
      bool falls = true;
      for (std::size_t j = 0; j < k; ++j) {
        sum += scan.beliefs[k * i + j] >> 16U;
        falls = falls &&
                (j == 0 || scan.beliefs[k * i + j] >> 16U <= scan.beliefs[k * i + j - 1] >> 16U);
      }
      wrong +=
          (scan.beliefs[k * i] & 0xffffU) == scan.predictions[i] && falls && sum <= 255 ? 0U : 1U;
    }
    CHECK(wrong == 0);
  }
  config.weighted_labels = 4;
  CHECK_FALSE(StreetSimulator::make(config).ok());
}

TEST_CASE("Labels with weights: sure answers are right more often, errors name the truth often") {
  SimulatorConfig config{.scans = 1, .weighted_labels = 3};
  const SimulatedScan scan = StreetSimulator::make(config)->scan(0, 0);
  struct Counts {
    double points = 0.0;
    double right = 0.0;
    double weight = 0.0;
  };
  Counts unsure;
  Counts sure;
  double errors = 0.0;
  double second = 0.0;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    if (scan.labels[i] == 0) continue;
    const double weight = (scan.beliefs[3 * i] >> 16U) / 255.0;
    Counts& counts = weight < 0.8 ? unsure : sure;
    counts.points += 1.0;
    counts.weight += weight;
    counts.right += is_mistaken(scan, i) ? 0.0 : 1.0;
    if (!is_mistaken(scan, i)) continue;
    errors += 1.0;
    second += (scan.beliefs[3 * i + 1] & 0xffffU) == learned(scan.labels[i]) ? 1.0 : 0.0;
  }
  REQUIRE(unsure.points > 1000.0);
  REQUIRE(errors > 1000.0);
  CHECK(sure.right / sure.points > 0.85);
  CHECK(unsure.right / unsure.points < 0.75);
  // As networks, it is a little too sure.
  const double right = (sure.right + unsure.right) / (sure.points + unsure.points);
  const double said = (sure.weight + unsure.weight) / (sure.points + unsure.points);
  CHECK(said > right);
  CHECK(said < right + 0.1);
  CHECK(second / errors > 0.4);
  CHECK(second / errors < 0.8);
}

TEST_CASE("Confusion: mistakes grow with range and with incidence") {
  for (const RawId id : {RawId::kCar, RawId::kSidewalk, RawId::kBuilding, RawId::kPole}) {
    CHECK(mistake_probability(id, 40.0, 0.8) > mistake_probability(id, 10.0, 0.8));
    CHECK(mistake_probability(id, 20.0, 0.1) > mistake_probability(id, 20.0, 1.0));
  }
}

TEST_CASE("Confusion: roads are mistaken far more rarely than fences") {
  CHECK(20.0 * mistake_probability(RawId::kRoad, 10.0, 0.5) <
        mistake_probability(RawId::kFence, 10.0, 0.5));
}

TEST_CASE("Confusion: a mistake never names the truth nor nothing") {
  for (const RawId id :
       {RawId::kUnlabelled, RawId::kCar, RawId::kBicycle, RawId::kPerson, RawId::kRoad,
        RawId::kParking, RawId::kSidewalk, RawId::kBuilding, RawId::kFence, RawId::kVegetation,
        RawId::kTrunk, RawId::kTerrain, RawId::kPole, RawId::kTrafficSign}) {
    for (double share = 0.0; share < 1.0; share += 0.01) {
      for (const std::uint16_t said : {mistaken_for(id, share), stray_answer(id, share)}) {
        REQUIRE(said != static_cast<std::uint16_t>(id));
        REQUIRE(said != 0);
      }
    }
  }
}

TEST_CASE("Confusion: a whole car is mistaken for another vehicle, a point of it for anything") {
  constexpr std::uint16_t kTruck = 18;
  constexpr std::uint16_t kOtherVehicle = 20;
  std::set<std::uint16_t> whole;
  std::set<std::uint16_t> stray;
  for (double share = 0.0; share < 1.0; share += 0.01) {
    whole.insert(mistaken_for(RawId::kCar, share));
    stray.insert(stray_answer(RawId::kCar, share));
  }
  CHECK(whole == std::set<std::uint16_t>{kTruck, kOtherVehicle});
  CHECK(stray.count(kOtherVehicle) == 1);
  CHECK(stray.count(static_cast<std::uint16_t>(RawId::kTerrain)) == 1);
}

TEST_CASE("Confusion: poles are mostly mistaken for trunks") {
  int trunks = 0;
  for (int i = 0; i < 100; ++i) {
    trunks +=
        mistaken_for(RawId::kPole, i / 100.0) == static_cast<std::uint16_t>(RawId::kTrunk) ? 1 : 0;
  }
  CHECK(trunks > 60);
}

TEST_CASE("Predictions: the mean IoU of both scanners is that of a mediocre network") {
  const StreetSimulator simulator = street(1);
  for (const int robot : {0, 1}) {
    const double iou = mean_iou(simulator.scan(robot, 10));
    CAPTURE(robot, iou);
    CHECK(iou > 0.35);
    CHECK(iou < 0.65);
  }
}

TEST_CASE("Predictions: cars are called terrain at their borders only, whatever the seed") {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const StreetSimulator simulator = street(seed);
    double cars = 0.0;
    double terrain = 0.0;
    for (const int index : {0, 6, 12, 18, 24, 30, 36}) {
      const SimulatedScan scan = simulator.scan(1, index);
      for (std::size_t i = 0; i < scan.labels.size(); ++i) {
        if (learned(scan.labels[i]) != static_cast<std::uint32_t>(RawId::kCar)) continue;
        cars += 1.0;
        terrain += scan.predictions[i] == static_cast<std::uint32_t>(RawId::kTerrain) ? 1.0 : 0.0;
      }
    }
    CAPTURE(seed, cars, terrain);
    CHECK(cars > 1000.0);
    CHECK(terrain < 0.03 * cars);
  }
}

TEST_CASE("Predictions: mistakes cluster along a beam") {
  const SimulatedScan scan = street(1).scan(0, 3);
  double mistaken = 0.0;
  double both = 0.0;
  for (std::size_t i = 1; i < scan.labels.size(); ++i) {
    if (!is_mistaken(scan, i)) continue;
    mistaken += 1.0;
    both += is_mistaken(scan, i - 1) ? 1.0 : 0.0;
  }
  const double base = mistaken / static_cast<double>(scan.labels.size());
  CAPTURE(base);
  CHECK(base > 0.05);
  CHECK(base < 0.35);
  CHECK(both / mistaken > 0.65);
}

TEST_CASE(
    "Predictions: a robot repeats its mistakes in the next scan, another viewpoint makes others") {
  const StreetSimulator simulator = street(1);
  const Mistakes first = mistakes_by_place(simulator, 0, 26);
  const double next = share_repeated(first, mistakes_by_place(simulator, 0, 27));
  const double other = share_repeated(first, mistakes_by_place(simulator, 1, 26));
  CAPTURE(next, other);
  CHECK(next > 0.65);
  CHECK(other < next - 0.15);
}

TEST_CASE("Predictions: labels bleed over borders") {
  // Along a beam, points beside a change of the true class are mistaken more often than others.
  const SimulatedScan scan = street(1).scan(0, 3);
  double at_border[2] = {0.0, 0.0};
  double inside[2] = {0.0, 0.0};
  for (std::size_t i = 2; i + 2 < scan.labels.size(); ++i) {
    if (scan.labels[i] == 0) continue;
    const bool border = learned(scan.labels[i - 2]) != learned(scan.labels[i]) ||
                        learned(scan.labels[i + 2]) != learned(scan.labels[i]);
    double* counts = border ? at_border : inside;
    counts[is_mistaken(scan, i) ? 1 : 0] += 1.0;
  }
  const auto share = [](const double* counts) { return counts[1] / (counts[0] + counts[1]); };
  CHECK(share(at_border) > 1.8 * share(inside));
}
