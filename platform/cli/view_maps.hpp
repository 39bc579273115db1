// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The map files that "view" shows, and who contributed to a global one among them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "maps/fuse_inputs.hpp"
#include "maps/stored_map.hpp"
#include "view/view_map.hpp"

namespace tessera {

inline constexpr int kMostViewedMaps = 16;

struct ViewedMaps {
  struct One {
    std::string path;
    bool in_submaps = false;
    std::shared_ptr<const StoredMap> stored;
    Matrix34d T_global_map = Matrix34d::Identity();
    std::vector<std::string> contributors;
    /// Occupied voxels in the order of blocks, and who contributed each; for a global map only.
    std::vector<std::uint64_t> keys;  ///< Of each voxel's block.
    std::vector<std::uint16_t> rows;
    std::vector<VoxelMark> marks;
  };
  std::vector<std::shared_ptr<const One>> maps;
};

/// In the order of paths. A global map next to local ones is taken to be made of these, and of the
/// sessions, which are not shown themselves. Fails with kUsage iff a file is missing, damaged or
/// named twice, there are local maps and more than one global one, sessions without both, or the
/// local maps do not match it (load_contributors, resolution and classes).
Outcome<ViewedMaps> load_viewed_maps(const std::vector<std::string>& paths,
                                     const std::vector<std::string>& sessions,
                                     const std::vector<std::string>& transforms);

/// The input of the viewer; it holds the maps.
std::vector<std::unique_ptr<ViewMap>> view_maps_of(const ViewedMaps& viewed);

}  // namespace tessera
