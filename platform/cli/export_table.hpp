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

/// Voxels of a map that are exported.
struct Selection {
  std::uint64_t voxels = 0;
  Coloring coloring;
};
/// O(observed voxels).
Selection select_voxels(const ExportOptions& options, const LocalMap& map);

/// Writes the voxels in the order of blocks, octets and voxels. Holds kChunk of them at a time; all
/// of them if the layer is about robots. Shows its progress on stderr. Returns the counts of the
/// layer. Fails as color_voxels() and VoxelTable do.
Outcome<Json> write_table(const ExportOptions& options, const Selection& selection,
                          const StoredMap& stored);

}  // namespace tessera
