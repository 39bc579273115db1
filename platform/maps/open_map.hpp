// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Any map file, as one map in memory.
#pragma once

#include <memory>
#include <string>

#include "maps/stored_map.hpp"

namespace tessera {

/// Reads a map file as load_map; a map that a node keeps while it maps (read_journal) as the map
/// that it is; one of submaps as the sum of them in their frames, as fuse
/// --diffusion none makes it: a local map, whose header has the content of that sum.
/// Fails as load_map, and with kUsage iff a submap is damaged or there are over
/// Replicas::kMostContributions. Of submaps, memory is that of all of them, of their sum twice, and
/// of its packed blocks.
Outcome<std::unique_ptr<StoredMap>> open_map(const std::string& path);

}  // namespace tessera
