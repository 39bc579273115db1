// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the colours of exported voxels show: their class, who contributed them, where robots
// disagree, how certain their label is, or what was there and went.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/json.hpp"
#include "base/outcome.hpp"
#include "cli/height_layer.hpp"
#include "maps/stored_map.hpp"
#include "pictures/ply.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

struct LayerOptions {
  std::optional<std::string> show;      ///< Default: class; height if no voxel has a label.
  std::vector<std::string> of;          ///< Local maps.
  std::vector<std::string> sessions;    ///< Maps of earlier days, as for fuse.
  std::vector<std::string> transforms;  ///< Of both, as for fuse.
  std::uint64_t moving = 0;             ///< Labels that may move, a bit each: of the map.

  [[nodiscard]] std::string show_or_class() const { return show.value_or("class"); }
  [[nodiscard]] bool shows_moved() const { return show == "moved"; }
  /// Of a voxel that is free by now.
  [[nodiscard]] bool shows_as_moved(int label) const {
    return shows_moved() && label != 0 && (moving >> static_cast<unsigned>(label) & 1U) != 0;
  }
};

/// Exported voxels, and their places in the grid: by the same index, in the order of blocks, octets
/// and voxels.
struct ExportedVoxels {
  std::vector<PlyVoxel> voxels;
  std::vector<VoxelCoord> places;

  void add(const Lattice& lattice, const VoxelCoord& place, const Estimate& estimate);
};

/// What a layer adds to the picture and to the report.
struct Layer {
  std::vector<LegendEntry> legend;
  Json counts = Json::object();
};

/// Fails with kUsage iff show is not a layer, or the other options are missing or do not apply.
Outcome<void> check_layer(const LayerOptions& options);

/// Colours voxels of a map, and counts the robots of each if the layer is about robots; then they
/// must be all voxels. path: of the map, for messages. Warns about labels that none of the local
/// maps has. Fails with kUsage iff the local maps cannot be loaded (load_contributors), or do not
/// match the map.
Outcome<Layer> color_voxels(const LayerOptions& options, const Coloring& coloring,
                            const StoredMap& map, const std::string& path,
                            ExportedVoxels& exported);

}  // namespace tessera
