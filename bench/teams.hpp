// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps as packed blocks, two of a scene, and a global map for them in memory of its own.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "scenes.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera::bench {

struct PublishedBlock {
  BlockKey key;
  std::vector<std::byte> bytes;
};

struct Contribution {
  std::vector<PublishedBlock> blocks;  ///< In (z, y, x) order.
  std::uint64_t label_voxels = 0;
};

struct Team {
  std::array<Contribution, 2> robots;
  MapConfig map;
  ClassTable classes;
};

/// All that a map has.
Contribution contribution_of(Mapper& mapper);

/// The first half of the scans is one robot, the rest the other; points farther from their sensor
/// than max_range_m are left out, and free space.
Outcome<Team> map_team(const Scene& scene, double resolution_m, float max_range_m);

/// Room for contributions wherever they are, with a move of any of them. map: what they were made
/// with.
[[nodiscard]] GlobalMapConfig config_for(const MapConfig& map,
                                         std::span<const Contribution> contributions);

class OwnedGlobalMap {
 public:
  /// Fails with kFailure iff the system does not give the memory.
  static Outcome<OwnedGlobalMap> make(const GlobalMapConfig& config, const ClassTable& classes);
  /// An empty one in the same memory.
  void empty();
  [[nodiscard]] GlobalMap& operator*() { return global_; }
  [[nodiscard]] GlobalMap* operator->() { return &global_; }
  [[nodiscard]] std::uint64_t digest_of_map();

 private:
  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  std::unique_ptr<std::byte, Free> memory_;
  std::size_t bytes_ = 0;
  GlobalMapConfig config_;
  ClassTable classes_;
  GlobalMap global_;
};

}  // namespace tessera::bench
