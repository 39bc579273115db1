// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "teams.hpp"

#include "tessera/map/internal/packed_block.hpp"

namespace tessera::bench {

namespace {

Scene part_of(const Scene& scene, std::size_t from, std::size_t to, float max_range_m) {
  Scene part;
  part.classes = scene.classes;
  part.max_points = scene.max_points;
  for (std::size_t s = from; s < to; ++s) {
    const Scan& scan = scene.scans[s];
    Scan near;
    near.T_map_sensor = scan.T_map_sensor;
    for (std::size_t i = 0; i < scan.components.size(); ++i) {
      const std::span<const float> point = std::span(scan.points_xyzi).subspan(4 * i, 4);
      const float square = point[0] * point[0] + point[1] * point[1] + point[2] * point[2];
      if (!(square <= max_range_m * max_range_m)) continue;
      near.points_xyzi.insert(near.points_xyzi.end(), point.begin(), point.end());
      near.components.push_back(scan.components[i]);
    }
    part.scans.push_back(std::move(near));
  }
  return part;
}

}  // namespace

Contribution contribution_of(Mapper& mapper) {
  const LocalMap& map = mapper.map();
  const int components = map.num_components();
  std::vector<std::byte> memory(BlockContent::required_bytes(components) + kArenaAlignment);
  Arena arena{std::span<std::byte>(memory)};
  BlockContent content = *BlockContent::make(arena, components);
  std::vector<std::byte> packed(most_packed_bytes(components));
  Contribution contribution;
  for (const KeyedIndex& item : map.blocks_in_order(mapper.workspace())) {
    content.clear();
    add_block(map, map.block_at(item.index), content);
    const std::size_t size = pack_block(content, packed);
    if (size == 0) continue;
    contribution.blocks.push_back(
        {BlockKey{item.key}, {packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size)}});
  }
  contribution.label_voxels = map.usage().label_voxels;
  return contribution;
}

Outcome<Team> map_team(const Scene& scene, double resolution_m, float max_range_m) {
  Team team;
  team.classes = scene.classes;
  const std::size_t half = scene.scans.size() / 2;
  for (std::size_t r = 0; r < team.robots.size(); ++r) {
    const Scene part =
        part_of(scene, r == 0 ? 0 : half, r == 0 ? half : scene.scans.size(), max_range_m);
    TESSERA_TRY_ASSIGN(Mapper mapper, Mapper::make(kMultiEntropyMode, part, resolution_m));
    TESSERA_TRY(mapper.integrate_all(part));
    team.map = mapper.map().config();
    team.robots[r] = contribution_of(mapper);
  }
  return team;
}

GlobalMapConfig config_for(const MapConfig& map, std::span<const Contribution> contributions) {
  std::uint32_t segments = 1;
  std::uint32_t blocks = 1;
  for (const Contribution& one : contributions) {
    blocks += static_cast<std::uint32_t>(one.blocks.size());
    for (const PublishedBlock& block : one.blocks)
      segments += SegmentStore::segments_of(block.bytes.size());
  }
  GlobalMapConfig config;
  config.map = map;
  config.map.max_evidence = 0.0F;
  config.replicas = {.segments = 2 * segments,
                     .blocks = 2 * blocks,
                     .contributions = 4,
                     .robot_segments = 2 * segments};
  config.blocks = 8 * blocks;
  config.sum_segments = 8 * segments;
  config.staged_bytes = config.map.storage_bytes;
  config.diffusion.length_m = static_cast<float>(2.0 * map.resolution_m);
  config.diffusion.prior = static_cast<float>(map.prior);
  return config;
}

Outcome<OwnedGlobalMap> OwnedGlobalMap::make(const GlobalMapConfig& config,
                                             const ClassTable& classes) {
  OwnedGlobalMap owned;
  owned.config_ = config;
  owned.classes_ = classes;
  owned.bytes_ =
      align_up(GlobalMap::required_bytes(config, classes.num_components()), kArenaAlignment);
  owned.memory_.reset(static_cast<std::byte*>(std::aligned_alloc(kArenaAlignment, owned.bytes_)));
  if (owned.memory_ == nullptr)
    return Failure{"the system does not give the memory for a global map", FailureKind::kFailure};
  owned.empty();
  return owned;
}

void OwnedGlobalMap::empty() {
  Arena arena(std::span<std::byte>(memory_.get(), bytes_));
  Result<GlobalMap> made = GlobalMap::make(arena, config_, classes_);
  if (!made.ok()) std::abort();  // the memory is as large as it asks for
  global_ = std::move(*made);
}

std::uint64_t OwnedGlobalMap::digest_of_map() {
  std::vector<KeyedIndex> workspace(2 * global_.map().block_count());
  return tessera::digest(global_.map(), workspace);
}

}  // namespace tessera::bench
