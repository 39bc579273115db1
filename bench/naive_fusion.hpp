// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The fusion that anyone would write, as a yardstick: voxels in std::unordered_map, rows of all
// classes, each node's neighbours looked up once. No edge term, no block apart: about what the
// library's Z <- B + alpha P Z asks for, on the same nodes.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "teams.hpp"

namespace tessera::bench {

class NaiveFusion {
 public:
  NaiveFusion(const DiffusionConfig& config, double resolution_m, int num_components);
  /// All of a team in one frame, from nothing. Returns the nodes of the graph.
  std::size_t fuse(const Team& team);

 private:
  void add(const Contribution& robot, std::uint8_t bit);
  void find_nodes();
  void diffuse();

  struct Offset {
    VoxelCoord by;
    float weight;
  };
  DiffusionConfig config_;
  std::size_t classes_;
  std::vector<Offset> offsets_;
  std::unordered_map<std::uint64_t, std::uint32_t> rows_;   ///< Of voxels, by their coordinates.
  std::unordered_map<std::uint64_t, std::uint8_t> robots_;  ///< With labels in a block.
  std::vector<VoxelCoord> voxels_;
  std::vector<float> counts_;
  std::vector<std::uint32_t> nodes_;
};

}  // namespace tessera::bench
