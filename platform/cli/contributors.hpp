// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Who contributed a global map's voxels: which robots have a label there, and whether they agree.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "maps/fuse_inputs.hpp"

namespace tessera {

/// What the robots' own maps say at a voxel of the global map.
struct RobotLabels {
  std::uint64_t robots =
      0;  ///< Those with a label there, one bit each: Contributors::robots by index.
  std::uint8_t label = 0;  ///< The most probable class of the first of them.
  bool differ = false;     ///< True if another robot has another class.
};

struct Contributors {
  struct Robot {
    std::uint32_t number = 0;
    std::string maps;  ///< File names of its maps.
  };
  std::vector<Robot> robots;
  std::vector<RobotLabels> voxels;     ///< By index of the requested voxels.
  std::vector<std::uint64_t> of_maps;  ///< By input: of these voxels, those where it has a label.
};

/// Moves evidence as fusing does: through each map's frame, to every global voxel that receives a
/// local one. Evidence of one robot for a voxel is added up before its label is determined. voxels:
/// of the global grid, in the order of blocks, octets and voxels. inputs: of at most
/// Replicas::kMostRobots robots. O(n log n) in the label voxels of all maps.
Contributors find_contributors(const std::vector<FuseInput>& inputs,
                               const std::vector<VoxelCoord>& voxels);

}  // namespace tessera
