// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Who contributed a global map's voxels: which robots, and which maps of earlier days, have a label
// there, and whether they agree.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "maps/fuse_inputs.hpp"

namespace tessera {

/// What the maps of all contributors say at a voxel of the global map.
struct VoxelLabels {
  std::uint64_t from = 0;  ///< Those with a label there, one bit each: Contributors::all by index.
  std::uint8_t label = 0;  ///< The most probable class of the first of them.
  bool differ = false;     ///< True if another one has another class.
};

struct Contributors {
  /// A robot, or a session.
  struct One {
    std::string name;  ///< "robot 1", "session".
    std::string maps;  ///< File names of its maps; of a session with its date.
  };
  std::vector<One> all;
  /// What they are; with sessions "robot or session".
  std::string noun = "robot";
  std::string plural = "robots";
  std::vector<VoxelLabels> voxels;     ///< By index of the requested voxels.
  std::vector<std::uint64_t> of_maps;  ///< By input: of these voxels, those where it has a label.
};

/// Loads the local maps that a global map was made of, and the sessions, as fuse does. Adds
/// warnings. Fails as load_inputs, parse_sessions and add_sessions, and with kUsage iff there are
/// over Replicas::kMostRobots contributors.
Outcome<std::vector<FuseInput>> load_contributors(const std::vector<std::string>& paths,
                                                  const std::vector<std::string>& sessions,
                                                  std::vector<std::string> transforms,
                                                  std::vector<Message>& warnings);

/// "yesterday.tsm of 2026-11-26".
std::string name_of_session(const std::string& name, const MapSession& session);

/// Moves evidence as fusing does: through each map's frame, to every global voxel that receives a
/// local one. Evidence of one robot for a voxel is added up before its label is determined. voxels:
/// of the global grid, in the order of blocks, octets and voxels. inputs: as load_contributors
/// gives them. O(n log n) in the label voxels of all maps.
Contributors find_contributors(const std::vector<FuseInput>& inputs,
                               const std::vector<VoxelCoord>& voxels);

}  // namespace tessera
