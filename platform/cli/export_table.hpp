// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Voxels of a map as PCD, NPY or CSV.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "cli/export_options.hpp"
#include "maps/stored_map.hpp"

namespace tessera {

/// By label; 0 is no label.
std::vector<std::string> label_names(const ClassTable& classes);

struct TableReport {
  std::uint64_t voxels = 0;
  Json counts = Json::object();  ///< Of a layer of robots.
};

/// Writes the voxels in the order of blocks, octets and voxels. Reads the map twice, as the header
/// has their number, and holds kChunk of them at a time; all of them if the layer is about robots.
/// Shows its progress on stderr. Fails as color_voxels() and VoxelTable do.
Outcome<TableReport> write_table(const ExportOptions& options, const StoredMap& stored);

}  // namespace tessera
