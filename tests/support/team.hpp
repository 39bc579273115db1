// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A team of robots with random maps, and the global map of the library in memory of exactly the
// size that it asks for.
#pragma once

#include <map>
#include <vector>

#include "oracle/fusion_oracle.hpp"
#include "support/mapper.hpp"
#include "support/random.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera::oracle {

inline constexpr int kTeamClasses = 5;

/// 0.1 m, room for some thousand blocks.
[[nodiscard]] GlobalMapConfig team_config(TuplePolicy tuple = TuplePolicy::kDense);

/// Packed blocks of a contribution, by key.
using PackedBlocks = std::map<std::uint64_t, std::vector<std::byte>>;
[[nodiscard]] PackedBlocks pack_voxels(const OracleVoxels& voxels,
                                       const OracleCentroids& centroids = {});

/// Voxels in a few clusters within reach_m of a place; counts are multiples of 2^-6, which packing
/// keeps. Some are free only, some occupied by what has no label.
[[nodiscard]] OracleVoxels random_voxels(Random& random, int count, const Voxel& around);

/// Centroids of two thirds of the voxels with labels.
[[nodiscard]] OracleCentroids random_centroids(Random& random, const OracleVoxels& voxels);

/// A turn about a random axis and a shift of up to shift_m on each.
[[nodiscard]] Matrix34d random_transform(Random& random, double degrees, double shift_m);

[[nodiscard]] inline VoxelCoord coord_of(const Voxel& voxel) noexcept {
  return {static_cast<std::int32_t>(voxel[0]), static_cast<std::int32_t>(voxel[1]),
          static_cast<std::int32_t>(voxel[2])};
}

/// What a robot calls a class; what it is, and two and three classes taken for each other.
using Says = int (*)(int truth);
constexpr int honestly(int truth) { return truth; }
constexpr int swapped(int truth) { return truth == 1 ? 2 : truth == 2 ? 1 : truth; }
constexpr int permuted(int truth) { return truth % 3 + 1; }
/// Strips of classes 1, 2 and 3 on the ground, each 16 voxels along y: all robots see x of 0 to 63,
/// and each a place of its own, from x = 100 (robot + 1) on.
[[nodiscard]] OracleContribution striped_ground(std::uint32_t robot, Says says);

class Team;
/// So many robots with so many voxels each, published and fused.
[[nodiscard]] std::vector<OracleContribution> publish_random(Team& team, Random& random, int robots,
                                                             int voxels);

class Team {
 public:
  explicit Team(const GlobalMapConfig& config);
  [[nodiscard]] GlobalMap& global() { return global_; }
  [[nodiscard]] const GlobalMap& global() const { return global_; }
  /// Puts all blocks of a contribution in one version.
  void publish(const OracleContribution& contribution, std::uint32_t version);
  /// Works until nothing waits.
  void settle() {
    while (global_.busy()) global_.step(1U << 16U);
  }
  [[nodiscard]] std::uint64_t digest() const;

 private:
  AlignedMemory memory_;
  GlobalMap global_;
};

/// Every voxel's counts; component 0 in passes.
[[nodiscard]] OracleVoxels voxels_of(const LocalMap& map);

}  // namespace tessera::oracle
