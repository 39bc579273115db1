// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a voxel of the global map must have, added up once more in another way: from the replicas,
// one voxel at a time, so that nothing of what changed before matters. For plain sums, without
// diffusion.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "tessera/robot/robot.hpp"

namespace tessera::soak {

class Recount {
 public:
  /// robot must outlive it, and must not change meanwhile.
  explicit Recount(const Robot& robot);
  /// Label evidence of a voxel of the global map. Of a submap the newest epoch that has anything
  /// there counts, and of a robot no more than the cap of the robots' maps. O(contributions).
  [[nodiscard]] double labels(VoxelCoord global);

 private:
  /// A local block, as its parts say.
  struct Content {
    std::array<float, kBlockVoxels> labels{};
    std::array<bool, kBlockVoxels> observed{};
  };
  struct Share {
    double labels = 0.0;
    bool observed = false;
  };
  [[nodiscard]] Share share_of(Replicas::Slot slot, VoxelCoord global);
  void read(Replicas::Slot slot, BlockCoord block, Content& content);
  [[nodiscard]] double capped(double labels) const;

  const Replicas& replicas_;
  double cap_;
  std::vector<Replicas::Slot> slots_;  ///< By robot and submap, the newest epoch first.
  std::vector<std::byte> packed_;
  Content content_;
};

}  // namespace tessera::soak
