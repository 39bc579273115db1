// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots of bench/far_team.cpp and many_submaps.cpp: some that have published much, one of little
// memory, a map of all that the others have published, and one that holds everything.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "base/arena_memory.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera::bench {

inline constexpr double kFarResolution_m = 0.1;
inline constexpr double kFarBlock_m = kBlockEdge * kFarResolution_m;
inline constexpr std::uint32_t kFarOthers = 7;

struct FarOptions {
  std::uint32_t submaps = 500;  ///< Of each of the others.
  std::uint32_t blocks = 460;   ///< Of a submap.
  std::size_t memory = std::size_t{192} << 20U;
  double reach_m = 60.0;
  double loss = 0.0;
};

template <class T>
T made_or_end(Result<T> result) {
  if (result.ok()) return std::move(*result);
  std::fprintf(stderr, "%s\n", to_string(result.status()));
  std::exit(1);
}

/// The classes that all have.
[[nodiscard]] ClassTable far_classes();
/// A rough surface of two or three voxels, each with evidence of three classes.
void fill_far(BlockContent& content, std::uint64_t seed);
/// Where a robot's submap lies: on its road, turned a little, as odometry has it.
[[nodiscard]] Matrix34d far_frame(std::uint32_t robot, std::uint32_t submap);
/// On the middle of a submap of one of the others.
[[nodiscard]] Point3d far_place(std::uint32_t robot, std::uint32_t submap);

/// One of the others: it has published all of its submaps.
struct FarOrigin {
  FarOrigin(std::uint32_t robot, const FarOptions& options);
  ArenaMemory memory;
  Replicas replicas;
  Exchange exchange;
};

/// The robot of little memory.
struct SmallRobot {
  explicit SmallRobot(const FarOptions& options);
  ArenaMemory memory;
  GlobalMap map;
  Exchange exchange;
};

/// One of a team in which everybody holds everything, and has a global map.
struct FullRobot {
  FullRobot(std::uint32_t robot, std::uint32_t robots, const FarOptions& options);
  /// Publishes blocks of the submap that was opened last, from the one at `first` on.
  void publish(std::uint32_t first, std::uint32_t count);
  /// Opens its next submap.
  void open();
  std::uint32_t number = 0;
  std::uint32_t submaps = 0;  ///< That it has opened.
  ArenaMemory memory;
  BlockContent content;
  GlobalMap map;
  Exchange exchange;
};

/// A global map of all that the others have published.
struct MapOfAll {
  MapOfAll(const std::vector<std::unique_ptr<FarOrigin>>& others, const FarOptions& options);
  ArenaMemory memory;
  GlobalMap map;
};

}  // namespace tessera::bench
