// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What was mapped, by where and how much: what the maps are held against.
#pragma once

#include <map>
#include <vector>

#include "soak/drive.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera::soak {

struct MappedScan {
  std::int64_t stamp_us = 0;  ///< Of the robot's clock.
  FlatPose T_map_sensor;      ///< As it was mapped.
  FlatPose T_world_sensor;    ///< The truth.
};

/// A submap, over all starts that continued it.
struct MappedSubmap {
  std::vector<MappedScan> scans{};
  /// Of labels, in all voxels: points that were integrated, whether or not a kill took them. A
  /// point counts 1.
  double evidence = 0.0;
};

/// A map, from an empty one on.
struct MappedMap {
  std::uint32_t first_epoch = 0;
  std::map<std::uint32_t, MappedSubmap> submaps{};
};

class Logbook {
 public:
  explicit Logbook(std::size_t robots) : maps_(robots) {}

  void begin_map(std::uint32_t robot, std::uint32_t first_epoch);
  MappedSubmap& submap(std::uint32_t robot, std::uint32_t number) {
    return maps_[robot].back().submaps[number];
  }
  /// Null: nobody has mapped that.
  [[nodiscard]] const MappedSubmap* find(const ContributionId& id) const;
  /// Of the current map.
  [[nodiscard]] const MappedMap& current(std::uint32_t robot) const { return maps_[robot].back(); }

  /// How far a contribution lies from where it belongs, metres: of each of its scans the sensor's
  /// place and one at reach_m ahead of it and one beside it, the farthest.
  [[nodiscard]] static double misplaced_m(const MappedSubmap& submap,
                                          const GridTransform& T_global_local, double resolution_m,
                                          double reach_m);
  [[nodiscard]] Json state() const;
  void restore(const Json& state);

 private:
  /// Of each robot, maps that others may still hold.
  static constexpr std::size_t kMostMaps = 4;
  std::vector<std::vector<MappedMap>> maps_;
};

}  // namespace tessera::soak
