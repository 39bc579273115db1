// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Combines street, traffic, scanner and label noise. Standing objects are placed once, moving ones
// for each scan.
#include "simulator/street_simulator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "scans/dataset_classes.hpp"
#include "simulator/ground.hpp"
#include "simulator/label_noise.hpp"
#include "simulator/lidar.hpp"
#include "simulator/random.hpp"
#include "simulator/solid_tree.hpp"
#include "simulator/street_cameras.hpp"
#include "simulator/street_plan.hpp"
#include "simulator/traffic.hpp"
#include "tessera/base/assert.hpp"
#include "tessera/registration/point_labels.hpp"

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

/// The first labels of a belief, with weights that sum to what they share of one.
void append_words(const street::Belief& belief, std::size_t labels,
                  std::vector<std::uint32_t>& words) {
  std::array<std::uint8_t, street::Belief::kLabels> weights{};
  const Status status = quantise_label_weights(std::span(belief.probabilities).first(labels),
                                               std::span(weights).first(labels));
  TESSERA_ASSERT(status == Status::kOk);
  static_cast<void>(status);
  for (std::size_t j = 0; j < labels; ++j)
    words.push_back(belief.ids[j] | (std::uint32_t{weights[j]} << 16U));
}

std::string between(const char* what, int most, int given) {
  return fmt::format("the number of {} must be 1 to {}, not {}; choose one in that range", what,
                     most, given);
}

}  // namespace

struct StreetSimulator::Street {
  explicit Street(const SimulatorConfig& given)
      : config(given),
        traffic(given.seed, given.robots, given.apart_m),
        half_length(half_length_m(traffic, given)),
        ground(given.seed, half_length),
        standing(street::lay_out_street(given.seed, ground, half_length)),
        models{street::lidar_64_beams(), street::lidar_16_beams()},
        cameras(street::street_cameras()),
        classes(DatasetClasses::semantic_kitti()) {}

  [[nodiscard]] const street::LidarModel& model(int robot) const {
    return models[static_cast<std::size_t>(robot % 2)];
  }

  SimulatorConfig config;
  street::Traffic traffic;
  double half_length;
  street::Ground ground;
  street::SolidTree standing;
  std::array<street::LidarModel, 2> models;
  std::vector<street::StreetCamera> cameras;
  DatasetClasses classes;
};

StreetSimulator::StreetSimulator(std::unique_ptr<const Street> street)
    : street_(std::move(street)) {}
StreetSimulator::StreetSimulator(StreetSimulator&&) noexcept = default;
StreetSimulator& StreetSimulator::operator=(StreetSimulator&&) noexcept = default;
StreetSimulator::~StreetSimulator() = default;

Outcome<StreetSimulator> StreetSimulator::make(const SimulatorConfig& config) {
  if (config.scene != "street") {
    return Failure{"unknown scene '" + config.scene + "'; the only one is 'street'"};
  }
  if (config.robots < 1 || config.robots > kMaxRobots) {
    return Failure{between("robots", kMaxRobots, config.robots)};
  }
  if (config.scans < 1 || config.scans > kMaxScans) {
    return Failure{between("scans", kMaxScans, config.scans)};
  }
  // So that NaN is refused too.
  if (!(config.apart_m >= 0.0 && config.apart_m <= SimulatorConfig::kMostApart_m)) {
    return Failure{
        fmt::format("the distance between the robots' starts must be 0 to {} m, not {}; choose one "
                    "in that range",
                    SimulatorConfig::kMostApart_m, config.apart_m)};
  }
  if (config.weighted_labels < 0 || config.weighted_labels > static_cast<int>(kMostLabels)) {
    return Failure{
        fmt::format("the number of labels with weights must be 0 to {}, not {}; choose "
                    "one in that range",
                    kMostLabels, config.weighted_labels)};
  }
  return StreetSimulator(std::make_unique<const Street>(config));
}

const SimulatorConfig& StreetSimulator::config() const { return street_->config; }

/// The street at a time, without the observing robot's own vehicle.
class StreetSimulator::Moment {
 public:
  Moment(const Street& street, int robot, double now_s)
      : street_(street),
        moving_(street.traffic.solids(street.ground, street.half_length, robot, now_s)) {}
  void meet(const street::Ray& ray, street::Hit& hit) const {
    street_.ground.meet(ray, hit);
    street_.standing.meet(ray, hit);
    moving_.meet(ray, hit);
  }

 private:
  const Street& street_;
  street::SolidTree moving_;
};

/// Seconds after the stamp at which a scanner that turns left and faces ahead at the stamp measures
/// a column.
double StreetSimulator::column_time_s(int column, int columns) {
  const int from_ahead = 2 * column < columns ? column : column - columns;
  return street::kScanPeriod_s * from_ahead / columns;
}

street::EchoImage StreetSimulator::measure(int robot, int index) const {
  const Street& here = *street_;
  const double now_s = time_s(index);
  const std::uint64_t noise =
      street::hash_of(here.config.seed, street::Stream::kBeam, robot, index);
  const street::LidarModel& model = here.model(robot);
  if (!here.config.sweep) {
    const Moment moment(here, robot, now_s);
    return street::sweep(
        model, T_global_sensor(robot, index),
        [&](const street::Ray& ray, street::Hit& hit) { moment.meet(ray, hit); }, noise);
  }
  // Moving objects are placed again ten times per turn; the sensor for every column.
  constexpr int kMoments = 10;
  std::vector<Moment> moments;
  for (int i = 0; i < kMoments; ++i) {
    const double middle_s = ((i + 0.5) / kMoments - 0.5) * street::kScanPeriod_s;
    moments.emplace_back(here, robot, now_s + middle_s);
  }
  std::vector<int> moment_of;
  street::SweepPoses poses;
  for (int column = 0; column < model.azimuth_steps; ++column) {
    const double after_s = column_time_s(column, model.azimuth_steps);
    moment_of.push_back(std::min(
        static_cast<int>((after_s / street::kScanPeriod_s + 0.5) * kMoments), kMoments - 1));
    poses.push_back(T_global_sensor_at(robot, now_s + after_s));
  }
  return street::sweep(
      model, poses,
      [&](int column, const street::Ray& ray, street::Hit& hit) {
        moments[static_cast<std::size_t>(moment_of[static_cast<std::size_t>(column)])].meet(ray,
                                                                                            hit);
      },
      noise);
}

SimulatedScan StreetSimulator::scan(int robot, int index) const {
  const Street& here = *street_;
  const street::EchoImage image = measure(robot, index);
  const street::Viewpoint viewpoint{robot, here.traffic.driven(robot, time_s(index)), index};
  const auto truth = street::true_labels(here.config.seed, viewpoint, image);
  const auto labels = static_cast<std::size_t>(here.config.weighted_labels);
  const bool believes = labels > 0;
  const auto held = believes ? street::predict_beliefs(here.config.seed, viewpoint, image)
                             : std::vector<street::Belief>{};
  const auto said = believes ? std::vector<std::uint16_t>{}
                             : street::predict_labels(here.config.seed, viewpoint, image);

  SimulatedScan scan;
  for (std::size_t i = 0; i < image.echoes.size(); ++i) {
    const street::Echo& echo = image.echoes[i];
    if (!echo.returned()) continue;
    const Eigen::Vector3f p = round_to_float(echo.p_sensor);
    scan.points.push_back({p.x(), p.y(), p.z(), echo.intensity});
    scan.labels.push_back(truth[i]);
    scan.predictions.push_back(believes ? held[i].ids[0] : said[i]);
    if (believes) append_words(held[i], labels, scan.beliefs);
    if (!here.config.sweep) continue;
    const int column = static_cast<int>(i % static_cast<std::size_t>(image.columns));
    scan.times_s.push_back(static_cast<float>(column_time_s(column, image.columns)));
  }
  return scan;
}

std::vector<SimulatedCamera> StreetSimulator::cameras() const {
  std::vector<SimulatedCamera> cameras;
  for (const street::StreetCamera& camera : street_->cameras)
    cameras.push_back({camera.name, camera.model, camera.T_camera_sensor, camera.offset_s});
  return cameras;
}

SimulatedLabelImage StreetSimulator::label_image(int robot, int camera, int index) const {
  const Street& here = *street_;
  const street::StreetCamera& view = here.cameras[static_cast<std::size_t>(camera)];
  const double then_s = time_s(index) + view.offset_s;
  const Moment moment(here, robot, then_s);
  const street::EchoImage seen =
      street::look(view, T_global_sensor_at(robot, then_s),
                   [&](const street::Ray& ray, street::Hit& hit) { moment.meet(ray, hit); });
  const int cameras = static_cast<int>(here.cameras.size());
  const street::Viewpoint viewpoint{robot, here.traffic.driven(robot, then_s),
                                    (index + 1) * cameras + camera};
  const std::vector<std::uint16_t> said = street::predict_labels(here.config.seed, viewpoint, seen);
  SimulatedLabelImage image{view.model.width_px(), view.model.height_px(), {}, {}};
  const auto component = [&](std::uint16_t raw_id) {
    const std::uint8_t given = here.classes.component(raw_id);
    return given == here.classes.unlabelled() ? std::uint8_t{0} : given;
  };
  for (int row = 0; row < image.height_px; ++row) {
    for (int column = 0; column < image.width_px; ++column) {
      const auto i = static_cast<std::size_t>(row / street::kLabelStride_px * seen.columns +
                                              column / street::kLabelStride_px);
      image.labels.push_back(component(static_cast<std::uint16_t>(seen.echoes[i].id)));
      image.predictions.push_back(component(said[i]));
    }
  }
  return image;
}

Eigen::Isometry3d StreetSimulator::T_global_sensor_at(int robot, double time_s) const {
  return street_->traffic.T_street_sensor(street_->ground, robot, time_s,
                                          street_->model(robot).height_m);
}

Eigen::Isometry3d StreetSimulator::T_global_sensor(int robot, int index) const {
  return T_global_sensor_at(robot, time_s(index));
}

Eigen::Isometry3d StreetSimulator::T_map_sensor(int robot, int index) const {
  if (index == 0) return Eigen::Isometry3d::Identity();
  return T_map_sensor_at(robot, time_s(index));
}

Eigen::Isometry3d StreetSimulator::T_map_sensor_at(int robot, double time_s) const {
  return T_global_map(robot).inverse(Eigen::Isometry) * T_global_sensor_at(robot, time_s);
}

Eigen::Isometry3d StreetSimulator::T_global_map(int robot) const {
  return T_global_sensor(robot, 0);
}

}  // namespace tessera
