// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/small_map.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

namespace tessera {

ClassTable table_of(int num_classes) {
  ClassTable table;
  for (int i = 1; i <= num_classes; ++i) {
    REQUIRE(table.add("class " + std::to_string(i), {}) == Status::kOk);
  }
  return table;
}

SmallMap::SmallMap(const MapConfig& config, int num_classes) : memory(required_bytes(config)) {
  Arena arena = memory.arena();
  Result<LocalMap> made = LocalMap::make(arena, config, table_of(num_classes));
  REQUIRE(made.ok());
  REQUIRE(arena.remaining_bytes() == 0);
  map = std::move(*made);
}

Status hit(LocalMap& map, VoxelCoord voxel, int component, float weight) {
  const Result<SlabHandle> block = map.open_block(block_of(voxel));
  if (!block.ok()) return block.status();
  OctetEvidence added;
  added.plane(component)[static_cast<std::size_t>(voxel_in_octet(voxel))] = weight;
  return map.add_labels(*block, octet_in_block(voxel), added);
}

VoxelMask mask_of(VoxelCoord voxel) {
  VoxelMask mask{};
  const int bit = (voxel.y & 7) * 8 + (voxel.x & 7);
  mask[static_cast<std::size_t>(voxel.z & 7)] = std::uint64_t{1} << static_cast<unsigned>(bit);
  return mask;
}

Status carve(LocalMap& map, VoxelCoord voxel) {
  const Result<SlabHandle> block = map.open_block(block_of(voxel));
  if (!block.ok()) return block.status();
  return map.add_free_pass(*block, mask_of(voxel));
}

void carve_layers(LocalMap& map, VoxelCoord voxel) {
  for (std::int32_t z = 0; z < kBlockEdge; z += 2)
    REQUIRE(carve(map, {voxel.x, voxel.y, voxel.z + z}) == Status::kOk);
}

double label_evidence(const LocalMap& map, VoxelCoord voxel) {
  const VoxelEvidence evidence = map.evidence(voxel);
  return evidence.total() - static_cast<double>(evidence.sigma[0]);
}

Content content_of(const LocalMap& map) {
  Content content;
  content.label_voxels = map.usage().label_voxels;
  content.free_voxels = map.count_free_voxels();
  content.revision = map.revision();
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    const Block& block = map.block_at(item.index);
    content.revisions[item.key] = block.revision;
    const BlockCoord coord = unpack(BlockKey{item.key});
    for (int i = 0; i < kBlockVoxels; ++i) {
      const VoxelCoord v{coord.x * 8 + i % 8, coord.y * 8 + i / 8 % 8, coord.z * 8 + i / 64};
      const VoxelEvidence evidence = map.evidence(v);
      const auto end = evidence.sigma.begin() + evidence.num_components;
      const bool none = std::all_of(evidence.sigma.begin(), end, [](float s) { return s == 0.0F; });
      if (none && evidence.rest == 0.0F) continue;
      std::vector<float>& counts = content.evidence[{v.z, v.y, v.x}];
      counts.assign(evidence.sigma.begin(), end);
      if (evidence.rest != 0.0F) counts.push_back(evidence.rest);
    }
  }
  return content;
}

namespace {

bool has_labels(const std::vector<float>& sigma) {
  return std::any_of(sigma.begin() + 1, sigma.end(), [](float s) { return s > 0.0F; });
}

}  // namespace

std::uint64_t recount_label_voxels(const Content& content) {
  std::uint64_t count = 0;
  for (const auto& [voxel, sigma] : content.evidence) count += has_labels(sigma) ? 1U : 0U;
  return count;
}

std::uint64_t recount_free_voxels(const Content& content) {
  return content.evidence.size() - recount_label_voxels(content);
}

}  // namespace tessera
