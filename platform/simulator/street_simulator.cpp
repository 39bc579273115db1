// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Joins street, traffic, scanner and label noise. What stands is laid out once; what moves is
// placed for each scan.
#include "simulator/street_simulator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "simulator/ground.hpp"
#include "simulator/label_noise.hpp"
#include "simulator/lidar.hpp"
#include "simulator/random.hpp"
#include "simulator/solid_tree.hpp"
#include "simulator/street_plan.hpp"
#include "simulator/traffic.hpp"

namespace tessera {
namespace {

constexpr int kMaxRobots = 8;
constexpr int kMaxScans = 1000;
constexpr double kShortestHalf_m = 80.0;
constexpr double kRoomAhead_m = 20.0;

double time_s(int index) { return index * street::kScanPeriod_s; }

/// Half the street: room for every robot from its start to its last scan. Whole multiples of the
/// lots, so that a longer street differs from a shorter one at its ends alone.
double half_length_m(const street::Traffic& traffic, const SimulatorConfig& config) {
  double farthest = 0.0;
  for (int robot = 0; robot < config.robots; ++robot) {
    for (const int index : {0, config.scans - 1}) {
      farthest = std::max(farthest, std::abs(traffic.along(robot, time_s(index))));
    }
  }
  constexpr double kStep_m = 40.0;
  const double needed = farthest + kRoomAhead_m;
  return std::max(kShortestHalf_m, kStep_m * std::ceil(needed / kStep_m));
}

std::string between(const char* what, int most, int given) {
  return std::string("the number of ") + what + " must be 1 to " + std::to_string(most) + ", not " +
         std::to_string(given) + ": choose one in that range";
}

}  // namespace

struct StreetSimulator::Street {
  explicit Street(const SimulatorConfig& given)
      : config(given),
        traffic(given.seed, given.robots),
        half_length(half_length_m(traffic, given)),
        ground(given.seed, half_length),
        standing(street::lay_out_street(given.seed, ground, half_length)),
        models{street::lidar_64_beams(), street::lidar_16_beams()} {}

  [[nodiscard]] const street::LidarModel& model(int robot) const {
    return models[static_cast<std::size_t>(robot % 2)];
  }

  SimulatorConfig config;
  street::Traffic traffic;
  double half_length;
  street::Ground ground;
  street::SolidTree standing;
  std::array<street::LidarModel, 2> models;
};

StreetSimulator::StreetSimulator(std::unique_ptr<const Street> street)
    : street_(std::move(street)) {}
StreetSimulator::StreetSimulator(StreetSimulator&&) noexcept = default;
StreetSimulator& StreetSimulator::operator=(StreetSimulator&&) noexcept = default;
StreetSimulator::~StreetSimulator() = default;

Outcome<StreetSimulator> StreetSimulator::make(const SimulatorConfig& config) {
  if (config.scene != "street") {
    return Failure{"there is no scene '" + config.scene +
                   "' to simulate: the only one is 'street'"};
  }
  if (config.robots < 1 || config.robots > kMaxRobots) {
    return Failure{between("robots", kMaxRobots, config.robots)};
  }
  if (config.scans < 1 || config.scans > kMaxScans) {
    return Failure{between("scans", kMaxScans, config.scans)};
  }
  return StreetSimulator(std::make_unique<const Street>(config));
}

const SimulatorConfig& StreetSimulator::config() const { return street_->config; }

SimulatedScan StreetSimulator::scan(int robot, int index) const {
  const Street& here = *street_;
  const double now_s = time_s(index);
  const street::SolidTree moving(here.traffic.solids(here.ground, here.half_length, robot, now_s));
  const auto scene = [&](const street::Ray& ray, street::Hit& hit) {
    here.ground.meet(ray, hit);
    here.standing.meet(ray, hit);
    moving.meet(ray, hit);
  };
  const std::uint64_t noise =
      street::hash_of(here.config.seed, street::Stream::kBeam, robot, index);
  const street::EchoImage image =
      street::sweep(here.model(robot), T_global_sensor(robot, index), scene, noise);
  const street::Viewpoint viewpoint{robot, here.traffic.driven(robot, now_s), index};
  const auto truth = street::true_labels(here.config.seed, viewpoint, image);
  const auto said = street::predict_labels(here.config.seed, viewpoint, image);

  SimulatedScan scan;
  for (std::size_t i = 0; i < image.echoes.size(); ++i) {
    const street::Echo& echo = image.echoes[i];
    if (!echo.returned()) continue;
    const Eigen::Vector3f p = echo.p_sensor.cast<float>();
    scan.points.push_back({p.x(), p.y(), p.z(), echo.intensity});
    scan.labels.push_back(truth[i]);
    scan.predictions.push_back(said[i]);
  }
  return scan;
}

Eigen::Isometry3d StreetSimulator::T_global_sensor(int robot, int index) const {
  return street_->traffic.T_street_sensor(street_->ground, robot, time_s(index),
                                          street_->model(robot).height_m);
}

Eigen::Isometry3d StreetSimulator::T_map_sensor(int robot, int index) const {
  if (index == 0) return Eigen::Isometry3d::Identity();
  return T_global_map(robot).inverse(Eigen::Isometry) * T_global_sensor(robot, index);
}

Eigen::Isometry3d StreetSimulator::T_global_map(int robot) const {
  return T_global_sensor(robot, 0);
}

}  // namespace tessera
