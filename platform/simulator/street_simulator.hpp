// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A simulated street of 160 m x 40 m or longer, robots that drive towards each other on either side
// of its road, and the data of their laser scanners: points, true labels, and labels as a network
// would predict them. Every scan is a pure function of the seed, the robot and the scan's number,
// independent of earlier calls.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "tessera/registration/camera_model.hpp"

namespace tessera {

namespace street {
struct EchoImage;
}

struct SimulatorConfig {
  std::string scene = "street";  ///< The only scene.
  std::uint64_t seed = 1;
  /// 1 .. 8. Even robots (0, 2, ...) drive towards +x with a 64-beam scanner, odd ones towards -x
  /// with a 16-beam one.
  int robots = 2;
  /// 1 .. 1000, at 10 Hz and 8.4 to 9.6 m/s. The street is lengthened for more than about 100.
  int scans = 20;
  /// 0 .. kMostApart_m: between the starts of the robots 0 and 1, along the street; the others
  /// start 24 m behind one of them each, in two queues. Robot 0 alone starts half of it before the
  /// street's middle. The street is lengthened for more than about 120.
  double apart_m = 60.0;
  static constexpr double kMostApart_m = 2000.0;
  /// Scans are swept while the robot drives: the scanner turns left once a scan, and faces ahead at
  /// the scan's stamp.
  bool sweep = false;
  /// Labels with weights that scans have beside the predictions, 0 .. 3.
  int weighted_labels = 0;
};

/// Points and labels have the same length and order: beam by beam from the top, each turning left
/// from straight ahead.
struct SimulatedScan {
  std::vector<std::array<float, 4>>
      points;  ///< x y z in metres, sensor frame (x forward, y left, z up); intensity 0..1.
  std::vector<std::uint32_t>
      labels;  ///< Truth: SemanticKITTI raw ids, 252 and 254 for moving objects, 0 unlabelled.
  std::vector<std::uint32_t>
      predictions;  ///< With a network's errors: raw ids of static classes, never 0.
  /// Only with SimulatorConfig::weighted_labels, that many for each point: raw ids in the lower 16
  /// bits, weights in 255ths in the upper. The first is the one of predictions.
  std::vector<std::uint32_t> beliefs;
  std::vector<float> times_s;  ///< Only for swept scans: of each point, from the scan's stamp.
};

/// A camera of a robot, for readers of the dataset.
struct SimulatedCamera {
  std::string name;
  CameraModel model;
  Eigen::Isometry3d T_camera_sensor = Eigen::Isometry3d::Identity();
  double offset_s = 0.0;  ///< Time of its image, from the scan's stamp.
};

/// A byte per pixel, by rows: SemanticKITTI's class, 1 .. 19, or 0 for none. Each label
/// covers 2 x 2 pixels, as a network's output does.
struct SimulatedLabelImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> labels;       ///< Truth.
  std::vector<std::uint8_t> predictions;  ///< With a network's errors.
};

/// Frames: `global` is the street (x along it, z up, origin in its middle, within a metre of the
/// road); `map` of a robot is the frame of its own first scan; `sensor` is the laser scanner's.
class StreetSimulator {
 public:
  /// Fails (kUsage) iff the scene is unknown or a number is out of its range.
  [[nodiscard]] static Outcome<StreetSimulator> make(const SimulatorConfig& config);
  StreetSimulator(StreetSimulator&&) noexcept;
  StreetSimulator& operator=(StreetSimulator&&) noexcept;
  ~StreetSimulator();

  [[nodiscard]] const SimulatorConfig& config() const;

  /// robot in [0, robots), index >= 0 (those beyond config().scans may run off the street's end).
  /// Costs about 130,000 rays for 64 beams. Reads only: scans may be made by several threads at
  /// once.
  [[nodiscard]] SimulatedScan scan(int robot, int index) const;
  /// The cameras that every robot has.
  [[nodiscard]] std::vector<SimulatedCamera> cameras() const;
  /// camera: of cameras(); index as for scan(). At most 80,000 rays.
  [[nodiscard]] SimulatedLabelImage label_image(int robot, int camera, int index) const;
  /// The true pose: sensor to street frame.
  [[nodiscard]] Eigen::Isometry3d T_global_sensor(int robot, int index) const;
  /// The same at any time, seconds from the stamp of scan 0, as the robot reports it.
  [[nodiscard]] Eigen::Isometry3d T_map_sensor_at(int robot, double time_s) const;
  /// The true pose as the robot reports it: sensor to its own map frame; the identity for index 0.
  [[nodiscard]] Eigen::Isometry3d T_map_sensor(int robot, int index) const;
  /// Pose of the robot's map in the street.
  [[nodiscard]] Eigen::Isometry3d T_global_map(int robot) const;

 private:
  [[nodiscard]] Eigen::Isometry3d T_global_sensor_at(int robot, double time_s) const;
  struct Street;
  class Moment;
  [[nodiscard]] static double column_time_s(int column, int columns);
  [[nodiscard]] street::EchoImage measure(int robot, int index) const;
  explicit StreetSimulator(std::unique_ptr<const Street> street);
  std::unique_ptr<const Street> street_;
};

}  // namespace tessera
