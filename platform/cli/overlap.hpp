// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The part of space in which several maps have labels.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "maps/stored_map.hpp"

namespace tessera {

/// A map, and the transform into its frame from that of the evaluated map.
struct OverlapMap {
  std::unique_ptr<StoredMap> stored;
  Matrix34d T_own_map = Matrix34d::Identity();
};

/// Fails with kUsage iff a file is missing or damaged, or has other classes than the evaluated map.
/// Frames are related by T_global_map; local maps of the same robot and epoch share the robot's. A
/// local map without T_global_map is taken to be in the global frame, as when maps are fused, with
/// a warning.
Outcome<std::vector<OverlapMap>> load_overlap(const std::vector<std::string>& paths,
                                              const StoredMap& evaluated,
                                              const std::string& evaluated_path);

/// True iff each of the maps has a label there; so without maps.
bool in_overlap(const std::vector<OverlapMap>& maps, const Point3f& p_map);

}  // namespace tessera
