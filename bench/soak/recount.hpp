// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a voxel of the global map must have, added up once more in another way: from the replicas,
// one voxel at a time, so that nothing of what changed before matters. For plain sums, without
// diffusion and map sessions.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "tessera/replica/objection.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera::soak {

class Recount {
 public:
  /// robot must outlive it, and must not change meanwhile.
  explicit Recount(const Robot& robot);
  /// Label evidence of a voxel of the global map. Of a submap the newest epoch that has anything
  /// there counts, of a robot no more than the cap of the robots' maps, and nothing of what as many
  /// robots object to as have the voxel occupied. Nothing where rounding decides that.
  /// O(contributions).
  [[nodiscard]] std::optional<double> labels(VoxelCoord global);

 private:
  /// A local block, as its parts say.
  struct Content {
    std::array<float, kBlockVoxels> labels{};
    std::array<float, kBlockVoxels> passes{};
    std::array<bool, kBlockVoxels> observed{};
    std::array<Centroid, kBlockVoxels> centroids{};
    std::array<std::uint32_t, kBlockVoxels>
        first{};  ///< Version of what each voxel's part began as.
  };
  /// What a contribution gives to a global voxel.
  struct Share {
    double labels = 0.0;    ///< Of it, those that fewer object to than have the voxel.
    double evidence = 0.0;  ///< How much more labels than passes weigh, whoever objects.
    bool observed = false;
  };
  struct Objected {
    std::uint32_t robot = 0;
    Objection objection;
  };
  using Block = std::pair<ContributionId, std::uint64_t>;
  struct BlockOrder {
    bool operator()(const Block& a, const Block& b) const noexcept;
  };
  /// holders: robots that have the voxel occupied.
  [[nodiscard]] Share share_of(Replicas::Slot slot, VoxelCoord global, int holders);
  [[nodiscard]] std::optional<int> holders(VoxelCoord global);
  [[nodiscard]] int objectors(const ContributionId& id, BlockCoord block, int row) const;
  void read(Replicas::Slot slot, BlockCoord block, Content& content);
  [[nodiscard]] double capped(double labels) const;

  const Replicas& replicas_;
  double cap_;
  float free_weight_;
  std::map<Block, std::vector<Objected>, BlockOrder> objections_;
  std::vector<Replicas::Slot> slots_;  ///< By robot and submap, the newest epoch first.
  std::vector<std::byte> packed_;
  Content content_;
};

}  // namespace tessera::soak
