// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What must hold at the end of each virtual minute, whatever happened in it.
#pragma once

#include <string>
#include <vector>

#include "soak/logbook.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera::soak {

/// Of a robot's memory.
struct MemoryUse {
  std::uint64_t given_bytes = 0;
  std::uint64_t used_bytes = 0;
};

/// Adds a line to `faults` for each part of a robot that says it holds more than it was given.
MemoryUse check_memory(const Robot& robot, std::vector<std::string>& faults);

/// All that the robot holds of everybody, and its global map.
struct Digests {
  std::uint64_t exchange = 0;
  std::uint64_t global = 0;
  friend bool operator==(const Digests&, const Digests&) = default;
};
[[nodiscard]] Digests digests_of(const Robot& robot);

/// How true a global map is.
struct Truth {
  /// Farther than this off, at kReach_m from the sensor, a contribution counts as misplaced: by
  /// drift that no correction has reached yet.
  static constexpr double kPlaced_m = 0.3;
  static constexpr double kReach_m = 20.0;
  /// An occupied voxel is right if a true surface is so near to its centre: half a voxel's diagonal
  /// for the point in it, and again for resampling, what a frame may be off, and the noise of
  /// ranges.
  [[nodiscard]] static double near_m(double resolution_m) {
    return 1.733 * resolution_m + kPlaced_m + 0.08;
  }
  /// Of occupied voxels that no misplaced contribution explains, the share that may be false:
  /// at the far end of rays that are longer than kReach_m.
  static constexpr double kMostFalse = 0.0005;

  /// Of occupied voxels, one in so many is counted again.
  static constexpr std::uint64_t kRecountOneIn = 200;
  /// Counts of the global map are rounded.
  static constexpr double kMostMiscounted = 0.02;

  std::uint64_t occupied = 0;
  std::uint64_t far = 0;        ///< From all true surfaces.
  std::uint64_t explained = 0;  ///< Of these, where a misplaced contribution has something.
  std::uint64_t false_voxels = 0;
  std::uint32_t contributions = 0;
  std::uint32_t misplaced = 0;
  double worst_m = 0.0;   ///< Of all contributions, how far one is off.
  double evidence = 0.0;  ///< Of labels, in the global map.
  double mapped = 0.0;    ///< Points that were integrated into the submaps that are there.
  std::uint64_t recounted = 0;
  double most_miscounted = 0.0;  ///< Share by which a voxel's evidence differs from Recount.
  double most_ratio = 0.0;       ///< Of a contribution: evidence over points that were integrated.
  double worst_false = 0.0;      ///< Share of occupied voxels that are false.
  /// Of another robot: figures are those of the one with more, and of what must be small the most.
  void take(const Truth& other);
};

/// Looks at all that a robot holds and shows. Adds a line to `faults` for each contribution that
/// nobody has mapped, or with more evidence than was integrated, and if the map shows more than
/// that in all, something else than what is in the replicas, or too much that is false.
Truth check_truth(const Robot& robot, const Logbook& logbook, const street::StreetGrid& grid,
                  std::vector<std::string>& faults);

}  // namespace tessera::soak
