// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A vehicle in the grid of streets: where it is, where its odometry has it, and what its scanner
// measures. It mostly drives around blocks, so that it comes back to where it was. All is drawn
// from the seed and from counts, so that its state says how it goes on.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "base/json.hpp"
#include "scans/dataset_classes.hpp"
#include "simulator/lidar.hpp"
#include "simulator/street_grid.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera::soak {

/// Of a vehicle on level ground: metres, and radians from x to y.
struct FlatPose {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  double yaw = 0.0;
};
[[nodiscard]] Matrix34d matrix_of(const FlatPose& pose);
/// Of a pose that was taken off another one's frame: T_a_c = T_a_b T_b_c.
[[nodiscard]] FlatPose product(const FlatPose& T_a_b, const FlatPose& T_b_c);
[[nodiscard]] FlatPose inverse(const FlatPose& T_a_b);
[[nodiscard]] Json json_of(const FlatPose& pose);
[[nodiscard]] FlatPose pose_in(const Json& json);

class Drive {
 public:
  static constexpr double kSpeed_mps = 1.5;
  static constexpr double kTurn_radps = 0.8;
  /// Of way, after which a crossing counts as one to which it has come back.
  static constexpr double kLoop_m = 100.0;

  /// grid must outlive it.
  Drive(const street::StreetGrid& grid, std::uint64_t seed, int robot);
  /// Another map begins: odometry starts from the truth, and drifts another way.
  void begin_map();
  /// Drives on. True: it is at a crossing of this map's again, so that a loop is closed.
  bool step(double seconds);

  /// T_world_sensor.
  [[nodiscard]] const FlatPose& truth() const { return truth_; }
  /// The same as odometry has it since the map began.
  [[nodiscard]] const FlatPose& odometry() const { return odometry_; }
  /// In all.
  [[nodiscard]] double way_m() const { return way_m_; }
  [[nodiscard]] Json state() const;
  void restore(const Json& state);

 private:
  void choose_turn();
  void note_motion(const FlatPose& before, double driven_m);
  [[nodiscard]] street::Random random(std::uint64_t purpose);

  const street::StreetGrid& grid_;
  std::uint64_t seed_;
  int x_ = 0;  ///< The crossing behind it.
  int y_ = 0;
  int heading_ = 0;  ///< Quarter turns from x.
  double along_m_ = 0.0;
  double turn_rad_ = 0.0;  ///< Left to turn before it drives on.
  FlatPose truth_;
  FlatPose odometry_;
  double way_m_ = 0.0;
  std::uint64_t steps_ = 0;
  std::uint64_t maps_ = 0;
  double scale_ = 1.0;         ///< Of odometry's ways in this map.
  double bias_radpm_ = 0.0;    ///< Of its heading.
  std::map<int, double> met_;  ///< Crossings of this map, and the way then.
};

/// What a scanner of 16 beams and 600 directions measures.
class Scanner {
 public:
  /// Returns beyond it only free space.
  static constexpr double kRange_m = 20.0;
  static constexpr int kBeams = 16;
  static constexpr int kDirections = 600;

  /// grid must outlive it.
  Scanner(const street::StreetGrid& grid, std::uint64_t seed);
  /// At a pose; noise and wrong labels are drawn from `noise`. A view of this scanner's memory,
  /// until the next one; T_map_sensor is left to the caller.
  [[nodiscard]] ScanView scan(const FlatPose& T_world_sensor, std::uint64_t noise);
  [[nodiscard]] const ClassTable& classes() const { return classes_.table(); }
  [[nodiscard]] double height_m() const { return model_.height_m; }

 private:
  const street::StreetGrid& grid_;
  std::uint64_t seed_;
  street::LidarModel model_;
  DatasetClasses classes_;
  std::vector<float> points_;
  std::vector<std::uint8_t> components_;
};

}  // namespace tessera::soak
