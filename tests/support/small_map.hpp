// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Small maps for tests: memory of exactly the size that the map asks for, single observations, and
// a picture of a whole map's content that two states can be compared by.
#pragma once

#include <array>
#include <map>
#include <tuple>
#include <vector>

#include "support/aligned_memory.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

/// A table of classes 1 .. num_classes.
ClassTable table_of(int num_classes);

/// Default settings but for dense counts, with storage of so many pages.
constexpr MapConfig config_of_pages(std::size_t pages) {
  MapConfig config;
  config.tuple = TuplePolicy::kDense;
  config.storage_bytes = pages * SlabPool::kPageBytes;
  return config;
}

/// A map that owns its memory.
struct SmallMap {
  explicit SmallMap(const MapConfig& config, int num_classes = 3);
  AlignedMemory memory;
  LocalMap map;
};

/// Opens the block of a voxel if needed and adds label evidence to that voxel.
Status hit(LocalMap& map, VoxelCoord voxel, int component, float weight);
/// Opens the block of a voxel if needed and adds one free pass to that voxel.
Status carve(LocalMap& map, VoxelCoord voxel);
/// Adds free passes so that the block of a voxel has its free pages for all layers, up from the
/// voxel, which must be in the lowest one.
void carve_layers(LocalMap& map, VoxelCoord voxel);
/// The mask with one voxel of its block.
VoxelMask mask_of(VoxelCoord voxel);

/// Sum of a voxel's evidence in the components 1 .. C + 1.
double label_evidence(const LocalMap& map, VoxelCoord voxel);

/// All that a map says: every voxel's counts, every block's revision, and its counters of content.
struct Content {
  std::map<std::tuple<int, int, int>, std::vector<float>>
      evidence;                                      ///< By (z, y, x), observed voxels only.
  std::map<std::uint64_t, std::uint32_t> revisions;  ///< Of blocks by key.
  std::uint64_t label_voxels = 0;
  std::uint64_t free_voxels = 0;
  std::uint32_t revision = 0;
  friend bool operator==(const Content&, const Content&) = default;
};
Content content_of(const LocalMap& map);

/// label_voxels and free_voxels counted anew from the voxels' evidence.
std::uint64_t recount_label_voxels(const Content& content);
std::uint64_t recount_free_voxels(const Content& content);

}  // namespace tessera
