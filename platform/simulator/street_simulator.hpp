// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A simulated street of about 160 m x 40 m, robots that drive towards each other on either side of
// its road, and what their laser scanners see: points, true labels, and labels as a network would
// predict them. Every scan is a pure function of the seed, the robot and the scan's number,
// whatever was asked for before.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "posix/outcome.hpp"

namespace tessera {

struct SimulatorConfig {
  std::string scene = "street";  ///< The only scene there is.
  std::uint64_t seed = 1;
  /// 1 .. 8. Even robots (0, 2, ...) drive towards +x with a 64-beam scanner, odd ones towards -x
  /// with a 16-beam one.
  int robots = 2;
  /// 1 .. 1000, at 10 Hz and 8.4 to 9.6 m/s. The street is lengthened for more than about 100.
  int scans = 20;
};

/// Points and labels have the same length and order: beam by beam from the top, each turning left
/// from straight ahead.
struct SimulatedScan {
  std::vector<std::array<float, 4>>
      points;  ///< x y z in metres, sensor frame (x forward, y left, z up); intensity 0..1.
  std::vector<std::uint32_t>
      labels;  ///< Truth: SemanticKITTI raw ids, 252 and 254 for what moves, 0 unlabelled.
  std::vector<std::uint32_t>
      predictions;  ///< As a network errs: raw ids of static classes, never 0.
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
  /// The true pose: sensor to street frame.
  [[nodiscard]] Eigen::Isometry3d T_global_sensor(int robot, int index) const;
  /// The true pose as the robot reports it: sensor to its own map frame; the identity for index 0.
  [[nodiscard]] Eigen::Isometry3d T_map_sensor(int robot, int index) const;
  /// Where the robot's map lies in the street.
  [[nodiscard]] Eigen::Isometry3d T_global_map(int robot) const;

 private:
  struct Street;
  explicit StreetSimulator(std::unique_ptr<const Street> street);
  std::unique_ptr<const Street> street_;
};

}  // namespace tessera
